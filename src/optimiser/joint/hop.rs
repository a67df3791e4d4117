//! How far a hop reaches when everything it depends on is moved a little: the reach with its first and second derivatives.
//!
//! A hop leads from p to p', with c = gamma / A, the target against the sender's gain, and the interferer at m. Where it is as
//! long as it may be,
//!
//! ```text
//! 2 F = |p' - m|^2 - c |p' - p|^2 = 0
//! ```
//!
//! and one coordinate of p' follows from the other two, w, and from p (see [`Coordinate`]): p'_1 = R(z), z = (p_1, p_2, p_3, w_2, w_3).
//! F is quadratic, so its derivatives are products of two numbers, or constants; those of R follow by differentiating
//! F(R(z), z) = 0 once and twice, with a = -dF/dp'_1 = (m - p')_1 + c (p' - p)_1:
//!
//! ```text
//! R_z = F_z / a,    R_zz' = (F_zz' + F_1z R_z' + R_z F_1z' + (1 - c) R_z R_z') / a
//! ```
//!
//! and by ln gamma R = -c |p' - p|^2 / 2a. `host-tests/tests/joint_method.rs` holds the chains that come of
//! these against an independent optimiser.

use super::axis::Triple;
use crate::sir::square;

/// A reach's derivatives, by where the hop begins, three coordinates, p, and by the two that are free of where it ends, w.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::struct_field_names,
    reason = "each is a derivative by what its name says"
)]
pub(super) struct Reach {
    pub(super) by_p: Triple,
    pub(super) by_w: [f32; 2],
    pub(super) by_pp: [Triple; 3],
    /// By each of w, and p.
    pub(super) by_wp: [Triple; 2],
    /// By the first of w twice, by both, by the second twice.
    pub(super) by_ww: [f32; 3],
    /// By ln gamma, m.
    pub(super) by_target: f32,
}

impl Reach {
    /// That of a hop that ends where it ends, whatever is moved.
    pub(super) const FIXED: Self = Self {
        by_p: [0.0; 3],
        by_w: [0.0; 2],
        by_pp: [[0.0; 3]; 3],
        by_wp: [[0.0; 3]; 2],
        by_ww: [0.0; 3],
        by_target: 0.0,
    };

    /// Of the hop `from` - `to`, with the interferer at `source` and the coordinate first that follows. [`Reach::FIXED`] where none
    /// does: at the very rim of what can be reached.
    pub(super) fn new(c: f32, source: Triple, from: Triple, to: Triple) -> Self {
        let ([x0, y0, z0], [x, y, z], [sx, sy, sz]) = (from, to, source);
        let (d, dy, dz) = (x - x0, y - y0, z - z0);
        let a = sx - x + c * d;
        let length = square(d) + square(dy) + square(dz);
        if !(square(a) > 1e-9 * c * length) {
            return Self::FIXED;
        }
        let by_p = [c * d, c * dy, c * dz].map(|f| f / a);
        let by_w = [y - sy - c * dy, z - sz - c * dz].map(|f| f / a);
        let [p, p1, p2] = by_p;
        let [w1, w2] = by_w;
        let k = 1.0 - c;
        let by_x = |r: f32| (c * r + k * p * r) / a;
        let both = |r: f32, q: f32| k * r * q / a;
        let twice = |f: f32, r: f32, q: f32| (f + k * r * q) / a;
        let across = |r: f32| (r * c + k * r * p) / a;
        Self {
            by_p,
            by_w,
            by_pp: [
                [(-c + c * p + p * c + k * p * p) / a, by_x(p1), by_x(p2)],
                [across(p1), twice(-c, p1, p1), both(p1, p2)],
                [across(p2), both(p2, p1), twice(-c, p2, p2)],
            ],
            by_wp: [
                [across(w1), twice(c, w1, p1), both(w1, p2)],
                [across(w2), both(w2, p1), twice(c, w2, p2)],
            ],
            by_ww: [twice(k, w1, w1), both(w1, w2), twice(k, w2, w2)],
            by_target: -0.5 * c * length / a,
        }
    }
}
