//! What the rest of a chain is worth, as the relay before it sees it: a quadratic in where that relay is.
//!
//! The slack, by how much the chain overshoots Rx for a target, is what all relays have in common to make as large as can be. Its
//! first and second derivatives by a relay's place are all that the relays before it have to know of those after it: Bellman's
//! principle, and with second derivatives differential dynamic programming (Jacobson and Mayne 1970; within a box: Tassa, Mansard
//! and Todorov 2014).

use super::hop::Reach;
use super::hop::{Coordinate, Triple};
use super::policy::Policy;
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::square;

/// The slack about a nominal chain, as a relay's place changes.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Outlook {
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
    /// The slack of a last relay at `at`, m, and its outlook, when Rx, `distance_m` from Tx, is heard as far as `reach_m`: how much farther
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

    /// Becomes what the relay before sees of it through a hop, whose relay steps by the policy that is best within `low` to `high`, m
    /// from where it is, by the two coordinates that do not follow.
    pub(super) fn pass(
        &mut self,
        axis: Coordinate,
        hop: &Reach,
        low: [f32; 2],
        high: [f32; 2],
    ) -> Policy {
        let [vx, vy, vh] = axis.first(self.slope);
        let p = hop.by_p;
        let [rwy, rwh] = hop.by_w;
        // The slack as a function of z: first derivatives by w, second ones by all.
        let (gy, gh) = (vx * rwy + vy, vx * rwh + vh);
        let [(mp, [my, mh]), (yp, [ymy, ymh]), (hp, [_, hmh])] = axis
            .first_of(self.bend)
            .map(|[x, y, h]| (p.map(|r| r * x), [y + rwy * x, h + rwh * x]));
        let [by_yp, by_hp] = hop.by_wp;
        let ay = add(add(yp, mp, rwy), by_yp, vx);
        let ah = add(add(hp, mp, rwh), by_hp, vx);
        let [by_yy, by_yh, by_hh] = hop.by_ww;
        let yy = ymy + my * rwy + by_yy * vx;
        let yh = ymh + mh * rwy + by_yh * vx;
        let hh = hmh + mh * rwh + by_hh * vx;
        let policy = Policy::best([gy, gh], [yy, yh, hh], [ay, ah], low, high);
        let ([ky, kh], [fy, fh]) = (policy.step, policy.follow);
        // And with w stepping as it does, by p alone.
        let (py, ph) = (gy + yy * ky + yh * kh, gh + yh * ky + hh * kh);
        let mut slope = p.map(|r| vx * r);
        for ((((cell, ay), ah), fy), fh) in slope.iter_mut().zip(ay).zip(ah).zip(fy).zip(fh) {
            *cell += ay * ky + ah * kh + fy * py + fh * ph;
        }
        let mut bend = hop.by_pp;
        for (row, r) in bend.iter_mut().zip(p) {
            for (cell, m) in row.iter_mut().zip(mp) {
                *cell = m * r + *cell * vx;
            }
        }
        let (full_y, full_h) = (mix(ay, fy, yy, fh, yh), mix(ah, fy, yh, fh, hh));
        for ((((row, ay), ah), ky), kh) in bend.iter_mut().zip(ay).zip(ah).zip(fy).zip(fh) {
            for ((((cell, my), mh), fy), fh) in
                row.iter_mut().zip(full_y).zip(full_h).zip(fy).zip(fh)
            {
                *cell += ky * my + kh * mh + ay * fy + ah * fh;
            }
        }
        *self = Self {
            slope: axis.back(slope),
            bend: axis.back_of(bend),
            by_target: self.by_target + vx * hop.by_target,
            linear: self.linear + gy * ky + gh * kh,
            square: self.square + 0.5 * (yy * ky * ky + hh * kh * kh) + yh * ky * kh,
        };
        let follow = policy.follow.map(|row| axis.back(row));
        Policy {
            axis,
            follow,
            ..policy
        }
    }
}

/// a + b f
fn add(a: Triple, b: Triple, f: f32) -> Triple {
    let mut sum = a;
    for (cell, b) in sum.iter_mut().zip(b) {
        *cell += b * f;
    }
    sum
}

/// a + (b f + c g)
fn mix(a: [f32; 3], b: [f32; 3], f: f32, c: [f32; 3], g: f32) -> [f32; 3] {
    let mut sum = a;
    for ((cell, b), c) in sum.iter_mut().zip(b).zip(c) {
        *cell += b * f + c * g;
    }
    sum
}
