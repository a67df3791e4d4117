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
use super::hop::{Derivatives, Symmetric, add_scaled, add_square, dot};
use crate::root::sqrt;

/// Smallest pivot that counts as positive, divided by the diagonal element before the elimination.
const LEAST_PIVOT: f32 = 1e-6;

/// Curvature of a coordinate whose two limits are equal. The curvature is so large that the Newton step does not move
/// this coordinate.
const STIFF: f32 = 1e18;

/// Equations of the Newton system for one relay, after the elimination of all previous relays. They do not contain the
/// terms of the hop to the next relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Front {
    bend: Symmetric,
    slope: Triple,
    column: Triple,
    /// Amount by which the elimination of earlier relays has lowered the diagonal of the matrix `bend`.
    taken: Triple,
}

/// Equation of an eliminated relay after forward substitution. The first three values are the coefficients of the next
/// relay's steps in x, y and h. The last two form the right-hand side: a constant, and the coefficient of the Newton
/// step of the target T.
type Row = [f32; 5];

/// Equations of an eliminated relay, for the computation of its Newton step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor {
    /// Cholesky factor of the relay's 3 x 3 matrix: 1 / xx, yx, hx, 1 / yy, hy, 1 / hh. The diagonal is stored as
    /// inverses, because it is a divisor.
    lower: [f32; 6],
    /// Linear equations for the relay's steps in x, y and h, one row each.
    rows: [Row; 3],
}

/// Sums over all hops and relays that determine the Newton step of the target T, in ln(SIR).
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    sigma: f32,
    slope: f32,
    column: f32,
}

/// Lagrange multipliers of a hop's two levels, their slacks (level minus target), and barrier weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub(super) lambda: [f32; 2],
    pub(super) slack: [f32; 2],
    pub(super) mu: f32,
}

impl Weights {
    /// Returns the Lagrange multiplier divided by the slack (level minus target) for each data direction.
    fn ratios(&self) -> [f32; 2] {
        let ([a, b], [s, t]) = (self.lambda, self.slack);
        [a / s, b / t]
    }

    /// Returns the Lagrange multipliers at the optimum: mu / slack for each direction of data on the hop. The slack is
    /// the level minus the target, and mu is the barrier weight.
    pub(super) fn central(&self) -> [f32; 2] {
        self.slack.map(|slack| self.mu / slack)
    }

    /// Returns the hop's Lagrange multipliers after a Newton step. The step changes the hop's two slacks (level minus
    /// target) by a and b.
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

    /// Eliminates the relay at which `hop` begins from the Newton system. Before the call, `self` has the equations of
    /// this relay; after the call, those of the node at `spot`, where `hop` ends.
    ///
    /// If `hop` begins at Tx, `is_relay` is false, no relay is eliminated, and the returned factor is 0. `None` if a
    /// pivot is not positive. If `convex` is true, a pivot can only be too small by rounding, and is raised instead.
    pub(super) fn pass(
        &mut self,
        is_relay: bool,
        hop: &Derivatives,
        weights: &Weights,
        spot: &Spot,
        convex: bool,
        sums: &mut Sums,
    ) -> Option<Factor> {
        let ratios = weights.ratios();
        let factor = if is_relay {
            self.eliminate(hop, weights, ratios, convex)?
        } else {
            Factor::NONE
        };
        let [a, b] = ratios;
        sums.sigma += a + b;
        *self = Self {
            bend: hop.bend_to,
            ..Self::NONE
        };
        self.add(&hop.by_to, weights, ratios);
        self.enclose(weights.mu, spot);
        self.reduce(&factor, sums);
        Some(factor)
    }

    fn add(&mut self, [a, b]: &[Triple; 2], weights: &Weights, [r, s]: [f32; 2]) {
        let [p, q] = weights.central();
        self.add_level(a, r, p);
        self.add_level(b, s, q);
    }

    #[inline(never)]
    fn add_level(&mut self, slope: &Triple, ratio: f32, pull: f32) {
        add_square(&mut self.bend, slope, ratio);
        add_scaled(&mut self.slope, slope, pull);
        add_scaled(&mut self.column, slope, ratio);
    }

    /// Adds the derivatives of the barrier that keeps the relay at `spot` between its limits.
    fn enclose(&mut self, mu: f32, spot: &Spot) {
        let ([a, b, c], [d, e, f]) = (spot.room_below(), spot.room_above());
        let [xx, _, _, yy, _, hh] = &mut self.bend;
        let [x, y, h] = &mut self.slope;
        barrier(mu, a, d, x, xx);
        barrier(mu, b, e, y, yy);
        barrier(mu, c, f, h, hh);
    }

