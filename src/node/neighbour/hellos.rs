//! Hellos that are owed on one side.

use super::hearing::{CANDIDATES, mask};

/// Candidates that are owed a hello, and those of them that are asked for one: bit 0 is the nearest node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hellos {
    owed: u8,
    asks: u8,
}

impl Hellos {
    pub(super) const NONE: Self = Self { owed: 0, asks: 0 };

    /// To the candidate `distance` nodes away, which may be one that asks.
    pub(super) const fn owe(&mut self, distance: u16, ask: bool) {
        let bit = mask(distance);
        self.owed |= bit;
        if ask {
            self.asks |= bit;
        }
    }

    /// To all of them, all asked.
    pub(super) const fn owe_all(&mut self) {
        self.owed = 0x0F;
        self.asks = 0x0F;
    }

    /// The nearest candidate that is owed one: how many nodes away, and whether it is asked.
    pub(super) fn take(&mut self) -> Option<(u16, bool)> {
        let distance = (1..=CANDIDATES).find(|distance| self.owed & mask(*distance) != 0)?;
        let bit = mask(distance);
        self.owed &= !bit;
        let ask = self.asks & bit != 0;
        self.asks &= !bit;
        Some((distance, ask))
    }
}
