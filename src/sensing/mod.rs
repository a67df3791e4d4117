//! Estimation of an unknown interferer from the interference power that each relay measures.
//!
//! One source of `P` watts at (X, Y, 0) is received at (x, y, h) with I = P / (eta s), s = (X - x)^2 + (Y - y)^2 + h^2, by the
//! paper's path loss. So 1 / I is *linear* in the unknowns. In units of half the distance, u = 2 x / D - 1, t = 2 y / D, z = 2 h
//! / D, and of 1e-12 W, v = 1e-12 W / I:
//!
//! ```text
//! v = k (q + X'^2 + Y'^2 + 1/3) - 2 k X' u - 2 k Y' t,    q = u^2 - 1/3 + t^2 + z^2,    k = 1e-12 W eta D^2 / (4 P)
//! ```
//!
//! with X' = 2 X / D - 1 and Y' = 2 Y / D. The four terms 1, u, q and t are Legendre polynomials along the line, which keeps
//! their sums well conditioned in an f32.
//!
//! | file | content |
//! | --- | --- |
//! | `sums` | the terms of a position; the levels of the transmitter and the receiver; the sums that a pass collects |
//! | `fit` | the source that fits the sums, or the closest one, its uncertainty, and the reasons for no source |
//! | [`estimate`] | the chain's interference estimate, and the rules for its replacement; the velocity of a moving interferer |
//! | `doubt` | the relay whose measurements do not fit those of the others; the same for the transmitter and the receiver |
//!
//! Errors of measured powers are assumed to be *relative*: the mean of K independent samples has an error of 1 / sqrt(K), and
//! each position has an error of its own (shadowing). So each position counts once, with the weight 1 / v^2, however long a relay
//! hovers there. Accuracy: `host-tests/tests/sensing/`.

pub(crate) mod doubt;
pub mod estimate;
#[cfg(not(feature = "internals"))]
pub(crate) mod fit;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod fit;
#[cfg(not(feature = "internals"))]
pub(crate) mod sums;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod sums;

pub use fit::Unfit;

use crate::time::Duration;

/// Settings for the estimation of an unknown interferer from the relays' measurements.
///
/// ```
/// use uav_relay::{Listen, Settings};
///
/// // Eight relays follow an interferer that moves.
/// let settings = Settings { listen: Some(Listen::following(8)), ..Settings::default() };
/// assert!(settings.listen.is_some_and(|listen| listen.is_valid()));
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Listen {
    /// Interval between an agreement and the leader's next collection of measurements; above 0. While the collections change nothing, the
    /// interval grows to at most 64 times this value.
    pub every: Duration,
    /// Half-life of the weight of earlier measurements; above 0. Use a few seconds for a moving interferer. If it is at
    /// least ten times `every`, the interferer is assumed to be stationary. After five estimates the chain then moves
    /// again only if the interference changes by more than eight standard deviations.
    pub half_life: Duration,
    /// Relative error of a measurement, 1e-3 to 1: 1 / sqrt(number of independent samples in it).
    pub relative_error: f32,
}

impl Default for Listen {
    /// Returns settings for a stationary interferer: `every` 5 s, half-life 60 s, error 3 %. The mean of a thousand samples has this error.
    fn default() -> Self {
        Self {
            every: Duration::from_millis(5_000),
            half_life: Duration::from_millis(60_000),
            relative_error: 0.03,
        }
    }
}

impl Listen {
    /// Returns settings for a moving interferer: `every` 1 s, half-life 0.1 s + 16 s / `relays`.
    pub const fn following(relays: u16) -> Self {
        let relays = if relays > 0 { relays as u64 } else { 1 };
        Self {
            every: Duration::from_millis(1_000),
            half_life: Duration::from_millis(16_000 / relays + 100),
            relative_error: 0.03,
        }
    }

    /// Returns true if the interferer is assumed to be stationary.
    pub(crate) const fn is_source_fixed(&self) -> bool {
        self.half_life.as_micros() / 10 >= self.every.as_micros()
    }

    /// Returns true if interval, half-life and relative error are within their allowed ranges.
    pub fn is_valid(&self) -> bool {
        let timed = self.every.as_micros() > 0 && self.half_life.as_micros() > 0;
        timed && (1e-3..=1.0).contains(&self.relative_error)
    }
}
