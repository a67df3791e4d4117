//! Reach of a hop with receiver noise: a bounded search on intervals of known curvature.
//!
//! In the notation of [`spacing`](super::spacing), with rho = gamma / A, s(d) = (d - u)^2 + a^2 the squared distance from the interferer,
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
//!
//! `closest` finds the shortest length instead, by the same search of the mirrored hop. Without noise it is the closed form in
//! [`from_rx`](super::from_rx).

use crate::features::NOISE;
use crate::root::sqrt;
use crate::sir::square;

/// Maximum ratio of a hop's target SIR to its gain. With a larger ratio the hop meets its target at no length. The
/// limit keeps all numbers finite.
pub(super) const MOST_RATIO: f32 = 1e18;

/// Maximum number of Newton steps in the search for the maximum hop length with noise. Four to eight are usual.
const STEPS: u8 = 32;

/// Maximum number of steps of a search by bisection. Each step at least halves the interval.
pub(super) const HALVINGS: u8 = 32;

/// Number of Newton steps in the search for the inflection of a hop's margin g. The margin is a function of the hop
/// length, and is 0 or above where a hop with noise meets its target.
const TURNS: u8 = 5;

/// Rounding error of the margin of a hop with noise, as a fraction of the required value. A target that is missed by at
/// most this error counts as met.
const NOISE_ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Relative change of the hop length below which the search for the maximum length ends.
const CLOSE: f32 = 5e-7;

/// Hop with receiver noise that has to meet one target SIR. Its methods compute the lengths along x at which the target
/// is met.
#[derive(Clone, Copy, Debug)]
pub(super) struct NoisyHop {
    /// Ratio rho of the hop's target SIR to its gain. The SIR is the gain times the inverse interference, divided by
    /// the squared length of the hop.
    pub(super) ratio: f32,
    /// Difference rho - 1, computed without cancellation. rho is the hop's target SIR divided by its gain.
    pub(super) excess: f32,
    /// Distance u from the sender to the interferer along x, m.
    pub(super) ahead: f32,
    /// Squared distance a^2 of the receiver from the interferer perpendicular to x, m^2.
    pub(super) aside_squared: f32,
    /// Squared distance b^2 of the receiver from the sender perpendicular to x, m^2.
    pub(super) across_squared: f32,
    /// Difference a^2 - b^2 of two squared distances perpendicular to x, m^2. a is from the receiver to the interferer,
    /// b from the receiver to the sender. The difference is computed without cancellation.
    pub(super) base: f32,
    /// Receiver noise divided by the interferer's power received at 1 m: nu, 1/m^2, above 0.
    pub(super) noise: f32,
}

impl NoisyHop {
    /// Returns the maximum hop length along x, m, for noise without interference; at most 1e9. `None` if the SNR misses
    /// the target at every length.
    pub(super) fn through_noise(&self) -> Option<f32> {
        let squared = (1.0 / (self.ratio * self.noise)).min(1e18) - self.across_squared;
        (squared >= 0.0).then(|| sqrt(squared))
    }

    /// Returns true if the hop meets its target with the receiver `d` metres from the sender along x.
    pub(super) fn is_met(&self, d: f32) -> bool {
        let s = square(d - self.ahead) + self.aside_squared;
        s >= self.ratio * (square(d) + self.across_squared) * (1.0 + self.noise * s)
    }

    /// Returns the margin g for the hop length `d`, half the derivative of g by d, and g's rounding error.
    ///
    /// The margin g, m^2, is 0 or above if the hop meets its target SIR. `d` is the length along x, m. It must be so
    /// short that the noise alone does not make the hop miss the target.
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
            return ((f - lost * s) * inverse, slope, NOISE_ROUNDING * needed);
        }
        let g = (s * (1.0 - lost) - needed) * inverse;
        (g, t * square(inverse) - ratio * d, NOISE_ROUNDING * needed)
    }

    /// Returns the distance along x from the interferer, m, where the margin g's curvature changes sign. `None` if g
    /// is concave everywhere. The margin g is a function of the hop length; it is 0 or above where the target is
    /// met.
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

    /// Returns the largest hop length along x in [`low`, `high`] that meets the target, m. `None` if there is none.
    /// `high` is at most [`through_noise`](Self::through_noise). Work: at most 96 evaluations of the hop, usually five.
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

    /// Returns the largest hop length from `low` to `high`, m, that meets the target. `None` if there is none. The
    /// margin g is 0 or above where the target is met, and 0 at the result.
    ///
    /// Apart from rounding errors, g must be concave from `low` to `high`, and below 0 at `high`.
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

    /// Returns the largest hop length from `low` to `high`, m, that meets the target. The margin g is 0 or above where
    /// the target is met, and 0 at the result.
    ///
    /// The margin g must be convex from `low` to `high`, 0 or above at `low`, and below 0 at `high`.
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

