//! Two sectors of flash in RAM: bits only fall, but for an erase; places may be worn, and power may fail in the middle of anything.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::journal::{BLANK, Flash};

/// The sectors, what is wrong with them, and what was done to them.
#[derive(Clone, Debug)]
pub struct Ram {
    /// The words of each.
    pub sectors: [Vec<u32>; 2],
    /// Words and erases until one is cut short, and nothing after it is done; for good without a number.
    pub power: Option<usize>,
    /// How many of the next writes fail.
    pub worn: usize,
    /// Sectors erased so far.
    pub erased: Vec<usize>,
    rng: ChaCha8Rng,
}

/// Whether there is power for something.
enum Power {
    On,
    /// It fails in the middle: of the bits to change, those stay that chance has set here.
    Fails,
    Off,
}

impl Ram {
    /// Two blank sectors of so many words.
    pub fn blank(words: usize, seed: u64) -> Self {
        Self {
            sectors: [vec![BLANK; words], vec![BLANK; words]],
            power: None,
            worn: 0,
            erased: Vec::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Power is back for good; whether it had failed.
    pub fn switch_on(&mut self) -> bool {
        self.power.take() == Some(0)
    }

    /// What stands there, as bytes.
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
