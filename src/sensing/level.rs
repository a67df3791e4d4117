//! How strong the interference is at an end of the chain, on the ground.

/// What an end hears.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Level {
    /// Mean interference, W; 0 if it has not said.
    pub power_w: f32,
    /// Of how many measurements, as far as they have not faded.
    pub count: f32,
}

/// What both ends hear.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Levels {
    pub(crate) transmitter: Level,
    pub(crate) receiver: Level,
}

impl Level {
    pub(crate) fn is_sound(self) -> bool {
        is_power(self.power_w) && (0.0..=1e9).contains(&self.count)
    }

    /// Whether it says anything.
    pub(crate) fn is_heard(self) -> bool {
        self.power_w > 0.0 && self.count > 0.0
    }
}

/// Whether an end may hear that, W; 0 if it has not said.
pub(crate) fn is_power(power_w: f32) -> bool {
    power_w.to_bits() == 0 || is_level(power_w)
}

/// Whether an end may say that it hears that, W.
pub(crate) fn is_level(power_w: f32) -> bool {
    (1e-30..=1e6).contains(&power_w)
}