/// Returns `x_m` - `d`, m, rounded down. Even after rounding, the result is at least `d` below `x_m`.
pub(super) fn before(x_m: f32, d: f32) -> f32 {
    let place = x_m - d;
    if x_m - place < d {
        place.next_down()
    } else {
        place
    }
}

/// Returns the shortest length from `least` to `most`, m, at which `hop` meets its target.
///
/// `None` if there is no such length. The hop must not meet the target at `least`.
pub(super) fn closest(hop: &NoisyHop, least: f32, most: f32) -> Option<f32> {
    if !(hop.ratio <= MOST_RATIO) {
        return None;
    }
    let d = if NOISE && hop.noise > 0.0 {
        let mirrored = NoisyHop {
            ahead: -hop.ahead,
            ..*hop
        };
        -mirrored.last(-hop.through_noise()?.min(most), -least)?
    } else {
        rising_root(hop)?
    };
    (d >= least && d <= most).then_some(d)
}

/// Returns the length, m, above which a hop without noise meets the target. The margin to the target is 0 at this
/// length, and positive just above it. `None` if there is no such length; the length can be negative.
fn rising_root(hop: &NoisyHop) -> Option<f32> {
    let (u, e) = (hop.ahead, hop.excess);
    let h = hop.base - e * hop.across_squared;
    let c = square(u) + h;
    let discriminant = hop.ratio * square(u) + e * h;
    if discriminant < 0.0 {
        return None;
    }
    let r = sqrt(discriminant);
    match (e > 0.0, u >= 0.0) {
        (true, true) => None,
        (true, false) => Some(-c / (r - u)),
        (false, true) => Some((u + r) / -e),
        (false, false) => Some(c / (u - r)),
    }
}

#[cfg(all(test, feature = "reverse"))]
mod tests {
    use super::{NoisyHop, closest};
    use crate::features::NOISE;

    /// Returns the smallest of 20 001 evenly spaced lengths, m, at which `hop` meets its target. Reference for
    /// [`closest`].
    fn scanned(hop: &NoisyHop, least: f32, most: f32) -> Option<f32> {
        let step = (most - least) / 20_000.0;
        (0..=20_000_u16)
            .map(|i| least + f32::from(i) * step)
            .find(|d| hop.is_met(*d))
    }

    #[test]
    fn the_closest_distance_agrees_with_a_scan() {
        let noises: &[f32] = if NOISE {
            &[0.0, 1e-7, 1e-5, 1e-3]
        } else {
            &[0.0]
        };
        let mut found = 0;
        for ratio in [0.01_f32, 0.3, 0.99, 1.0, 1.01, 3.0, 40.0] {
            for ahead in [-300.0, -1.0, 0.0, 20.0, 400.0] {
                for (aside, across) in [(10.0_f32, 0.0_f32), (10.0, 30.0), (200.0, 20.0)] {
                    for (&noise, least) in noises
                        .iter()
                        .flat_map(|noise| [5.0_f32, 100.0, 300.0].map(|m| (noise, m)))
                    {
                        let (aside_squared, across_squared) = (aside * aside, across * across);
                        let hop = NoisyHop {
                            ratio,
                            excess: ratio - 1.0,
                            ahead,
                            aside_squared,
                            across_squared,
                            base: aside_squared - across_squared,
                            noise,
                        };
                        if hop.is_met(least) {
                            continue;
                        }
                        let ours = closest(&hop, least, 1000.0);
                        let theirs = scanned(&hop, least, 1000.0);
                        let far = ours.zip(theirs).map(|(a, b)| (a - b).abs());
                        let agrees =
                            ours.is_some() == theirs.is_some() && far.is_none_or(|far| far < 0.06);
                        assert!(agrees, "result {ours:?}, expected {theirs:?}, hop {hop:?}");
                        found += u32::from(ours.is_some());
                    }
                }
            }
        }
        assert!(found > 12, "{found}");
    }
}
