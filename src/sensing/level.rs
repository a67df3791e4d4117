//! How strong the interference is at an end of the chain, on the ground; and what powers may be measured anywhere.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

/// The least and the largest interference that may be measured, W, at a relay less the noise of its receiver. The square of each, and of
/// the ratio of any two, taken as [`sensing`](crate::sensing) takes them, is a finite number; what is outside is refused.
pub const MEASURED_W: (f32, f32) = (1e-30, 1e6);

/// What an end hears.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Level {
    /// Mean interference, W; 0 if it has not said.
    pub power_w: f32,
    /// Of how many measurements, as far as they have not faded.
    pub count: f32,
}

/// Which ends are off, the transmitter and the receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct EndsOff {
    pub(crate) transmitter: bool,
    pub(crate) receiver: bool,
    /// They do not fit, and nobody knows who is wrong.
    pub(crate) unknown: bool,
}

impl EndsOff {
    pub(crate) const NONE: Self = Self {
        transmitter: false,
        receiver: false,
        unknown: false,
    };
}

/// What both ends hear, and which of them were off.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Levels {
    pub(crate) transmitter: Level,
    pub(crate) receiver: Level,
    pub(crate) off: EndsOff,
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
    (MEASURED_W.0..=MEASURED_W.1).contains(&power_w)
}
