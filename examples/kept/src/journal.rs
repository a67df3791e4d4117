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

use uav_relay::wire::crc::CRC_32C;

/// A word in which nothing is written.
pub const BLANK: u32 = u32::MAX;

/// Words of a record beside what is kept.
pub const AROUND: usize = 2;

/// Places that are tried for one record: some may be worn.
const TRIES: usize = 4;

/// Two sectors of flash, 0 and 1.
pub trait Flash {
    /// What stands in a sector.
    fn words(&self, sector: usize) -> &[u32];

    /// Makes a sector blank.
    fn erase(&mut self, sector: usize);

    /// Writes words from that one of a sector on, and reads them back; whether they stand there.
    fn write(&mut self, sector: usize, first: usize, words: &[u32]) -> bool;
}

/// What [`Journal::keep`] does when both sectors are full.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WhenFull {
    /// Keeps nothing.
    #[allow(
        dead_code,
        reason = "for uploads alone, which an image may be built without"
    )]
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

    /// What was kept last. Linear in the words of the sectors; a CRC for each record behind the newest, and for that one.
    pub fn newest(&self) -> Option<&[u32]> {
        let found = self.found();
        let sector = current(found);
        let newest = found.get(sector)?.newest?;
        match self.record(sector, newest.record)? {
            [_, kept @ .., _] => Some(kept),
            _ => None,
        }
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
            let sum = check(number, kept, self.key);
            let mut places = used..room.min(used + TRIES);
            return places.any(|record| {
                let first = record * self.words;
                let behind = first + 1 + kept.len();
                // The CRC is last: what has one is whole.
                self.flash.write(sector, first, &[number])
                    && self.flash.write(sector, first + 1, kept)
                    && self.flash.write(sector, behind, &[sum])
            });
        }
        false
    }

    fn record(&self, sector: usize, record: usize) -> Option<&[u32]> {
        let from = self.flash.words(sector).get(record * self.words..)?;
        from.get(..self.words)
    }

    fn found(&self) -> [Found; 2] {
        [0, 1].map(|sector| {
            let room = self.flash.words(sector).len().checked_div(self.words);
            let room = room.unwrap_or(0);
            let is_used = |at: &usize| {
                let record = self.record(sector, *at).unwrap_or_default();
                record.iter().any(|word| *word != BLANK)
            };
            let used = (0..room).rev().find(is_used).map_or(0, |last| last + 1);
            let newest = (0..used).rev().find_map(|record| {
                let number = number(self.record(sector, record)?, self.key)?;
                Some(Newest { number, record })
            });
            Found { newest, used, room }
        })
    }
}

/// The sector with the newest record, 0 where there is none.
fn current(found: [Found; 2]) -> usize {
    let [first, second] = found.map(|found| found.newest);
    usize::from(second > first)
}

/// The number of a record that is whole and has that key.
fn number(record: &[u32], key: u32) -> Option<u32> {
    let [number, kept @ .., sum] = record else {
        return None;
    };
    (check(*number, kept, key) == *sum).then_some(*number)
}

fn check(number: u32, kept: &[u32], key: u32) -> u32 {
    let mut crc = CRC_32C.digest();
    for word in [&number].into_iter().chain(kept).chain([&key]) {
        crc.update(&word.to_le_bytes());
    }
    crc.finalize()
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
