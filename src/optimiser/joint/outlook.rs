//! Value function: the slack of the chain as a quadratic function of one relay's position.
//!
//! The slack is the length by which the chain overshoots Rx for a target; all relays maximise it. Its first and second
//! derivatives by a relay's position are all that the relays before need to know of those after (Bellman's principle).
//! With the second derivatives this is differential dynamic programming (Jacobson and Mayne 1970; within a box: Tassa,
//! Mansard and Todorov 2014).
//!
//! The [`Policy`] of a relay in one iteration of the joint method is its step, and its feedback on changes before it.

use super::hop::{Coordinate, Reach, Triple};
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::square;

/// Value function of the joint method: the chain's slack as a quadratic in one relay's position. The slack is the
/// length by which the chain overshoots Rx. The relays toward Rx are assumed to react optimally.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Outlook {
    /// First derivatives of the chain's slack with respect to the relay's x, y and h, m per m. The slack is the length
    /// by which the chain overshoots Rx.
    pub(crate) slope: Triple,
    /// Second derivatives of the chain's slack with respect to the relay's x, y and h, 1/m; symmetric.
    pub(crate) bend: [Triple; 3],
    /// Derivative of the slack, by which the chain overshoots Rx, with respect to ln(target SIR), m.
    pub(crate) by_target: f32,
    /// Coefficient a of the predicted increase of the chain's slack, a f + b f^2, m. This relay and all relays toward
    /// Rx make the fraction f, 0 to 1, of their computed moves.
    pub(crate) linear: f32,
    /// Coefficient b of the predicted increase of the chain's slack, a f + b f^2, m; see `linear`.
    pub(crate) square: f32,
}

impl Outlook {
    /// Returns the slack of a chain whose last relay is at `at`, m, and its derivatives.
    ///
    /// The slack is `reach_m`, the maximum length of the last hop, minus the length of this hop. Rx is at x =
    /// `distance_m`; an x beyond Rx counts as the x of Rx.
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

    /// Subtracts the penalty `weight` `near`^2 / 2 for a relay too close to the interferer. `near`, m^2, is the squared
    /// minimum distance from the interferer minus the squared actual distance. `slope` and `by_target` are the
    /// derivatives of `near` by the relay's position and by ln(target SIR).
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

    /// Replaces the value function of a hop's receiver by that of its sender; returns the policy. The value function is
    /// the chain's slack, which depends on the position of the node. The policy is the receiver's move from its present
    /// position in two coordinates, within [`low`, `high`], m. The third coordinate, `axis`, follows from the hop's
    /// maximum length.
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
        // Derivatives of the slack as a function of z: first ones by w, second ones by all.
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
        // Derivatives by p alone, with w following the policy.
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

/// Returns the vector a + b f, with the number f.
fn add(a: Triple, b: Triple, f: f32) -> Triple {
    let mut sum = a;
    for (cell, b) in sum.iter_mut().zip(b) {
        *cell += b * f;
    }
    sum
}

/// Returns the vector a + (b f + c g), with the numbers f and g.
fn mix(a: [f32; 3], b: [f32; 3], f: f32, c: [f32; 3], g: f32) -> [f32; 3] {
    let mut sum = a;
    for ((cell, b), c) in sum.iter_mut().zip(b).zip(c) {
        *cell += b * f + c * g;
    }
    sum
}

/// Policy of a relay in the joint method: its move in one iteration, in two of its coordinates.
///
/// The third coordinate follows from the maximum length of the hop to the relay. The move depends linearly on the move
/// of the sender, the next node toward Tx.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Policy {
    pub(super) axis: Coordinate,
    /// True to select the larger of two solutions for the relay's third coordinate.
    pub(super) rising: bool,
    /// Move of the relay in its two free coordinates while the sending relay does not move, m.
    pub(super) step: [f32; 2],
    /// Change of the relay's move in each free coordinate per metre of the sender's move. The three numbers of a triple
    /// are for the sender's move along x, y and h.
    pub(super) follow: [Triple; 2],
}

/// Minimum curvature of the value function, divided by its largest curvature. A smaller curvature would be a rounding
/// error.
const FLATTEST: f32 = 1e-6;

