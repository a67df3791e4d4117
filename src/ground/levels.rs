//! Which relays near by an end still has to tell how strong the interference is where it stands.

/// So many levels are said until the relays are greeted anew: one that was switched on since can read them again from then on.
const LEVELS_A_GREETING: u8 = 16;

/// What is said, and to whom.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    /// The interference, W, as last measured; 0 before.
    power_w: f32,
    /// The distances of the relays that are to be told: bit d - 1 for d.
    untold: u8,
    measured: u8,
}

impl Levels {
    /// Nothing was measured yet.
    pub(super) const NONE: Self = Self {
        power_w: 0.0,
        untold: 0,
        measured: 0,
    };

    /// A measurement, W, for the relays at distances 1 to `within`; whether they are to be greeted before they are told.
    pub(super) fn measured(&mut self, power_w: f32, within: u16) -> bool {
        self.power_w = power_w;
        self.untold = (1..=within).fold(0, |all, distance| all | bit(distance));
        self.measured = (self.measured + 1) % LEVELS_A_GREETING;
        self.measured == 0
    }

    /// A relay at that distance is there, and may not know yet.
    pub(super) fn owe(&mut self, distance: u16) {
        if self.power_w > 0.0 {
            self.untold |= bit(distance);
        }
    }

    /// The distance of the next relay to tell, of those within, and what: W.
    pub(super) fn take(&mut self, within: u16) -> Option<(u16, f32)> {
        let distance = (1..=within).find(|distance| self.untold & bit(*distance) != 0)?;
        self.untold &= !bit(distance);
        Some((distance, self.power_w))
    }
}

/// The bit of a relay that far away, 1 to 8.
const fn bit(distance: u16) -> u8 {
    match 1_u8.checked_shl(distance.saturating_sub(1) as u32) {
        Some(bit) => bit,
        None => 0,
    }
}
