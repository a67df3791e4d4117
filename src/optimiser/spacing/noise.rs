//! Reach of a hop with receiver noise: a bounded search on intervals of known curvature.
//!
//! In the notation of [`spacing`](super), with rho = gamma / A, s(d) = (d - u)^2 + a^2 the squared distance from the interferer,
//! l(d) = d^2 + b^2 that from the sender, and nu = N eta / P the noise over the interferer's power received at 1 m, the
//! interference P / (eta s) becomes P / (eta s) + N, and so
//!
//! ```text
//! SINR = A s / (l (1 + nu s)) >= gamma   <=>   g(d) = q(s(d)) - rho l(d) >= 0,    q(s) = s / (1 + nu s)
//! ```
//!
//! which times 1 + nu s is a quartic in d. Only its last root before `high` is needed, and the search finds it from above. One
//! bound is the noise-free reach, since a target that is missed without noise is missed with it; the other is the SNR alone, rho
//! nu l <= 1. Where SINR only falls with d, the smaller bound is within a factor of sqrt(2) of the root.
//!
//! **Curvature.** With w = 1 + nu s, v = 1 + nu a^2 and t = d - u
//!
//! ```text
//! g'' / 2 = (v - 3 nu t^2) / w^3 - rho
//! ```
//!
//! falls with |t| where it is above 0. So g is concave everywhere if rho v^2 >= 1; otherwise it is convex within T of the
//! interferer, and concave before and beyond. At T, w is the root of rho w^3 + 3 w = 4 v. The left side rises, so there is one
//! root, found from 4 v / 3 by Newton's method from above.
//!
//! **Search**, from the right, on at most three intervals, each of which starts where g < 0:
//!
//! - On a concave interval Newton's tangents from the right are above g, so no step passes the last root, and the first step that
//!   does not fall or leaves the interval proves that there is none.
//! - On the convex interval g has a root if and only if g >= 0 at its left end, and then exactly one. Newton's tangents from the
//!   left are below g, so no step passes it; each step is at least a bisection step.
//!
//! g falls with rho and, at a given position, with the distance of the sender. So the reach falls with the target and rises with
//! the sender's x, as without noise. Accuracy: `reaches_in_noise_agree_with_the_reference` in `host-tests/tests/noise/`.

use super::{Hop, rounded};
use crate::root::sqrt;
use crate::sir::square;

/// Newton steps on a concave interval. Four to eight are usual; near a double root each halves the error.
const STEPS: u8 = 32;

/// Steps on the convex interval; each at least halves it.
const HALVINGS: u8 = 32;

/// Newton steps to the inflection point; the worst case is exact to an f32 after four.
const TURNS: u8 = 5;

/// Rounding error of g relative to rho l: a target that is missed by at most this counts as met.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Step, relative to d, at which the iteration ends.
const CLOSE: f32 = 5e-7;

impl Hop {
    pub(in crate::optimiser) fn is_silent(&self) -> bool {
        !(self.noise > 0.0)
    }

    /// Returns [`Hop::reach`] with noise, which is at most that without it.
    #[inline(never)] // keeps a sweep without noise small
    pub(super) fn in_noise(&self, target: f32, from_m: f32) -> Option<f32> {
        let place = self.in_silence(target, from_m)?;
        let hop = self.noisy(target, from_m);
        let most = place - from_m;
        if place >= self.end_m && hop.is_met(most) {
            return Some(place);
        }
        let d = hop.last(self.least_step, hop.through_noise()?.min(most))?;
        rounded(from_m, d)
    }