impl Policy {
    /// Returns the policy that maximises a quadratic function of the relay's two free coordinates. The relay's move is
    /// within [`low`, `high`], m. The function has the gradient `slope` and the second derivatives `bend` (yy, yh, hh);
    /// positive curvature is made negative. `across` has the mixed derivatives with respect to the sending relay's
    /// position.
    pub(super) fn best(
        slope: [f32; 2],
        bend: [f32; 3],
        across: [[f32; 3]; 2],
        low: [f32; 2],
        high: [f32; 2],
    ) -> Self {
        let [yy, yh, hh] = concave(bend);
        let [gy, gh] = slope;
        let [ay, ah] = across;
        let ([ly, lh], [uy, uh]) = (low, high);
        let free_y = uy > ly;
        let free_h = uh > lh;
        let cut = |v: f32, l: f32, u: f32| v.max(l).min(u);
        // Optimum of one coordinate for a given value of the other.
        let along_y = |h: f32| cut(-(gy + yh * h) / yy, ly, uy);
        let along_h = |y: f32| cut(-(gh + yh * y) / hh, lh, uh);
        let det = yy * hh - yh * yh;
        let mut policy = Self {
            rising: true,
            ..Self::default()
        };
        let [fy, fh] = &mut policy.follow;
        if free_y && free_h && det > 0.0 {
            let y = (-gy * hh + gh * yh) / det;
            let h = (-gh * yy + gy * yh) / det;
            if y >= ly && y <= uy && h >= lh && h <= uh {
                for (((fy, fh), ay), ah) in fy.iter_mut().zip(fh.iter_mut()).zip(ay).zip(ah) {
                    *fy = (-ay * hh + ah * yh) / det;
                    *fh = (-ah * yy + ay * yh) / det;
                }
                policy.step = [y, h];
                return policy;
            }
        }
        // Optimum on the edges of the box.
        let value = |y: f32, h: f32| gy * y + gh * h + 0.5 * (yy * y * y + hh * h * h) + yh * y * h;
        let mut best = (f32::NEG_INFINITY, 0.0, 0.0);
        for (y, h) in [
            (ly, along_h(ly)),
            (uy, along_h(uy)),
            (along_y(lh), lh),
            (along_y(uh), uh),
        ] {
            let w = value(y, h);
            if w > best.0 {
                best = (w, y, h);
            }
        }
        let (_, y, h) = best;
        if y > ly && y < uy {
            *fy = ay.map(|a| -a / yy);
        } else if h > lh && h < uh {
            *fh = ah.map(|a| -a / hh);
        }
        policy.step = [y, h];
        policy
    }

    /// Returns the relay's move in its two free coordinates, m. The third coordinate follows from the hop.
    ///
    /// The move is `share` times the relay's `step`, plus the relay's response to `change`. `change` is the move of the
    /// hop's sender in x, y and h, m.
    pub(super) fn apply(&self, share: f32, change: [f32; 3]) -> [f32; 2] {
        let dot = |row: [f32; 3]| row.iter().zip(change).map(|(a, b)| a * b).sum::<f32>();
        let [y, h] = self.step;
        let [fy, fh] = self.follow;
        [share * y + dot(fy), share * h + dot(fh)]
    }
}

/// Returns the symmetric matrix (yy, yh, hh) with positive eigenvalues negated. A quadratic function with these
/// second derivatives has a maximum.
fn concave([yy, yh, hh]: [f32; 3]) -> [f32; 3] {
    let (mean, half) = (0.5 * (yy + hh), 0.5 * (yy - hh));
    let root = sqrt(square(half) + square(yh));
    let least = (FLATTEST * (mean.abs() + root)).max(1e-20);
    let (high, low) = (mean + root, mean - root);
    if high <= -least {
        return [yy, yh, hh];
    }
    let (high, low) = (-high.abs().max(least), -low.abs().max(least));
    // cos and sin of twice the angle of the axes.
    let (cos, sin) = if root > 0.0 {
        (half / root, yh / root)
    } else {
        (1.0, 0.0)
    };
    let (mean, half) = (0.5 * (high + low), 0.5 * (high - low));
    [mean + half * cos, half * sin, mean - half * cos]
}

/// Compressed [`Policy`] (a relay's move). Each derivative is stored with three decimal digits, which is accurate enough.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Brief {
    axis: Coordinate,
    rising: bool,
    step: [f32; 2],
    follow: [[u16; 3]; 2],
}

impl Brief {
    pub(super) const NONE: Self = Self {
        axis: Coordinate::X,
        rising: false,
        step: [0.0; 2],
        follow: [[0; 3]; 2],
    };

    pub(super) fn of(policy: &Policy) -> Self {
        let Policy {
            axis,
            rising,
            step,
            follow,
        } = *policy;
        Self {
            axis,
            rising,
            step,
            follow: follow.map(|row| row.map(upper_half)),
        }
    }

    pub(super) fn policy(self) -> Policy {
        Policy {
            axis: self.axis,
            rising: self.rising,
            step: self.step,
            follow: self.follow.map(|row| row.map(widened)),
        }
    }
}

/// Compresses a finite f32 to 16 bits (about three decimal digits). The inverse is `widened`.
pub(super) const fn upper_half(value: f32) -> u16 {
    (value.to_bits().saturating_add(0x8000) >> 16) as u16
}

pub(super) const fn widened(half: u16) -> f32 {
    f32::from_bits((half as u32) << 16)
}