    /// Adds the terms of the hop to the next node to this relay's equations, then eliminates this relay. `None` if a
    /// pivot is not positive.
    fn eliminate(
        &mut self,
        hop: &Derivatives,
        weights: &Weights,
        ratios: [f32; 2],
        convex: bool,
    ) -> Option<Factor> {
        for (cell, more) in self.bend.iter_mut().zip(&hop.bend_from) {
            *cell += more;
        }
        self.add(&hop.by_from, weights, ratios);
        let lower = self.cholesky(convex)?;
        let [xx, xy, xh, yy, yh, hh] = hop.bend;
        let ([x, y, h], [p, q, r]) = (self.slope, self.column);
        let mut rows = [
            [-xx, -xy, -xh, x, p],
            [-xy, -yy, -yh, y, q],
            [-xh, -yh, -hh, h, r],
        ];
        let ([a, b], [c, d], [r, s]) = (&hop.by_from, &hop.by_to, ratios);
        add_product(&mut rows, a, c, r);
        add_product(&mut rows, b, d, s);
        let [a, b, c, d, e, f] = lower;
        let [x, y, h] = &mut rows;
        combine(x, &[0.0; 5], 0.0, a);
        combine(y, x, b, d);
        combine(h, x, c, 1.0);
        combine(h, y, e, f);
        Some(Factor { lower, rows })
    }

    /// Subtracts the terms of the eliminated previous relay, `factor`, from these equations. Also adds the contribution
    /// of that relay to the sums over the chain, `sums`.
    fn reduce(&mut self, factor: &Factor, sums: &mut Sums) {
        let before = self.bend;
        for &[x, y, h, slope, column] in &factor.rows {
            let row = [x, y, h];
            add_square(&mut self.bend, &row, -1.0);
            add_scaled(&mut self.slope, &row, -slope);
            add_scaled(&mut self.column, &row, -column);
            sums.slope += slope * column;
            sums.column += column * column;
        }
        let ([x, _, _, y, _, h], [a, _, _, b, _, c]) = (before, self.bend);
        self.taken = [x - a, y - b, h - c];
    }

    fn cholesky(&self, convex: bool) -> Option<[f32; 6]> {
        let [xx, xy, xh, yy, yh, hh] = self.bend;
        let [x, y, h] = self.taken;
        let root = |rest: f32, taken: f32| {
            let least = LEAST_PIVOT * (rest + taken).abs();
            (convex || rest > least).then(|| 1.0 / sqrt(rest.max(least)))
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

/// Adds the derivatives of one coordinate's barrier, mu (ln a + ln b), to `slope` and `bend`. The second derivative is
/// added with the opposite sign. a and b are the distances to the lower and the upper limit, and mu is the barrier
/// weight.
#[inline(never)]
fn barrier(mu: f32, a: f32, b: f32, slope: &mut f32, bend: &mut f32) {
    if a > 0.0 && b > 0.0 {
        let (a, b) = (1.0 / a, 1.0 / b);
        *slope += mu * (a - b);
        *bend += mu * (a * a + b * b);
    } else {
        *bend += STIFF;
    }
}

/// Adds the matrix `weight` a b' to the first three columns of `rows`. b' is the transpose of the vector b.
#[inline(never)]
fn add_product(rows: &mut [Row; 3], a: &Triple, b: &Triple, weight: f32) {
    for ([x, y, h, ..], a) in rows.iter_mut().zip(a) {
        let weight = weight * a;
        let [p, q, r] = b;
        *x += weight * p;
        *y += weight * q;
        *h += weight * r;
    }
}

/// Subtracts `part` times the row `from` from the row `to`, and multiplies the row `to` by `scale`.
#[inline(never)]
fn combine(to: &mut Row, from: &Row, part: f32, scale: f32) {
    for (cell, from) in to.iter_mut().zip(from) {
        *cell = (*cell - part * from) * scale;
    }
}

/// Returns the solution z of L' z = v. L' is the transpose of the Cholesky factor, the first argument.
fn backward([a, b, c, d, e, f]: [f32; 6], [x, y, z]: Triple) -> Triple {
    let z = z * f;
    let y = (y - e * z) * d;
    [(x - b * y - c * z) * a, y, z]
}

impl Factor {
    pub(super) const NONE: Self = Self {
        lower: [0.0; 6],
        rows: [[0.0; 5]; 3],
    };

    /// Returns this relay's Newton step in x, y and h. `by_target` is the Newton step of the target T, in ln(SIR), and
    /// `next` the Newton step of the next relay toward Rx.
    pub(super) fn step(&self, by_target: f32, next: Triple) -> Triple {
        let known = (self.rows)
            .map(|[x, y, h, slope, column]| slope + by_target * column - dot(&[x, y, h], &next));
        backward(self.lower, known)
    }
}

impl Sums {
    pub(super) const NONE: Self = Self {
        sigma: 0.0,
        slope: 0.0,
        column: 0.0,
    };

    /// Returns the Newton step of the target T, in ln(SIR). `None` if the quadratic model of the Newton step has no
    /// maximum.
    pub(super) fn by_target(&self) -> Option<f32> {
        let rest = self.sigma - self.column;
        (rest > 0.0).then(|| self.slope / rest)
    }
}
