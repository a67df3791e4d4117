//! Newton step of all relays: elimination along the chain, and substitution back.
//!
//! With the levels c_i, the slacks s_i = c_i - T and the multipliers lambda_i (see [`super`]), the step dz of all positions and dT
//! of the target solve
//!
//! ```text
//! W dz = g + q dT,    q' dz = sigma dT
//! W = sum of -lambda_i H(c_i) + (lambda_i / s_i) grad c_i grad c_i' + box,    g = sum of (mu / s_i) grad c_i + box,
//! q = sum of (lambda_i / s_i) grad c_i,    sigma = sum of lambda_i / s_i
//! ```
//!
//! so dz = W^-1 g + dT W^-1 q and dT = q' W^-1 g / (sigma - q' W^-1 q). A hop has two ends, so W is block tridiagonal with blocks
//! of 3 x 3: Cholesky's factors L_k of the diagonal and B_k beside it follow from one relay to the next,
//!
//! ```text
//! L_k L_k' = W_kk - B_k B_k',    B_(k+1) = W_(k+1,k) L_k'^-1,    u_k = L_k^-1 (g_k - B_k u_(k-1))
//! ```
//!
//! and the step from the last to the first: L_k' dz_k = u_k - B_(k+1)' dz_(k+1). A [`Front`] is all that the relays after k need
//! to know of those before. It is stored for one relay in ten; the factors are computed again on the way back.
//!
//! A pivot that is not positive means that W is not positive definite. The caller then leaves out its negative parts.

use super::super::hop::Triple;
use super::Spot;
use super::hop::{Derivatives, Square, Symmetric, add_product, add_scaled, add_square, dot};
use crate::root::sqrt;

/// Smallest pivot, relative to the diagonal before the elimination.
const LEAST_PIVOT: f32 = 1e-6;

/// Curvature that holds a coordinate without room.
const STIFF: f32 = 1e18;

/// Rows of one relay, without the hop to the next relay, after the elimination of all relays before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Front {
    bend: Symmetric,
    slope: Triple,
    column: Triple,
    /// Amount that the elimination has subtracted from the diagonal.
    taken: Triple,
}

/// Factors of one relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor {
    /// L: inverse of xx, yx, zx, inverse of yy, zy, inverse of zz.
    lower: [f32; 6],
    /// B of the next relay.
    next: Square,
    /// u of g and of q.
    slope: Triple,
    column: Triple,
}

/// Sums that give dT.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    sigma: f32,
    slope: f32,
    column: f32,
}

/// Multipliers of both levels of a hop, and their slacks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub(super) lambda: [f32; 2],
    pub(super) slack: [f32; 2],
    pub(super) mu: f32,
}

impl Weights {
    /// Returns lambda / s of both levels.
    fn ratios(&self) -> [f32; 2] {
        let ([a, b], [s, t]) = (self.lambda, self.slack);
        [a / s, b / t]
    }

    /// Returns mu / s of both levels.
    pub(super) fn central(&self) -> [f32; 2] {
        self.slack.map(|slack| self.mu / slack)
    }

    /// Returns the multipliers after a step that changes the slacks by `change`.
    pub(super) fn after(&self, [a, b]: [f32; 2]) -> [f32; 2] {
        let ([l, m], [s, t]) = (self.lambda, self.slack);
        [(self.mu - l * a) / s, (self.mu - m * b) / t]
    }
}

impl Front {
    pub(super) const NONE: Self = Self {
        bend: [0.0; 6],
        slope: [0.0; 3],
        column: [0.0; 3],
        taken: [0.0; 3],
    };

    /// Eliminates a relay with these rows, and makes them those of the next node, which is at `spot`.
    ///
    /// `hop` leads to that node. `damping` is a relative increase of the diagonal. Without a relay before the hop, its
    /// factors are 0. `None` if a pivot is not positive.
    pub(super) fn pass(
        &mut self,
        is_relay: bool,
        hop: &Derivatives,
        weights: &Weights,
        spot: &Spot,
        damping: f32,
        sums: &mut Sums,
    ) -> Option<Factor> {
        let ratios = weights.ratios();
        let factor = if is_relay {
            self.eliminate(hop, weights, ratios, damping)?
        } else {
            Factor::NONE
        };
        let [a, b] = ratios;
        sums.sigma += a + b;
        sums.slope += dot(factor.slope, factor.column);
        sums.column += dot(factor.column, factor.column);
        *self = Self {
            bend: hop.bend_to,
            ..Self::NONE
        };
        self.add(hop.by_to, weights, ratios);
        self.enclose(weights.mu, spot);
        factor.carry(self);
        Some(factor)
    }

