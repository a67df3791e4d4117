//! Reach of a hop with its first and second derivatives.
//!
//! A hop leads from p to p', with c = gamma / A, the ratio of target and sender's gain, and the interferer at m. At its maximum
//! length
//!
//! ```text
//! 2 F = q(|p' - m|^2) - c |p' - p|^2 = 0,    q(s) = s / (1 + nu s)
//! ```
//!
//! and one coordinate of p' follows from the other two, w, and from p (see [`Coordinate`]): p'_1 = R(z), z = (p_1, p_2, p_3, w_2,
//! w_3). With v = p' - m, w = 1 + nu s, q' = 1 / w^2 and q'' = -2 nu / w^3, the derivatives of F by p' are F_i = q' v_i - c (p' -
//! p)_i and F_ij = (q' - c) [i = j] + 2 q'' v_i v_j; those by p are c (p' - p)_i and -c [i = j], and the mixed ones c [i = j].
//! Without noise q' is 1 and q'' is 0, so F is quadratic. Those of R follow by differentiating F(R(z), z) = 0 once and twice,
//! with a = -dF/dp'_1 = -q' v_1 + c (p' - p)_1:
//!
//! ```text
//! R_z = F_z / a,    R_zz' = (F_zz' + F_1z R_z' + R_z F_1z' + F_11 R_z R_z') / a
//! ```
//!
//! The derivative by ln gamma is -c |p' - p|^2 / 2a. `host-tests/tests/joint_method/main.rs` compares them with an independent
//! optimiser.
//!
//! # Coordinates
//!
//! The possible ends of a hop form a surface; beyond it the signal is too weak. Along most of a chain x is a smooth function of y
//! and h on it; where the chain climbs vertically, or goes sideways, h or y is the dependent coordinate.
//!
//! # Noise
//!
//! With noise a hop is replaced by a noise-free hop that equals it near one distance from the interferer.
//!
//! q(s) = s / (1 + nu s) is concave, so with w = 1 + nu t its tangent at s = t is above it: q(s) <= (s + nu t^2) / w^2. Hence
//!
//! ```text
//! q(s) >= c l   =>   s + nu t^2 >= c w^2 l
//! ```
//!
//! and the right side is a noise-free hop for the target c' = c w^2 with the margin nu t^2. For c' > 1 its reach is a ball, and
//! one coordinate of the end follows from the other two by a square root. The ball contains all valid ends, and touches their
//! surface where s = t; iterating t is Newton's method in s.

use crate::place::Placement;
use crate::sir::square;

/// Derivatives of the end point of a hop that just meets its target SIR.
///
/// One coordinate of the end point is dependent: it follows from the two free coordinates w_1 and w_2 of the end point,
/// from the start point p of the hop, and from the target SIR.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::struct_field_names,
    reason = "each is a derivative by what its name says"
)]
pub(super) struct Reach {
    pub(super) by_p: Triple,
    pub(super) by_w: [f32; 2],
    pub(super) by_pp: [Triple; 3],
    /// Second derivatives of the dependent coordinate of the hop's end by w_i and by p.
    ///
    /// w_1 and w_2 are the two free coordinates of the end, and p is the start of the hop. Row i is for w_i, and has
    /// one value for each coordinate of p.
    pub(super) by_wp: [Triple; 2],
    /// Second derivatives of the dependent coordinate of the hop's end. The derivatives are by the two free coordinates
    /// w_1 and w_2 of the end, in the order w_1 w_1, w_1 w_2, w_2 w_2.
    pub(super) by_ww: [f32; 3],
    /// Derivative of the dependent coordinate of the hop's end with respect to ln(target SIR), m. The two free
    /// coordinates of the end are kept constant.
    pub(super) by_target: f32,
}

impl Reach {
    /// Derivatives of a hop whose end is fixed: all are 0. Used if the end is at the x of Rx, or if its dependent
    /// coordinate has no finite derivatives.
    pub(super) const FIXED: Self = Self {
        by_p: [0.0; 3],
        by_w: [0.0; 2],
        by_pp: [[0.0; 3]; 3],
        by_wp: [[0.0; 3]; 2],
        by_ww: [0.0; 3],
        by_target: 0.0,
    };

