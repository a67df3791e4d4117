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
//! and by ln gamma R = -c |p' - p|^2 / 2a. Accuracy: `derivatives_agree_with_differences` in this file.

use super::axis::Triple;
use crate::sir::square;

/// What a reach depends on: where the hop begins, three coordinates, and the two that are free of where it ends.
pub(super) type Row = [f32; 5];

/// A reach's derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    pub(super) slope: Row,
    pub(super) bend: [Row; 5],
    /// By ln gamma, m.
    pub(super) by_target: f32,
}

impl Reach {
    /// That of a hop that ends where it ends, whatever is moved.
    pub(super) const FIXED: Self = Self {
        slope: [0.0; 5],
        bend: [[0.0; 5]; 5],
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
        let slope = [c * d, c * dy, c * dz, y - sy - c * dy, z - sz - c * dz].map(|f| f / a);
        let mut bend = [
            [-c, 0.0, 0.0, 0.0, 0.0],
            [0.0, -c, 0.0, c, 0.0],
            [0.0, 0.0, -c, 0.0, c],
            [0.0, c, 0.0, 1.0 - c, 0.0],
            [0.0, 0.0, c, 0.0, 1.0 - c],
        ];
        let mixed = [c, 0.0, 0.0, 0.0, 0.0];
        for ((row, r), f) in bend.iter_mut().zip(slope).zip(mixed) {
            for ((cell, r2), f2) in row.iter_mut().zip(slope).zip(mixed) {
                *cell = (*cell + f * r2 + r * f2 + (1.0 - c) * r * r2) / a;
            }
        }
        Self {
            slope,
            bend,
            by_target: -0.5 * c * length / a,
        }
    }
}
