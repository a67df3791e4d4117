//! What the rest of a chain is worth, as the relay before it sees it: a quadratic in where that relay is.
//!
//! The slack, by how much the chain overshoots Rx for a target, is what all relays have in common to make as large as can be. Its
//! first and second derivatives by a relay's place are all that the relays before it have to know of those after it: Bellman's
//! principle, and with second derivatives differential dynamic programming (Jacobson and Mayne 1970; within a box: Tassa, Mansard
//! and Todorov 2014).

use super::axis::{Coordinate, Triple};
use super::hop::{Reach, Row};
use super::policy::Policy;
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::square;

/// How many numbers an [`Outlook`] is.
pub const PARTS: usize = 12;

/// The slack about a nominal chain, as a relay's place changes.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Outlook {
    /// By x, y and h, m per m.
    pub(crate) slope: Triple,
    /// By two of them, 1/m; symmetric.
    pub(crate) bend: [Triple; 3],
    /// By the logarithm of the target, m.
    pub(crate) by_target: f32,
    /// What the steps of all relays after it are expected to gain, m of slack: this, in proportion to their share of the step,
    pub(crate) linear: f32,
    /// and this, in proportion to its square.
    pub(crate) square: f32,
}

impl Outlook {
    /// The twelve numbers: slopes by x, y, h; bends by xx, xy, xh, yy, yh, hh; slope by ln target; linear and square gain.
    pub fn parts(&self) -> [f32; PARTS] {
        let [x, y, h] = self.slope;
        let [[xx, xy, xh], [_, yy, yh], [_, _, hh]] = self.bend;
        [
            x,
            y,
            h,
            xx,
            xy,
            xh,
            yy,
            yh,
            hh,
            self.by_target,
            self.linear,
            self.square,
        ]
    }

    /// From those numbers, if all of them are finite.
    pub fn from_parts(parts: [f32; PARTS]) -> Option<Self> {
        let [x, y, h, xx, xy, xh, yy, yh, hh, by_target, linear, square] = parts;
        parts.iter().all(|part| part.is_finite()).then_some(Self {
            slope: [x, y, h],
            bend: [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]],
            by_target,
            linear,
            square,
        })
    }

    /// The slack of a tail at `at`, m, and its outlook, when Rx, `distance_m` from Tx, is heard as far as `reach_m`: how much farther
    /// from Rx it could be. Beyond Rx along x is as good as right above it.
    pub(crate) fn tail(reach_m: f32, distance_m: f32, at: Placement) -> (f32, Self) {
        let ahead = distance_m - at.x_m;
        let over = ahead < 0.0;
        let to = [ahead.max(0.0), -at.y_m, -at.altitude_m];
        let [x, y, h] = to;
        let r = sqrt(square(x) + square(y) + square(h)).max(1e-9);
        let slope = to.map(|d| d / r);
        let mut bend = slope.map(|a| slope.map(|b| a * b / r));
        for ((row, i), free) in bend.iter_mut().zip(0..).zip([!over, true, true]) {
            for (cell, _) in row.iter_mut().zip(0..).filter(|(_, j)| *j == i && free) {
                *cell -= 1.0 / r;
            }
        }
        let outlook = Self {
            slope,
            bend,
            by_target: -0.5 * reach_m,
            ..Self::default()
        };
        (reach_m - r, outlook)
    }

    /// Takes off what a relay costs that is too near the interferer: half `weight` near^2, with the slopes of `near`.
    pub(super) fn penalise(&mut self, weight: f32, near: f32, slope: Triple, by_target: f32) {
        self.by_target -= weight * near * by_target;
        for (total, part) in self.slope.iter_mut().zip(slope) {
            *total -= weight * near * part;
        }
        for ((row, p), i) in self.bend.iter_mut().zip(slope).zip(0..) {
            for ((cell, q), j) in row.iter_mut().zip(slope).zip(0..) {
                let own = if i == j { -2.0 * near } else { 0.0 };
                *cell -= weight * (p * q + own);
            }
        }
    }

    /// What the relay before sees of it through a hop, whose relay steps by the policy that is best within `low` to `high`, m from
    /// where it is, by the two coordinates that do not follow.
    pub(super) fn before(
        &self,
        axis: Coordinate,
        hop: &Reach,
        low: [f32; 2],
        high: [f32; 2],
    ) -> (Self, Policy) {
        let r = hop.slope;
        let [vx, vy, vh] = axis.first(self.slope);
        let [rx, ry, rh, rwy, rwh] = r;
        // The slack as a function of z: first derivatives by w, second ones by all.
        let (gy, gh) = (vx * rwy + vy, vx * rwh + vh);
        let [m0, m1, m2] = axis
            .first_of(self.bend)
            .map(|[x, y, h]| add([0.0, 0.0, 0.0, y, h], r, x));
        let none = [0.0; 5];
        let mut q = hop.bend;
        for ((row, r), m) in q.iter_mut().zip(r).zip([none, none, none, m1, m2]) {
            *row = add(add(m, m0, r), *row, vx);
        }
        let [q0, q1, q2, [yx, yy0, yh0, yy, yh], [hx, hy0, hh0, _, hh]] = q;
        let (ay, ah) = ([yx, yy0, yh0], [hx, hy0, hh0]);
        let policy = Policy::best([gy, gh], [yy, yh, hh], [ay, ah], low, high);
        let ([ky, kh], [fy, fh]) = (policy.step, policy.follow);
        // And with w stepping as it does, by p alone.
        let (py, ph) = (gy + yy * ky + yh * kh, gh + yh * ky + hh * kh);
        let mut slope = [vx * rx, vx * ry, vx * rh];
        for ((((cell, ay), ah), fy), fh) in slope.iter_mut().zip(ay).zip(ah).zip(fy).zip(fh) {
            *cell += ay * ky + ah * kh + fy * py + fh * ph;
        }
        let mut bend = [q0, q1, q2].map(|[x, y, h, _, _]| [x, y, h]);
        let (full_y, full_h) = (mix(ay, fy, yy, fh, yh), mix(ah, fy, yh, fh, hh));
        for ((((row, ay), ah), ky), kh) in bend.iter_mut().zip(ay).zip(ah).zip(fy).zip(fh) {
            for ((((cell, my), mh), fy), fh) in
                row.iter_mut().zip(full_y).zip(full_h).zip(fy).zip(fh)
            {
                *cell += ky * my + kh * mh + ay * fy + ah * fh;
            }
        }
        let before = Self {
            slope: axis.back(slope),
            bend: axis.back_of(bend),
            by_target: self.by_target + vx * hop.by_target,
            linear: self.linear + gy * ky + gh * kh,
            square: self.square + 0.5 * (yy * ky * ky + hh * kh * kh) + yh * ky * kh,
        };
        let follow = policy.follow.map(|row| axis.back(row));
        let policy = Policy {
            axis,
            follow,
            ..policy
        };
        (before, policy)
    }
}

/// a + b f
fn add(a: Row, b: Row, f: f32) -> Row {
    let mut sum = a;
    for (cell, b) in sum.iter_mut().zip(b) {
        *cell += b * f;
    }
    sum
}

/// a + b f + c g
fn mix(a: [f32; 3], b: [f32; 3], f: f32, c: [f32; 3], g: f32) -> [f32; 3] {
    let mut sum = a;
    for ((cell, b), c) in sum.iter_mut().zip(b).zip(c) {
        *cell += b * f + c * g;
    }
    sum
}
