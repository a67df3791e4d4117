//! Logarithms of both SIRs of a hop, with their derivatives.
//!
//! Lengths are in units of D. With v = p' - p the hop, l = |v|^2, and w the position of a receiver relative to the interferer,
//! s = |w|^2 and nu the noise as in [`spacing`](crate::optimiser::spacing)
//!
//! ```text
//! ln F = a - ln l + ln q(p'),    ln (B / r) = a' - ln l + ln q(p),    ln q = ln s - ln(1 + nu s)
//! ```
//!
//! where ln q is 0 at Rx and at Tx. With q1 = 1 / (s (1 + nu s)) and q2 = (nu / (1 + nu s))^2 - 1 / s^2, the derivatives of ln q
//! by s, the gradients and second derivatives are
//!
//! ```text
//! -ln l:  -2 v / l,    -(2 / l) I + (4 / l^2) v v'        ln q:  2 q1 w,    2 q1 I + 4 q2 w w'
//! ```
//!
//! The first has a convex direction, along the hop; the second is convex in all directions perpendicular to that of the
//! interferer. In *convex* mode those are left out, so that the matrix of [`newton`](super::newton) is positive
//! definite.

use super::super::chain::{Chain, Gains, SeatOf};
use super::super::hop::{Triple, minus};

/// Amount added to each squared hop length, so that its logarithm is finite. The unit is the squared distance from Tx
/// to Rx.
const SHORTEST: f32 = 1e-8;

/// Levels of a hop: ln F and ln(B / r), with the SIR F toward Rx and the SIR B toward Tx.
///
/// r is the ratio of B to F that the mission requires. In all pairs of values for a hop, the first value is for data
/// toward Rx, the second for data toward Tx. The *slack* of a level is the level minus the target, in ln(SIR).
pub(super) type Levels = [f32; 2];

/// Symmetric 3 x 3 matrix with rows and columns x, y and altitude h. The elements are xx, xy, xh, yy, yh, hh.
pub(super) type Symmetric = [f32; 6];

#[inline(never)]
pub(super) fn dot([a, b, c]: &Triple, [x, y, z]: &Triple) -> f32 {
    a * x + b * y + c * z
}

/// Adds the symmetric matrix `weight` v v' to `to`. The vector v is (x, y, h), and v' is its transpose.
#[inline(never)]
pub(super) fn add_square(to: &mut Symmetric, [x, y, h]: &Triple, weight: f32) {
    let (a, b) = (weight * x, weight * y);
    let [xx, xy, xh, yy, yh, hh] = to;
    *xx += a * x;
    *xy += a * y;
    *xh += a * h;
    *yy += b * y;
    *yh += b * h;
    *hh += weight * h * h;
}

/// Adds the vector (a, b, c), multiplied by `weight`, to the vector (x, y, h).
#[inline(never)]
pub(super) fn add_scaled([x, y, h]: &mut Triple, [a, b, c]: &Triple, weight: f32) {
    *x += weight * a;
    *y += weight * b;
    *h += weight * c;
}

fn add_to_diagonal([xx, _, _, yy, _, hh]: &mut Symmetric, value: f32) {
    *xx += value;
    *yy += value;
    *hh += value;
}

/// Logarithms of the gains of all hops, for relays of the mission's common power.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogGains {
    gains: Gains,
    common_w: f32,
    /// Logarithm of r, the required ratio of backward to forward SIR.
    reverse: f32,
}

impl LogGains {
    pub(super) const NONE: Self = Self {
        gains: Gains::NONE,
        common_w: 0.0,
        reverse: 0.0,
    };

    pub(super) fn new(chain: &Chain<'_, impl SeatOf>) -> Self {
        let common_w = chain.mission.config().common.power_w;
        Self {
            gains: Gains::new(chain, common_w, libm::logf),
            common_w,
            reverse: libm::logf(chain.mission.reverse()),
        }
    }

    /// Returns the logarithm of hop `k`'s gain toward Rx, and that of its gain toward Tx divided by r.
    ///
    /// r is the required ratio of backward to forward SIR. `k` is 1 for the hop from Tx, and N + 1 for the hop to Rx.
    fn of(&self, k: u16, chain: &Chain<'_, impl SeatOf>) -> Levels {
        let [there, back] = self.gains.of(k, chain.relays(), |gain, index| {
            let power_w = chain.seat(index).power_w;
            if power_w.to_bits() == self.common_w.to_bits() {
                gain
            } else {
                gain + libm::logf(power_w / self.common_w)
            }
        });
        [there, back - self.reverse]
    }

