//! Mock of two flash sectors in RAM. Writes only clear bits; words may be worn, and power may fail at any time.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::journal::{BLANK, Flash};

/// Mock of two flash sectors in RAM, with wear and loss of power.
#[derive(Debug)]
pub struct Ram {
    /// Content of each sector, words of 32 bits.
    pub sectors: [Vec<u32>; 2],
    /// Number of writes and erases until the power fails; it fails during the last of these operations.
    ///
    /// A write is a word of 32 bits. The number is 0 while the power is off, and `None` if no failure is planned.
    pub power: Option<usize>,
    /// Number of the following writes that fail because of wear.
    pub worn: usize,
    /// Indices of the erased sectors, in order.
    pub erased: Vec<usize>,
    rng: ChaCha8Rng,
}

enum Power {
    On,
    /// Power fails during this write or erase, so only some of the bits change.
    Fails,
    Off,
}

impl Ram {
    /// Creates two blank flash sectors of `words` words each; `seed` is the seed of the random faults.
    pub fn blank(words: usize, seed: u64) -> Self {
        Self {
            sectors: [vec![BLANK; words], vec![BLANK; words]],
            power: None,
            worn: 0,
            erased: Vec::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Creates a copy of the sectors and their faults, with random numbers from a new `seed`.
    pub fn copy(&self, seed: u64) -> Self {
        Self {
            sectors: self.sectors.clone(),
            power: self.power,
            worn: self.worn,
            erased: self.erased.clone(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Switches the power on, and cancels a planned power failure. Returns true if the power had failed.
    pub fn switch_on(&mut self) -> bool {
        self.power.take() == Some(0)
    }

    /// Returns the content of both sectors, one after the other, as little-endian bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let words = self.sectors.iter().flatten();
        words.flat_map(|word| word.to_le_bytes()).collect()
    }

    fn draw(&mut self) -> Power {
        match &mut self.power {
            None => Power::On,
            Some(0) => Power::Off,
            Some(left) => {
                *left -= 1;
                if *left == 0 { Power::Fails } else { Power::On }
            }
        }
    }
}

impl Flash for Ram {
    fn words(&self, sector: usize) -> usize {
        self.sectors[sector].len()
    }

    fn used(&mut self, sector: usize) -> usize {
        let last = self.sectors[sector].iter().rposition(|word| *word != BLANK);
        last.map_or(0, |last| last + 1)
    }

    fn read(&mut self, sector: usize, word: usize) -> u32 {
        self.sectors[sector].get(word).copied().unwrap_or(BLANK)
    }

    fn erase(&mut self, sector: usize) {
        let power = self.draw();
        if !matches!(power, Power::Off) {
            self.erased.push(sector);
        }
        for word in &mut self.sectors[sector] {
            *word |= match power {
                Power::On => BLANK,
                Power::Fails => self.rng.random(),
                Power::Off => 0,
            };
        }
    }

    fn write(&mut self, sector: usize, first: usize, words: &[u32]) -> bool {
        let worn = self.worn > 0;
        self.worn = self.worn.saturating_sub(1);
        for (at, word) in (first..).zip(words) {
            let left = match self.draw() {
                Power::On if !worn => 0,
                Power::Off => BLANK,
                _ => self.rng.random(),
            };
            self.sectors[sector][at] &= *word | left;
        }
        !worn && self.power != Some(0) && self.sectors[sector][first..first + words.len()] == *words
    }
}
