//! Interference level at an end of the chain, on the ground, and the measurable range of powers.

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

/// Measurable range of interference, W, without the receiver's noise.
///
/// The square of a value and of the ratio of any two is finite in the units of [`sensing`](crate::sensing); others are rejected.
pub const MEASURED_W: (f32, f32) = (1e-30, 1e6);

/// Interference level at an end.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Level {
    /// Mean interference, W; 0 without a measurement.
    pub power_w: f32,
    /// Number of measurements, after fading.
    pub count: f32,
}

/// Ends whose measurements do not fit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct EndsOff {
    pub(crate) transmitter: bool,
    pub(crate) receiver: bool,
    /// The measurements do not fit, and the faulty one is unknown.
    pub(crate) unknown: bool,
}

impl EndsOff {
    pub(crate) const NONE: Self = Self {
        transmitter: false,
        receiver: false,
        unknown: false,
    };
}

/// Levels of both ends, and the ends that did not fit before.
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

    pub(crate) fn is_heard(self) -> bool {
        self.power_w > 0.0 && self.count > 0.0
    }
}

/// Returns true if `power_w` is a valid level, W; 0 means no measurement.
pub(crate) fn is_power(power_w: f32) -> bool {
    power_w.to_bits() == 0 || is_level(power_w)
}

/// Returns true if `power_w` is in the measurable range, W.
pub(crate) fn is_level(power_w: f32) -> bool {
    (MEASURED_W.0..=MEASURED_W.1).contains(&power_w)
}