    #[inline(never)]
    fn add(&mut self, slopes: [Triple; 2], weights: &Weights, ratios: [f32; 2]) {
        let pulls = weights.central();
        for ((slope, pull), ratio) in slopes.into_iter().zip(pulls).zip(ratios) {
            add_square(&mut self.bend, slope, ratio);
            add_scaled(&mut self.slope, slope, pull);
            add_scaled(&mut self.column, slope, ratio);
        }
    }

    /// Adds the barrier of the box.
    fn enclose(&mut self, mu: f32, spot: &Spot) {
        let [below, above] = spot.spans();
        let [xx, _, _, yy, _, hh] = &mut self.bend;
        let cells = [xx, yy, hh].into_iter().zip(&mut self.slope);
        for ((bend, slope), (a, b)) in cells.zip(below.into_iter().zip(above)) {
            if a > 0.0 && b > 0.0 {
                let (a, b) = (1.0 / a, 1.0 / b);
                *slope += mu * (a - b);
                *bend += mu * (a * a + b * b);
            } else {
                *bend += STIFF;
            }
        }
    }

    /// Adds the hop to the next relay, and eliminates this relay. `None` if a pivot is not positive.
    fn eliminate(
        &mut self,
        hop: &Derivatives,
        weights: &Weights,
        ratios: [f32; 2],
        damping: f32,
    ) -> Option<Factor> {
        for (cell, more) in self.bend.iter_mut().zip(hop.bend_from) {
            *cell += more;
        }
        self.add(hop.by_from, weights, ratios);
        let lower = self.cholesky(damping)?;
        let [xx, xy, xh, yy, yh, hh] = hop.bend.map(|cell| -cell);
        let mut mixed = [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]];
        for ((to, from), ratio) in hop.by_to.into_iter().zip(hop.by_from).zip(ratios) {
            add_product(&mut mixed, to, from, ratio);
        }
        Some(Factor {
            lower,
            next: mixed.map(|row| forward(lower, row)),
            slope: forward(lower, self.slope),
            column: forward(lower, self.column),
        })
    }

    fn cholesky(&self, damping: f32) -> Option<[f32; 6]> {
        let [xx, xy, xh, yy, yh, hh] = self.bend;
        let [x, y, h] = self.taken;
        let root = |rest: f32, taken: f32| {
            let whole = rest + taken;
            let rest = rest + damping * whole;
            (rest > LEAST_PIVOT * whole.abs()).then(|| 1.0 / sqrt(rest))
        };
        let a = root(xx, x)?;
        let (b, c) = (xy * a, xh * a);
        let d = root(yy - b * b, y + b * b)?;
        let e = (yh - c * b) * d;
        let more = c * c + e * e;
        let f = root(hh - more, h + more)?;
        Some([a, b, c, d, e, f])
    }
}

/// Returns L^-1 v.
#[inline(never)]
fn forward([a, b, c, d, e, f]: [f32; 6], [x, y, z]: Triple) -> Triple {
    let x = x * a;
    let y = (y - b * x) * d;
    [x, y, (z - c * x - e * y) * f]
}

/// Returns L'^-1 v.
fn backward([a, b, c, d, e, f]: [f32; 6], [x, y, z]: Triple) -> Triple {
    let z = z * f;
    let y = (y - e * z) * d;
    [(x - b * y - c * z) * a, y, z]
}

impl Factor {
    pub(super) const NONE: Self = Self {
        lower: [0.0; 6],
        next: [[0.0; 3]; 3],
        slope: [0.0; 3],
        column: [0.0; 3],
    };

    /// Subtracts this relay's part from the `front` of the next relay.
    fn carry(&self, front: &mut Front) {
        let [a, b, c] = self.next;

        front.taken = [dot(a, a), dot(b, b), dot(c, c)];
        let [x, y, h] = front.taken;
        let parts = [x, dot(a, b), dot(a, c), y, dot(b, c), h];
        for (cell, part) in front.bend.iter_mut().zip(parts) {
            *cell -= part;
        }
        for ((slope, column), row) in front.slope.iter_mut().zip(&mut front.column).zip(self.next) {
            *slope -= dot(row, self.slope);
            *column -= dot(row, self.column);
        }
    }

    /// Returns the relay's step, for `by_target` dT and the step of the next relay.
    pub(super) fn step(&self, by_target: f32, next: Triple) -> Triple {
        let mut known = self.slope;
        add_scaled(&mut known, self.column, by_target);
        for (row, moved) in self.next.into_iter().zip(next) {
            add_scaled(&mut known, row, -moved);
        }
        backward(self.lower, known)
    }
}

impl Sums {
    pub(super) const NONE: Self = Self {
        sigma: 0.0,
        slope: 0.0,
        column: 0.0,
    };

    /// Returns dT. `None` if the system is singular.
    pub(super) fn by_target(&self) -> Option<f32> {
        let rest = self.sigma - self.column;
        (rest > 0.0).then(|| self.slope / rest)
    }
}
