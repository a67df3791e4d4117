//! Field with receiver noise: the effective Upsilon.
//!
//! With noise of N watts a watt of signal is worth E[1 / (I + N)] at x. A field only has Upsilon = E[1 / I], without the variance
//! of I. At each point of the table this module uses
//!
//! ```text
//! Upsilon_N = 1 / (1 / Upsilon + N) = Upsilon / (1 + N Upsilon)
//! ```
//!
//! and between two points a straight line, as without noise. So 1 / SINR = 1 / E(SIR) + 1 / SNR. This equals E[1 / (I + N)] if I
//! is constant, and is an **upper bound** of it otherwise: with u = 1 / I, 1 / (I + N) = u / (1 + N u), whose second derivative
//! -2 N / (1 + N u)^3 is below 0, so by Jensen's inequality E[u / (1 + N u)] <= E[u] / (1 + N E[u]). Upsilon alone gives no lower
//! bound above 0: u = Upsilon / p with the probability p, and otherwise nearly 0, has this Upsilon, and E[u / (1 + N u)] falls
//! with p. If the mean of I is known, 1 / (E[I] + N) is a lower bound, because 1 / (I + N) is convex in I. The error of the bound
//! for Beta distributions: `noise_in_a_field_is_bounded_from_above` in `host-tests/tests/noise/field.rs`.
//!
//! A relay that measures needs no bound: its receiver measures I + N, so its estimate is E[1 / (I + N)].

use super::{Field, FieldPoint};

/// Interference field (known interference along x) combined with the power N of the receiver noise, W. With noise,
/// Upsilon = E[1/I] becomes Upsilon / (1 + N Upsilon).
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(
    unreachable_pub,
    reason = "public through `optimiser` with the feature `internals`"
)]
pub struct InNoise<'a> {
    field: &'a Field,
    noise_w: f32,
}

impl Field {
    /// Returns this field combined with a receiver noise of `noise_w` watts, 0 to 1.
    pub(crate) const fn in_noise(&self, noise_w: f32) -> InNoise<'_> {
        InNoise {
            field: self,
            noise_w,
        }
    }
}

impl InNoise<'_> {
    /// Returns Upsilon = E[1/I] with the noise N included, 1/W: `upsilon` / (1 + N `upsilon`). The result is finite,
    /// because `upsilon` is at most 1e32 and N at most 1.
    const fn of(&self, upsilon: f32) -> f32 {
        if self.noise_w > 0.0 {
            upsilon / (1.0 + self.noise_w * upsilon)
        } else {
            upsilon
        }
    }

    /// Returns Upsilon = E[1/I] at `x_m` with the receiver noise included, 1/W. The value is interpolated as in
    /// [`Field::upsilon`].
    pub const fn upsilon(&self, x_m: f32) -> f32 {
        match self.field.around(x_m) {
            (left, Some(right)) => super::between(self.point(left), self.point(right), x_m),
            (end, None) => self.of(end.upsilon_per_w),
        }
    }

    /// Returns the largest Upsilon = E[1/I] of the field with the receiver noise included, 1/W.
    pub(crate) const fn largest(&self) -> f32 {
        self.of(self.field.largest)
    }

    pub(crate) const fn is_constant(&self) -> bool {
        !(self.of(self.field.smallest) < self.largest())
    }

    pub(crate) const fn points(&self) -> &'static [FieldPoint] {
        self.field.points
    }

    pub(crate) const fn point(&self, point: FieldPoint) -> FieldPoint {
        FieldPoint {
            x_m: point.x_m,
            upsilon_per_w: self.of(point.upsilon_per_w),
        }
    }
}
