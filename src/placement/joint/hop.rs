//! How far a hop reaches when everything it depends on is moved a little: the reach with its first and second derivatives.
//!
//! A hop leads from (x, v), v = (y, h), to (x', w), w = (y', h'). With c = gamma / A, the target against the sender's gain,
//! and sigma = ln gamma its reach x' = R(x, v, sigma, w) is the root of
//!
//! ```text
//! 2 F = (X - x')^2 + (Y - y')^2 + h'^2 - c ((x' - x)^2 + (y' - y)^2 + (h' - h)^2) = 0
//! ```
//!
//! at which F falls, so a = -F_x' = (X - x') + c (x' - x) > 0. F is quadratic, and its derivatives in z = (x, v, sigma, w) are
//! products of two numbers; those of R follow by differentiating F(R(z), z) = 0 once and twice:
//!
//! ```text
//! R_z = F_z / a,    R_zz' = (F_zz' + F_x'z R_z' + R_z F_x'z' + (1 - c) R_z R_z') / a
//! ```
//!
//! The last hop ends on the ground at Rx, and what is left of it is L(w, sigma) = sqrt(K / gamma - y'^2 - h'^2).
//! Accuracy: `derivatives_agree_with_differences` in `host-tests/tests/joint_derivatives.rs`.

use crate::mission::Interferer;
use crate::sir::{Placement, square};

/// What a reach depends on, in this order: x, y, h, sigma of where the hop begins, y', h' of where it ends.
pub(super) type Row = [f32; 6];

/// A reach's derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    pub(super) slope: Row,
    pub(super) bend: [Row; 6],
}

impl Reach {
    /// That of a hop that ends where it ends whatever is moved.
    pub(super) const FIXED: Self = Self {
        slope: [0.0; 6],
        bend: [[0.0; 6]; 6],
    };

    /// The derivatives of the reach `to` from `from`, for the target `c` times as large as the sender's gain; `None` at the
    /// very tip of a hop, where it has none.
    pub(super) fn new(interferer: &Interferer, c: f32, from: Placement, to: Placement) -> Option<Self> {
        let (d, dy, dh) = (
            to.x_m - from.x_m,
            to.y_m - from.y_m,
            to.altitude_m - from.altitude_m,
        );
        let a = interferer.x_m - to.x_m + c * d;
        let length = square(d) + square(dy) + square(dh);
        // Within rounding of a double root.
        if !(square(a) > 1e-9 * c * length) || !(a > 0.0) {
            return None;
        }
        let slope = [
            c * d,
            c * dy,
            c * dh,
            -0.5 * c * length,
            to.y_m - interferer.y_m - c * dy,
            to.altitude_m - c * dh,
        ]
        .map(|f| f / a);
        let (cd, cy, ch) = (c * d, c * dy, c * dh);
        let f = [
            [-c, 0.0, 0.0, cd, 0.0, 0.0],
            [0.0, -c, 0.0, cy, c, 0.0],
            [0.0, 0.0, -c, ch, 0.0, c],
            [cd, cy, ch, -0.5 * c * length, -cy, -ch],
            [0.0, c, 0.0, -cy, 1.0 - c, 0.0],
            [0.0, 0.0, c, -ch, 0.0, 1.0 - c],
        ];
        let across = [c, 0.0, 0.0, -cd, 0.0, 0.0];
        let mut bend = f;
        for ((row, r), f) in bend.iter_mut().zip(slope).zip(across) {
            for ((cell, r2), f2) in row.iter_mut().zip(slope).zip(across) {
                *cell = (*cell + f * r2 + r * f2 + (1.0 - c) * r * r2) / a;
            }
        }
        Some(Self { slope, bend })
    }
}