    /// Returns the derivatives for the hop from `from` to `to`, with the interferer at `source`.
    ///
    /// In all three points the first coordinate is the dependent one: at the hop's end it is computed from the other
    /// two. `c` is the target SIR divided by the gain. `noise` is the noise divided by the interferer's power received
    /// at 1 m, 1/m^2. If the dependent coordinate has no finite derivatives, the result is [`Reach::FIXED`].
    pub(super) fn new(c: f32, noise: f32, source: Triple, from: Triple, to: Triple) -> Self {
        let ([x0, y0, z0], [x, y, z], [sx, sy, sz]) = (from, to, source);
        let (d, dy, dz) = (x - x0, y - y0, z - z0);
        let (away, aside, above) = (x - sx, y - sy, z - sz);
        let Bend { q, twice: bent } =
            Bend::new(noise, square(away) + square(aside) + square(above));
        let a = c * d - q * away;
        let length = square(d) + square(dy) + square(dz);
        if !(square(a) > 1e-9 * c * length) {
            return Self::FIXED;
        }
        let by_p = [c * d, c * dy, c * dz].map(|f| f / a);
        let by_w = [q * aside - c * dy, q * above - c * dz].map(|f| f / a);
        let [p, p1, p2] = by_p;
        let [w1, w2] = by_w;
        let k = q - c;
        // F_11, and the mixed derivatives by the first coordinate and each of w, which are 0 without noise.
        let k1 = k + bent * square(away);
        let [f1, f2] = [bent * away * aside, bent * away * above];
        let by_x = |r: f32| (c * r + k1 * p * r) / a;
        let both = |r: f32, q: f32| k1 * r * q / a;
        let twice = |f: f32, r: f32, q: f32| (f + k1 * r * q) / a;
        let across = |r: f32, f: f32| (r * c + f * p + k1 * r * p) / a;
        let by_wp = |w: f32, f: f32, p: f32, cross: f32| (cross + f * p + k1 * w * p) / a;
        let by_ww =
            |f: f32, w: f32, g: f32, v: f32, cross: f32| (cross + f * v + w * g + k1 * w * v) / a;
        Self {
            by_p,
            by_w,
            by_pp: [
                [(-c + c * p + p * c + k1 * p * p) / a, by_x(p1), by_x(p2)],
                [across(p1, 0.0), twice(-c, p1, p1), both(p1, p2)],
                [across(p2, 0.0), both(p2, p1), twice(-c, p2, p2)],
            ],
            by_wp: [
                [across(w1, f1), by_wp(w1, f1, p1, c), by_wp(w1, f1, p2, 0.0)],
                [across(w2, f2), by_wp(w2, f2, p1, 0.0), by_wp(w2, f2, p2, c)],
            ],
            by_ww: [
                by_ww(f1, w1, f1, w1, k + bent * square(aside)),
                by_ww(f1, w1, f2, w2, bent * aside * above),
                by_ww(f2, w2, f2, w2, k + bent * square(above)),
            ],
            by_target: -0.5 * c * length / a,
        }
    }
}

/// Derivatives q'(s) and 2 q''(s) of the inverse of interference plus noise, q(s) = s / (1 + nu s).
///
/// s is the squared distance from the interferer, m^2, and q has the same unit. nu is the noise divided by the
/// interferer's power received at 1 m, 1/m^2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub(super) q: f32,
    twice: f32,
}

impl Bend {
    pub(super) fn new(noise: f32, s: f32) -> Self {
        if !(noise > 0.0) {
            return Self { q: 1.0, twice: 0.0 };
        }
        let inverse = 1.0 / (1.0 + noise * s);
        let q = square(inverse);
        Self {
            q,
            twice: -4.0 * noise * inverse * q,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Coordinate {
    #[default]
    X,
    Y,
    H,
}

/// Vector with the components x, y and h (altitude): a position or a derivative.
pub(crate) type Triple = [f32; 3];

impl Coordinate {
    /// Returns (x, y, h) reordered: the coordinate `self` first, then the other two in their order.
    #[inline(never)] // called from many places
    pub(crate) const fn first(self, at: Triple) -> Triple {
        self.ordered(at)
    }

    /// Restores the order (x, y, h); the inverse of [`Coordinate::first`].
    #[inline(never)] // called from many places
    pub(crate) const fn back(self, at: Triple) -> Triple {
        self.restored(at)
    }

    /// Returns a symmetric 3 x 3 matrix with reordered rows and columns. The coordinate `self` is first; the other two
    /// follow in the order x, y, h.
    pub(crate) fn first_of(self, bend: [Triple; 3]) -> [Triple; 3] {
        self.ordered(bend).map(|row| self.first(row))
    }

    /// Restores a matrix to rows and columns (x, y, h); the inverse of [`Coordinate::first_of`].
    pub(crate) fn back_of(self, bend: [Triple; 3]) -> [Triple; 3] {
        self.restored(bend.map(|row| self.back(row)))
    }

    const fn ordered<T: Copy>(self, [x, y, h]: [T; 3]) -> [T; 3] {
        match self {
            Self::X => [x, y, h],
            Self::Y => [y, x, h],
            Self::H => [h, x, y],
        }
    }

    const fn restored<T: Copy>(self, [first, second, third]: [T; 3]) -> [T; 3] {
        match self {
            Self::X => [first, second, third],
            Self::Y => [second, first, third],
            Self::H => [second, third, first],
        }
    }
}

pub(super) const fn triple(place: Placement) -> Triple {
    [place.x_m, place.y_m, place.altitude_m]
}

pub(super) fn minus([a, b, c]: Triple, [x, y, z]: Triple) -> Triple {
    [a - x, b - y, c - z]
}

/// Condition s + `spare` >= `c` l, under which a hop meets its target SIR.
///
/// s is the squared distance from the hop's receiver to the interferer, m^2, and l is the squared hop length, m^2.
/// Without noise, `c` is the target divided by the gain, and `spare` is 0. With noise both are larger.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangent {
    pub(super) c: f32,
    /// Difference `c` - 1, computed without cancellation, for the condition s + `spare` >= `c` l.
    pub(super) e: f32,
    /// Constant in the condition s + `spare` >= `c` l of [`Tangent`], m^2; 0 without noise.
    pub(super) spare: f32,
}

impl Tangent {
    pub(super) const fn free(c: f32, e: f32) -> Self {
        Self { c, e, spare: 0.0 }
    }

    /// Returns the condition for a hop with noise, linearised at the squared distance `s`. `s` is a squared distance
    /// from the hop's receiver to the interferer, m^2; at this distance the linearised condition is exact.
    ///
    /// `noise` is the noise divided by the interferer's power received at 1 m, 1/m^2. `c` is the target SIR divided by
    /// the gain, and `e` is c - 1.
    pub(super) fn new(noise: f32, c: f32, e: f32, s: f32) -> Self {
        let nus = noise * s;
        let w = 1.0 + nus;
        Self {
            c: c * w * w,
            e: e + c * nus * (2.0 + nus),
            spare: nus * s,
        }
    }
}
