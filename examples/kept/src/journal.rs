//! A log of records in two sectors of flash, of which the newest counts: it survives a loss of power at any moment.
//!
//! | word of a record | what |
//! | --- | --- |
//! | first | its number, one more than that of the record before it |
//! | between | what is kept |
//! | last | CRC-32C of these words and of the log's key |
//!
//! Records are appended, to the sector with the newest until that is full, then to the other one. So what was kept last stays where it
//! is until a newer record has been read back. A record that was cut short, or whose place is worn, has no such CRC and counts for
//! nothing. Records with another key count for nothing either.
//!
//! An erase stops the CPU. [`Journal::tidy`] does it at a start; in flight [`Journal::keep`] does it only where it is told that it may.

use uav_relay::CRC_32C;

/// A word in which nothing is written.
pub const BLANK: u32 = u32::MAX;

/// Words of a record beside what is kept.
pub const AROUND: usize = 2;

/// Places that are tried for one record: some may be worn.
const TRIES: usize = 4;

/// Two sectors of flash, 0 and 1. They need not be of one length.
pub trait Flash {
    /// Words in a sector; 0 where there is none.
    fn words(&self, sector: usize) -> usize;

    /// Words of a sector up to the last that is not [`BLANK`]: a flash knows best how to look through all of it.
    fn used(&mut self, sector: usize) -> usize;

    /// What stands in that word of a sector; [`BLANK`] behind its end.
    fn read(&mut self, sector: usize, word: usize) -> u32;

    /// Makes a sector blank.
    fn erase(&mut self, sector: usize);

    /// Writes words from that one of a sector on, and reads them back; whether they stand there.
    fn write(&mut self, sector: usize, first: usize, words: &[u32]) -> bool;
}

impl<F: Flash> Flash for &mut F {
    fn words(&self, sector: usize) -> usize {
        F::words(self, sector)
    }

    fn used(&mut self, sector: usize) -> usize {
        F::used(self, sector)
    }

    fn read(&mut self, sector: usize, word: usize) -> u32 {
        F::read(self, sector, word)
    }

    fn erase(&mut self, sector: usize) {
        F::erase(self, sector);
    }

    fn write(&mut self, sector: usize, first: usize, words: &[u32]) -> bool {
        F::write(self, sector, first, words)
    }
}

/// What [`Journal::keep`] does when both sectors are full.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WhenFull {
    /// Keeps nothing.
    Refuse,
    /// Erases the sector that does not have the newest record, and goes on there.
    Erase,
}

/// A log.
#[derive(Debug)]
pub struct Journal<F> {
    flash: F,
    /// Of a record.
    words: usize,
    key: u32,
}

/// What stands in a sector.
#[derive(Clone, Copy)]
struct Found {
    newest: Option<Newest>,
    /// Records up to the last that is not blank.
    used: usize,
    room: usize,
}

/// Compared by number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Newest {
    number: u32,
    record: usize,
}

impl<F: Flash> Journal<F> {
    /// The log in `flash` of records that keep `kept` words each.
    pub const fn new(flash: F, kept: usize, key: u32) -> Self {
        Self {
            flash,
            words: kept + AROUND,
            key,
        }
    }

    /// What was kept last, `KEPT` being as many words as this log keeps. Linear in the words of the sectors; a CRC for each record behind
    /// the newest, and for that one.
    pub fn newest<const KEPT: usize>(&mut self) -> Option<[u32; KEPT]> {
        let mut kept = [BLANK; KEPT];
        self.read_newest(&mut kept)?;
        Some(kept)
    }

    #[inline(never)] // one for all lengths
    fn read_newest(&mut self, kept: &mut [u32]) -> Option<()> {
        let found = self.found();
        let sector = current(found);
        let first = found.get(sector)?.newest?.record * self.words + 1;
        for (at, word) in (first..).zip(kept) {
            *word = self.flash.read(sector, at);
        }
        Some(())
    }

    /// At a start: makes each sector blank that is not, and does not have the newest record. Then the log has room for all records of
    /// a sector before anything has to be erased.
    pub fn tidy(&mut self) {
        let found = self.found();
        let any = found.iter().any(|found| found.newest.is_some());
        for (sector, of) in found.iter().enumerate() {
            if of.used > 0 && !(any && sector == current(found)) {
                self.flash.erase(sector);
            }
        }
    }

    /// Keeps these words; whether they stand in the flash.
    pub fn keep(&mut self, kept: &[u32], when_full: WhenFull) -> bool {
        let found = self.found();
        let [first, second] = found.map(|found| found.newest);
        let newest = first.max(second);
        let number = newest.map_or(0, |newest| newest.number.wrapping_add(1));
        let current = current(found);
        for sector in [current, 1 - current] {
            let Some(&Found { mut used, room, .. }) = found.get(sector) else {
                return false;
            };
            if used >= room {
                if sector == current || when_full == WhenFull::Refuse {
                    continue;
                }
                self.flash.erase(sector);
                used = 0;
            }
            let mut places = used..room.min(used + TRIES);
            return places.any(|record| {
                let first = record * self.words;
                let behind = first + 1 + kept.len();
                // The CRC is last: what has one is whole.
                let stands = self.flash.write(sector, first, &[number])
                    && self.flash.write(sector, first + 1, kept);
                let sum = self.sum(sector, first);
                stands && self.flash.write(sector, behind, &[sum])
            });
        }
        false
    }

    fn found(&mut self) -> [Found; 2] {
        [0, 1].map(|sector| {
            let records = |words: usize| words.checked_div(self.words).unwrap_or(0);
            let room = records(self.flash.words(sector));
            let used = records(self.flash.used(sector) + self.words - 1).min(room);
            let newest = (0..used).rev().find_map(|record| {
                let number = self.number(sector, record)?;
                Some(Newest { number, record })
            });
            Found { newest, used, room }
        })
    }

    /// The number of a record that is whole and has this log's key.
    fn number(&mut self, sector: usize, record: usize) -> Option<u32> {
        let first = record * self.words;
        let sum = self.sum(sector, first);
        let is_whole = self.flash.read(sector, first + self.words - 1) == sum;
        is_whole.then(|| self.flash.read(sector, first))
    }

    /// The CRC of the record that begins at that word, but for its last word, and of this log's key.
    #[inline(never)] // there are two who want it
    fn sum(&mut self, sector: usize, first: usize) -> u32 {
        let mut crc = CRC_32C.digest();
        let last = first + self.words - 1;
        for at in first..=last {
            let word = if at == last {
                self.key
            } else {
                self.flash.read(sector, at)
            };
            crc.update(&word.to_le_bytes());
        }
        crc.finalize()
    }
}

/// The sector with the newest record, 0 where there is none.
fn current(found: [Found; 2]) -> usize {
    let [first, second] = found.map(|found| found.newest);
    usize::from(second > first)
}

/// Bytes as words, with zeros behind them.
pub fn pack<const WORDS: usize>(bytes: &[u8]) -> [u32; WORDS] {
    let mut words = [0; WORDS];
    for (word, bytes) in words.iter_mut().zip(bytes.chunks(4)) {
        let mut whole = [0; 4];
        for (to, byte) in whole.iter_mut().zip(bytes) {
            *to = *byte;
        }
        *word = u32::from_le_bytes(whole);
    }
    words
}

/// The first bytes of words.
pub fn unpack<const BYTES: usize>(words: &[u32]) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    let all = words.iter().flat_map(|word| word.to_le_bytes());
    for (byte, from) in bytes.iter_mut().zip(all) {
        *byte = from;
    }
    bytes
}
