//! Journal of records in two flash sectors. The newest record counts; it survives a loss of power at any moment.
//!
//! | word of a record | content |
//! | --- | --- |
//! | first | number, one more than that of the previous record |
//! | between | payload |
//! | last | CRC-32C of these words and of the journal's key |
//!
//! Records are appended to the sector with the newest one until it is full, then to the other sector. So the previous
//! record stays intact until a newer one has been read back. A record that was cut short, lies in worn flash or has
//! another key fails its CRC and is ignored.
//!
//! An erase stops the CPU. [`Journal::tidy`] erases at a start. In flight [`Journal::append`] erases only with
//! [`WhenFull::Erase`].

use uav_relay::CRC_32C;

/// Value of an erased word.
pub const BLANK: u32 = u32::MAX;

/// Number of words of a record besides its payload: sequence number and CRC.
pub const OVERHEAD: usize = 2;

/// Maximum number of attempts to write a record, each at a new place in the flash.
const TRIES: usize = 4;

/// Access to two flash sectors, numbered 0 and 1, possibly of different lengths.
pub trait Flash {
    /// Returns the number of words in the sector; 0 if there is no such sector.
    fn words(&self, sector: usize) -> usize;

    /// Returns the number of words in use: up to the last word that is not [`BLANK`].
    fn used(&mut self, sector: usize) -> usize;

    /// Returns a word of a sector; [`BLANK`] after the sector's end.
    fn read(&mut self, sector: usize, word: usize) -> u32;

    /// Erases a sector.
    fn erase(&mut self, sector: usize);

    /// Writes `words` to a sector, from its word `first` on. Returns true if the words are read back correctly.
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

/// Action of [`Journal::append`] when both sectors are full.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WhenFull {
    /// The new record is refused.
    Refuse,
    /// The sector without the newest record is erased, and then takes the new record.
    Erase,
}

/// Journal of records in two flash sectors. Only the newest record with a valid CRC is used.
#[derive(Debug)]
pub struct Journal<F> {
    flash: F,
    words: usize,
    key: u32,
}

#[derive(Clone, Copy)]
struct Found {
    newest: Option<Newest>,
    /// Number of records in the sector, valid or not.
    used: usize,
    room: usize,
}

/// Newest valid record of a sector. `Newest` values are ordered by their sequence numbers.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Newest {
    number: u32,
    record: usize,
}

impl<F: Flash> Journal<F> {
    /// Creates a journal whose records have `payload_words` words of payload.
    ///
    /// Records that were stored with a different `key` are ignored.
    pub const fn new(flash: F, payload_words: usize, key: u32) -> Self {
        Self {
            flash,
            words: payload_words + OVERHEAD,
            key,
        }
    }

    /// Returns the payload of the newest valid record, if any. `WORDS` must be the payload's length, words.
    ///
    /// Work: linear in the words of the sectors, plus CRCs of the newest valid record and of all later ones.
    pub fn newest<const WORDS: usize>(&mut self) -> Option<[u32; WORDS]> {
        let mut payload = [BLANK; WORDS];
        self.read_newest(&mut payload)?;
        Some(payload)
    }

    #[inline(never)] // one copy for all lengths
    fn read_newest(&mut self, payload: &mut [u32]) -> Option<()> {
        let found = self.found();
        let sector = current(found);
        let first = found.get(sector)?.newest?.record * self.words + 1;
        for (at, word) in (first..).zip(payload) {
            *word = self.flash.read(sector, at);
        }
        Some(())
    }

    /// Erases the used sectors that do not contain the newest record. Called at a start, so that an erase in flight is
    /// needed later.
    pub fn tidy(&mut self) {
        let found = self.found();
        let any = found.iter().any(|found| found.newest.is_some());
        for (sector, of) in found.iter().enumerate() {
            if of.used > 0 && !(any && sector == current(found)) {
                self.flash.erase(sector);
            }
        }
    }

    /// Stores `payload` as a new record; returns true if it was read back correctly.
    pub fn append(&mut self, payload: &[u32], when_full: WhenFull) -> bool {
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
                let behind = first + 1 + payload.len();
                // The CRC is written last, so that a record with a valid CRC is complete.
                let stands = self.flash.write(sector, first, &[number])
                    && self.flash.write(sector, first + 1, payload);
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

    /// Returns the sequence number of the record at index `record`; `None` if the record's CRC is wrong.
    fn number(&mut self, sector: usize, record: usize) -> Option<u32> {
        let first = record * self.words;
        let sum = self.sum(sector, first);
        let is_whole = self.flash.read(sector, first + self.words - 1) == sum;
        is_whole.then(|| self.flash.read(sector, first))
    }

    /// Returns the CRC of the record that begins at word `first`.
    ///
    /// The CRC covers all words of the record except the last (the CRC itself), and then the journal's key.
    #[inline(never)] // called from two places
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

/// Returns the index of the sector with the newest record; 0 if there is no record.
#[inline(never)] // called from several places
fn current(found: [Found; 2]) -> usize {
    let [first, second] = found.map(|found| found.newest);
    usize::from(second > first)
}

/// Packs bytes into little-endian words, padded with zeros.
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

/// Unpacks the first `BYTES` bytes of little-endian words.
pub fn unpack<const BYTES: usize>(words: &[u32]) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    let all = words.iter().flat_map(|word| word.to_le_bytes());
    for (byte, from) in bytes.iter_mut().zip(all) {
        *byte = from;
    }
    bytes
}
