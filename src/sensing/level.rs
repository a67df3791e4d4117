//! What the receiver on the ground hears.

/// What it hears.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Receiver {
    /// Mean interference, W; 0 if it has not said.
    pub power_w: f32,
    /// Of how many measurements, as far as they have not faded.
    pub count: f32,
}

impl Receiver {
    pub(crate) fn is_sound(self) -> bool {
        is_power(self.power_w) && (0.0..=1e9).contains(&self.count)
    }
}

/// Whether a receiver may hear that, W; 0 if it has not said.
pub(crate) fn is_power(power_w: f32) -> bool {
    power_w.to_bits() == 0 || (1e-30..=1e6).contains(&power_w)
}
