//! Interference reports of a ground station to the relays nearby.

/// Number of reports between handshakes. A relay that has restarted can read reports after the next handshake.
const LEVELS_A_GREETING: u8 = 16;

/// Last measurement, and the relays that have not received it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    /// Last measured interference, W; 0 before the first.
    power_w: f32,
    /// Distances of relays without the last report: bit d - 1 for d.
    untold: u8,
    measured: u8,
}

impl Levels {
    /// State before the first measurement.
    pub(super) const NONE: Self = Self {
        power_w: 0.0,
        untold: 0,
        measured: 0,
    };

    /// Records a measurement, W, for the relays at distances 1 to `within`. Returns true if a handshake to them is due first.
    pub(super) fn measured(&mut self, power_w: f32, within: u16) -> bool {
        self.power_w = power_w;
        self.untold = (1..=within).fold(0, |all, distance| all | bit(distance));
        self.measured = (self.measured + 1) % LEVELS_A_GREETING;
        self.measured == 0
    }

    /// Schedules the report to the relay at `distance`, which has answered and may not have it.
    pub(super) fn owe(&mut self, distance: u16) {
        if self.power_w > 0.0 {
            self.untold |= bit(distance);
        }
    }

    /// Returns the distance of the next relay to send the report to, at most `within`, and the power, W.
    pub(super) fn take(&mut self, within: u16) -> Option<(u16, f32)> {
        let distance = (1..=within).find(|distance| self.untold & bit(*distance) != 0)?;
        self.untold &= !bit(distance);
        Some((distance, self.power_w))
    }
}

/// Returns the bit of the relay at `distance`, 1 to 8.
const fn bit(distance: u16) -> u8 {
    match 1_u8.checked_shl(distance.saturating_sub(1) as u32) {
        Some(bit) => bit,
        None => 0,
    }
}
