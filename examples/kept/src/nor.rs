//! Two sectors of a flash, accessed through the traits of `embedded-storage`. Most HALs implement them.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

use crate::journal::{BLANK, Flash};

const WORD: usize = 4;

/// Number of words that one driver call reads or writes. Single words would be slow, because a driver call takes longer
/// than the transfer of a word.
const PIECE: usize = 16;

/// Journal storage in two sectors of a NOR flash, given by their offsets in the flash.
///
/// Each sector consists of one or more erase units. The flash must permit reads and writes of single words.
#[derive(Debug)]
pub struct Nor<F> {
    flash: F,
    sectors: [Range<u32>; 2],
    /// Cache of the last read: number of the sector, index of the first word in the sector, the words.
    last: Option<(usize, usize, [[u8; WORD]; PIECE])>,
}

impl<F: NorFlash> Nor<F> {
    /// Creates the access to two sectors of `flash`, which may be a `&mut` reference.
    pub const fn new(flash: F, sectors: [Range<u32>; 2]) -> Self {
        const {
            assert!(WORD.is_multiple_of(F::READ_SIZE) && WORD.is_multiple_of(F::WRITE_SIZE));
        }
        Self {
            flash,
            sectors,
            last: None,
        }
    }

    /// Returns the flash offset of word `first` of a sector.
    ///
    /// `None` if the sector has fewer than `words` words from `first` on.
    fn place(&self, sector: usize, first: usize, words: usize) -> Option<u32> {
        let start = self.sectors.get(sector)?.start;
        let end = first.checked_add(words)?;
        let is_in = end <= self.words(sector);
        let bytes = u32::try_from(first.checked_mul(WORD)?).ok()?;
        start.checked_add(bytes).filter(|_| is_in)
    }

    /// Returns word number `word` of a sector, read through the cache; `None` on a read fault.
    fn word(&mut self, sector: usize, word: usize) -> Option<u32> {
        let (first, at) = (word - word % PIECE, word % PIECE);
        if self
            .last
            .is_none_or(|last| (last.0, last.1) != (sector, first))
        {
            let count = self.words(sector).checked_sub(first)?.min(PIECE);
            let place = self.place(sector, first, count)?;
            let mut piece = [[0xFF; WORD]; PIECE];
            let bytes = piece.get_mut(..count)?.as_flattened_mut();
            self.flash.read(place, bytes).ok()?;
            self.last = Some((sector, first, piece));
        }
        let (_, _, piece) = self.last.as_ref()?;
        piece.get(at).map(|bytes| u32::from_le_bytes(*bytes))
    }

    fn write_all(&mut self, sector: usize, first: usize, words: &[u32]) -> Option<()> {
        self.place(sector, first, words.len())?;
        self.last = None;
        let mut bytes = [[0; WORD]; PIECE];
        for (at, words) in (first..).step_by(PIECE).zip(words.chunks(PIECE)) {
            let place = self.place(sector, at, words.len())?;
            let bytes = bytes.get_mut(..words.len())?;
            for (bytes, word) in bytes.iter_mut().zip(words) {
                *bytes = word.to_le_bytes();
            }
            self.flash.write(place, bytes.as_flattened()).ok()?;
        }
        let mut words = (first..).zip(words);
        let stand = words.all(|(at, word)| self.word(sector, at) == Some(*word));
        stand.then_some(())
    }
}

impl<F: NorFlash> Flash for Nor<F> {
    fn words(&self, sector: usize) -> usize {
        self.sectors.get(sector).map_or(0, Range::len) / WORD
    }

    fn used(&mut self, sector: usize) -> usize {
        let mut words = (0..self.words(sector)).rev();
        let last = words.find(|at| self.read(sector, *at) != BLANK);
        last.map_or(0, |last| last + 1)
    }

    fn read(&mut self, sector: usize, word: usize) -> u32 {
        self.word(sector, word).unwrap_or(BLANK)
    }

    fn erase(&mut self, sector: usize) {
        self.last = None;
        if let Some(range) = self.sectors.get(sector) {
            // A failed erase is noticed when a write is read back.
            let _ = self.flash.erase(range.start, range.end);
        }
    }

    fn write(&mut self, sector: usize, first: usize, words: &[u32]) -> bool {
        self.write_all(sector, first, words).is_some()
    }
}
