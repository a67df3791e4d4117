//! A field as receivers with noise of their own hear it: what becomes of Upsilon.
//!
//! With noise of N watts a watt of signal is worth E[1 / (I + N)] at x. Of a field only Upsilon = E[1 / I] is known, and that does not
//! say how much I varies. At each point of the table this takes
//!
//! ```text
//! Upsilon_N = 1 / (1 / Upsilon + N) = Upsilon / (1 + N Upsilon)
//! ```
//!
//! and between two points the straight line, as without noise. So 1 / SINR = 1 / E(SIR) + 1 / SNR. This is E[1 / (I + N)] itself where
//! I does not vary, and an **upper bound** of it where it does: with u = 1 / I, 1 / (I + N) = u / (1 + N u), whose second derivative
//! -2 N / (1 + N u)^3 is below 0, so by Jensen's inequality E[u / (1 + N u)] <= E[u] / (1 + N E[u]). Nothing above 0 is a lower bound
//! by Upsilon alone: u = Upsilon / p with the probability p, and else next to 0, has this Upsilon and makes E[u / (1 + N u)] as small as
//! p does. Where the mean of I is known, 1 / (E[I] + N) is one, for 1 / (I + N) is convex in I. How far the bound is off for Beta
//! distributions: `noise_in_a_field_is_bounded_from_above` in `host-tests/tests/noise/field.rs`.
//!
//! A relay that measures needs no bound: its receiver hears I + N, and so what it estimates is E[1 / (I + N)].

use super::{Field, FieldPoint};

/// A field, and the noise it is heard in.
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
    /// The field as it is heard by receivers with noise of `noise_w` watts, 0 to 1.
    pub(crate) const fn in_noise(&self, noise_w: f32) -> InNoise<'_> {
        InNoise {
            field: self,
            noise_w,
        }
    }
}

impl InNoise<'_> {
    /// What becomes of an Upsilon, 1/W; with no noise nothing does. `Upsilon` is up to 1e32 and N up to 1, so all is finite.
    const fn of(&self, upsilon: f32) -> f32 {
        if self.noise_w > 0.0 {
            upsilon / (1.0 + self.noise_w * upsilon)
        } else {
            upsilon
        }
    }

    /// Upsilon at `x_m`, 1/W, as [`Field::upsilon`] has it without noise.
    pub(crate) const fn upsilon(&self, x_m: f32) -> f32 {
        match self.field.around(x_m) {
            (left, Some(right)) => super::between(self.point(left), self.point(right), x_m),
            (end, None) => self.of(end.upsilon_per_w),
        }
    }

    /// The largest Upsilon anywhere: what is larger without noise is so with it.
    pub(crate) const fn largest(&self) -> f32 {
        self.of(self.field.largest)
    }

    /// Whether Upsilon is the same everywhere.
    pub(crate) const fn is_constant(&self) -> bool {
        !(self.of(self.field.smallest) < self.largest())
    }

    /// The points of the table, without noise.
    pub(crate) const fn points(&self) -> &'static [FieldPoint] {
        self.field.points
    }

    /// One of them with it.
    pub(crate) const fn point(&self, point: FieldPoint) -> FieldPoint {
        FieldPoint {
            x_m: point.x_m,
            upsilon_per_w: self.of(point.upsilon_per_w),
        }
    }
}