    pub(super) fn noisy(&self, target: f32, from_m: f32) -> NoisyHop {
        NoisyHop {
            ratio: self.sender.gain.ratio(target),
            excess: self.sender.gain.excess(target),
            ahead: self.interferer_x_m - from_m,
            aside_squared: self.aside_squared,
            across_squared: self.across_squared,
            base: self.base,
            noise: self.noise,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct NoisyHop {
    /// rho = gamma / A.
    pub(super) ratio: f32,
    /// rho - 1.
    pub(super) excess: f32,
    /// u, m.
    pub(super) ahead: f32,
    /// Value of a^2, m^2.
    pub(super) aside_squared: f32,
    /// b^2, m^2.
    pub(super) across_squared: f32,
    /// a^2 - b^2, without its cancellation, m^2.
    pub(super) base: f32,
    /// nu, 1/m^2, above 0.
    pub(super) noise: f32,
}

impl NoisyHop {
    /// Returns the maximum distance at which the signal exceeds the noise as required, m, at most 1e9. `None` if there is none.
    pub(super) fn through_noise(&self) -> Option<f32> {
        let squared = (1.0 / (self.ratio * self.noise)).min(1e18) - self.across_squared;
        (squared >= 0.0).then(|| sqrt(squared))
    }

    /// Returns true if the target is met at `d`, by the terms of the SINR.
    pub(super) fn is_met(&self, d: f32) -> bool {
        let s = square(d - self.ahead) + self.aside_squared;
        s >= self.ratio * (square(d) + self.across_squared) * (1.0 + self.noise * s)
    }

    /// Returns g, g' / 2, and the rounding error of g, at a `d` up to the limit by noise.
    fn value(&self, d: f32) -> (f32, f32, f32) {
        let Self { ratio, ahead, .. } = *self;
        let t = d - ahead;
        let s = square(t) + self.aside_squared;
        let l = square(d) + self.across_squared;
        let nus = self.noise * s;
        let inverse = 1.0 / (1.0 + nus);
        // At most about 1 up to the limit by noise.
        let needed = ratio * l;
        let lost = needed * self.noise;
        if self.excess.abs() < 0.5 && nus < 1.0 {
            // For a target close to A, s and rho l cancel far from the interferer, so their difference is used.
            let f = ahead * (ahead - 2.0 * d) + self.base - self.excess * l;
            let slope = -(ahead + self.excess * d) - t * nus * (2.0 + nus) * square(inverse);
            return ((f - lost * s) * inverse, slope, ROUNDING * needed);
        }
        let g = (s * (1.0 - lost) - needed) * inverse;
        (g, t * square(inverse) - ratio * d, ROUNDING * needed)
    }

    /// Returns the distance from the interferer at which g's curvature changes sign, m. `None` if g is concave.
    fn inflection(&self) -> Option<f32> {
        let v = 1.0 + self.noise * self.aside_squared;
        if self.ratio * square(v) >= 1.0 {
            return None;
        }
        let mut w = v * (4.0 / 3.0);
        for _ in 0..TURNS {
            let part = self.ratio * square(w);
            w = (2.0 * part * w + 4.0 * v) / (3.0 * part + 3.0);
        }
        Some(sqrt(((w - v) / self.noise).clamp(0.0, 1e18)))
    }

    /// Returns the last d in [`low`, `high`] at which the target is met, m; `None` if there is none. `high` is at most the limit
    /// by noise. Work: at most 96 evaluations of g, usually five.
    pub(super) fn last(&self, low: f32, high: f32) -> Option<f32> {
        let mut high = high;
        if !(low <= high) {
            return None;
        }
        if let Some(about) = self.inflection() {
            let (left, right) = (self.ahead - about, self.ahead + about);
            if high > right {
                let there = self.concave(right.max(low), high);
                if there.is_some() {
                    return there;
                }
                high = right;
            }
            if high > left && high > low {
                let start = left.max(low);
                let (g, _, rounding) = self.value(start);
                if g >= -rounding {
                    return Some(self.convex(start, high));
                }
                high = start;
            }
            if !(high > low) {
                return None;
            }
        }
        self.concave(low, high)
    }

    /// Returns the last root in [`low`, `high`], where g is concave and below 0 at `high` but for rounding.
    fn concave(&self, low: f32, high: f32) -> Option<f32> {
        let mut d = high;
        for _ in 0..STEPS {
            let (g, half, rounding) = self.value(d);
            if g >= -rounding {
                return Some(d);
            }
            if !(half < 0.0) {
                return None;
            }
            let next = d - 0.5 * g / half;
            if !(next >= low) {
                return None;
            }
            if d - next <= CLOSE * d.abs() {
                return Some(next);
            }
            d = next;
        }
        None
    }

    /// Returns the root of g in [`low`, `high`]; g is not negative at `low`, and negative at `high`.
    fn convex(&self, low: f32, high: f32) -> f32 {
        let (mut low, mut high) = (low, high);
        for _ in 0..HALVINGS {
            let (g, half, _) = self.value(low);
            let next = low - 0.5 * g / half;
            // The root is no farther than `high`, and no nearer than `next`, but for rounding.
            if next >= high {
                return high;
            }
            if !(next > low) || next - low <= CLOSE * next.abs() {
                break;
            }
            low = next;
            let middle = 0.5 * (low + high);
            if self.value(middle).0 >= 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}