    /// Returns ln q at the position `at`; q is the inverse of interference plus noise.
    ///
    /// The unit of interference and noise is the power that is received from the interferer at a distance of D from it,
    /// where D is the distance from Tx to Rx.
    pub(super) fn quiet(&self, at: Triple) -> f32 {
        let w = minus(at, self.gains.source);
        let s = dot(&w, &w) + SHORTEST * SHORTEST;
        libm::logf(s / (1.0 + self.gains.noise * s))
    }

    /// Returns the levels of hop `k` from `from` to `to`. `quiet_from` and `quiet_to` are ln q at `from` and at `to`;
    /// q is the inverse of interference plus noise.
    pub(super) fn levels(
        &self,
        k: u16,
        chain: &Chain<'_, impl SeatOf>,
        [from, to]: [Triple; 2],
        [quiet_from, quiet_to]: [f32; 2],
    ) -> Levels {
        let v = minus(to, from);
        let length = libm::logf(dot(&v, &v) + SHORTEST);
        let [there, back] = self.of(k, chain);
        let there = there + if k > chain.relays() { 0.0 } else { quiet_to };
        let back = back + if k > 1 { quiet_from } else { 0.0 };
        [there - length, back - length]
    }

    /// Returns the derivatives of hop `k`'s [levels](Levels) by the positions of its ends `from` and `to`. The second
    /// derivatives of the two levels are summed with the `weights`. If `convex` is true, terms that would make this sum
    /// indefinite are left out.
    pub(super) fn derivatives(
        &self,
        k: u16,
        relays: u16,
        [from, to]: [Triple; 2],
        weights: [f32; 2],
        convex: bool,
    ) -> Derivatives {
        let v = minus(to, from);
        let l = dot(&v, &v) + SHORTEST;
        let slope = v.map(|x| -2.0 * x / l);
        let [there, back] = weights;
        let flat = 2.0 * (there + back) / l;
        let mut bend = [0.0; 6];
        add_square(
            &mut bend,
            &v,
            if convex { -flat / l } else { -2.0 * flat / l },
        );
        add_to_diagonal(&mut bend, flat);
        let mut hop = Derivatives {
            by_from: [slope.map(|x| -x); 2],
            by_to: [slope; 2],
            bend_from: bend,
            bend_to: bend,
            bend,
        };
        let [by_to, _] = &mut hop.by_to;
        if k <= relays {
            self.add_quiet(to, there, convex, by_to, &mut hop.bend_to);
        }
        let [_, by_from] = &mut hop.by_from;
        if k > 1 {
            self.add_quiet(from, back, convex, by_from, &mut hop.bend_from);
        }
        hop
    }

    /// Adds the derivatives of ln q with respect to the position `at`. Here q is the inverse of interference plus noise.
    /// The first derivatives are added to `slope`, and the second derivatives, multiplied by -`weight`, to `bend`. If
    /// `convex` is true, terms that would make `bend` indefinite are left out.
    fn add_quiet(
        &self,
        at: Triple,
        weight: f32,
        convex: bool,
        slope: &mut Triple,
        bend: &mut Symmetric,
    ) {
        let w = minus(at, self.gains.source);
        let s = dot(&w, &w) + SHORTEST * SHORTEST;
        let inverse = 1.0 / (1.0 + self.gains.noise * s);
        let (first, second) = (
            inverse / s,
            (self.gains.noise * inverse) * (self.gains.noise * inverse) - 1.0 / (s * s),
        );
        add_scaled(slope, &w, 2.0 * first);
        if convex {
            let radial = -weight * (2.0 * first + 4.0 * second * s);
            add_square(bend, &w, radial.max(0.0) / s);
        } else {
            add_square(bend, &w, -4.0 * weight * second);
            add_to_diagonal(bend, -2.0 * weight * first);
        }
    }
}

/// Derivatives of a hop's [levels](Levels) with respect to the positions of its ends. The second derivatives
/// (`bend...`) are weighted sums over both levels, negated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivatives {
    pub(super) by_from: [Triple; 2],
    pub(super) by_to: [Triple; 2],
    pub(super) bend_from: Symmetric,
    pub(super) bend_to: Symmetric,
    /// Part of `bend_from` and `bend_to` that comes from the hop's length. The mixed second derivatives, by `from` and
    /// `to`, are the negative of this matrix.
    pub(super) bend: Symmetric,
}
