//! Source estimate: a weighted least-squares fit of the sums, and its uncertainty.
//!
//! With relative errors of variance s^2 the unknowns have the covariance s^2 G^-1, G the products. s^2 is the residual of the
//! sums over the positions beyond the unknowns. The operator's expectation is added with a weight of four positions, as few of
//! them leave little residual.
//!
//! If no source fits, the closest one is searched on a grid, and on finer ones about its optimum. The coefficients of a source at
//! (X', Y') are k g, g = (X'^2 + Y'^2 + 1/3, -2 X', 1, -2 Y'). The best k is m g / (g G g), with m the products with v, and the
//! residual is smallest where (m g)^2 / (g G g) is largest. So the search has two dimensions.
//!
//! The symmetric positive 4 x 4 system is solved by L D L^T factorisation in f64; the last unknown may be omitted.

use super::sums::{Sums, Terms, coefficients, expected_v, strength, value};
use crate::mission::{Interferer, Mission};

/// Reason why the measurements give no single source of interference.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Unfit {
    /// The measured positions are too few, or too close together, to determine a source.
    Places,
    /// The measurements fit no single source on the ground.
    NoSource,
    /// The measurements are inconsistent, and it is unknown which measurement is faulty. This happens with four relays
    /// or fewer, with more than one faulty relay, or if the path loss between the interferer and Tx or Rx differs from
    /// the mission's.
    Contradiction,
}

/// Weight of the operator's expected error variance in the estimated error variance. The estimate is a weighted mean of
/// the expected and the observed variance; the expected one counts like this number of measured positions.
const EXPECTED: f64 = 4.0;

/// Minimum variance of the measured positions' lateral offsets y, in units of D / 2. D is the distance from Tx to Rx.
/// With a smaller variance the measurements do not show on which side of the line Tx to Rx the source is.
const SIDES: f64 = 2.5e-5;

/// Source of interference estimated from the measurements.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FoundSource {
    /// Estimated position and power of the source.
    pub source: Interferer,
    /// Variances of the source's estimated x and y, m^2.
    pub variance_m2: [f32; 2],
    /// True if the measurements fit a single source. If false, `source` is the source whose interference is closest to
    /// the measurements, and `variance_m2` is 0.
    pub is_one: bool,
}

/// Factors L D L^T of the fit's symmetric 4 x 4 matrix: L below its diagonal, and D.
#[derive(Clone, Copy, Debug)]
struct Factor {
    below: [f64; 6],
    diagonal: [f64; 4],
    /// True if the fit determines all four unknowns. False if it leaves out the last one, which tells on which side of
    /// the line Tx to Rx the source is.
    full_rank: bool,
}

/// Minimum pivot of the matrix factorisation, relative to the first pivot. With a smaller pivot, the measured positions
/// cannot separate the unknowns of the fit.
const SINGULAR: f64 = 2e-6;

impl Factor {
    /// Factorises the fit's symmetric matrix, given by ten `products` of [`Sums`]. `None` if the measured positions
    /// cannot separate the first three unknowns. The last unknown is omitted if its pivot is not above `least`.
    fn new(products: [f64; 10], least: f64) -> Option<Self> {
        let [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd] = products;
        if !(aa > 0.0) {
            return None;
        }
        let (l1, l2, l3) = (ab / aa, ac / aa, ad / aa);
        let b = bb - l1 * ab;
        if !(b > SINGULAR * aa) {
            return None;
        }
        let (m2, m3) = ((bc - l1 * ac) / b, (bd - l1 * ad) / b);
        let c = cc - l2 * ac - m2 * m2 * b;
        if !(c > SINGULAR * aa) {
            return None;
        }
        let n3 = (cd - l2 * ad - m2 * m3 * b) / c;
        let d = dd - l3 * ad - m3 * m3 * b - n3 * n3 * c;
        Some(Self {
            below: [l1, l2, m2, l3, m3, n3],
            diagonal: [aa, b, c, d],
            full_rank: d > least,
        })
    }

    fn forward(&self, right: [f64; 4]) -> [f64; 4] {
        let [l1, l2, m2, l3, m3, n3] = self.below;
        let [a, b, c, d] = right;
        let b = b - l1 * a;
        let c = c - l2 * a - m2 * b;
        let d = if self.full_rank {
            d - l3 * a - m3 * b - n3 * c
        } else {
            0.0
        };
        [a, b, c, d]
    }

    fn solve(&self, right: [f64; 4]) -> [f64; 4] {
        let [l1, l2, m2, l3, m3, n3] = self.below;
        let [da, db, dc, dd] = self.diagonal;
        let [a, b, c, d] = self.forward(right);
        let d = if self.full_rank { d / dd } else { 0.0 };
        let c = c / dc - n3 * d;
        let b = b / db - m2 * c - m3 * d;
        let a = a / da - l1 * b - l2 * c - l3 * d;
        [a, b, c, d]
    }

    /// Pivot of the fit's last unknown. The inverse of the pivot is the variance of that unknown, if measurements have variance 1.
    const fn last(&self) -> f64 {
        let [.., last] = self.diagonal;
        last
    }

    /// Returns the variance of the fitted value at a position, for measurements of variance 1. The variance is r^T G^-1
    /// r, with the position's `terms` r and the fit's matrix G.
    fn variance(&self, terms: [f64; 4]) -> f64 {
        let [da, db, dc, dd] = self.diagonal;
        let [a, b, c, d] = self.forward(terms);
        let last = if self.full_rank { d * d / dd } else { 0.0 };
        a * a / da + b * b / db + c * c / dc + last
    }
}

/// Least-squares fit of a source to the measurements: the four coefficients that describe the source.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    coefficients: [f64; 4],
    products: [f64; 10],
    right: [f64; 4],
    factor: Factor,
    /// Variance of the relative error of one measured position, as estimated from the fit.
    variance: f64,
    /// Expected variance of the relative error of one measured position, as set by the operator.
    expected: f64,
    /// Residual of the fit, the sum of the squared relative errors of all measured positions.
    seen: f64,
    /// Degrees of freedom: number of measured positions minus the number of unknowns. 0 if the difference is
    /// negative.
    beyond: f64,
    count: f64,
}

impl Fit {
    /// Fits a source to the measurements in `sums`. `relative_error` is the expected error of a measurement.
    ///
    /// About 6 000 instructions on a Cortex-M4F, in software f64.
    ///
    /// # Errors
    /// [`Unfit::Places`] if the measured positions cannot separate the first three unknowns.
    pub fn of(sums: &Sums, relative_error: f32) -> Result<Self, Unfit> {
        let [products @ .., av, bv, cv, dv, vv, count, measured, _] = sums.numbers.map(f64::from);
        let [aa, ..] = products;
        let factor = Factor::new(products, SIDES * aa).ok_or(Unfit::Places)?;
        let right = [av, bv, cv, dv];
        let coefficients = factor.solve(right);
        let [a, b, c, d] = coefficients;
        let left = vv - (a * av + b * bv + c * cv + d * dv);
        let unknowns = if factor.full_rank { 4.0 } else { 3.0 };
        let expected = f64::from(relative_error) * f64::from(relative_error);
        let expected = expected * count / measured.max(count);
        let (seen, beyond) = if count > unknowns {
            (left.max(0.0), count - unknowns)
        } else {
            (0.0, 0.0)
        };
        let fit = Self {
            coefficients,
            products,
            right,
            factor,
            variance: (EXPECTED * expected + seen) / (EXPECTED + beyond),
            expected,
            seen,
            beyond,
            count,
        };
        Ok(fit)
    }

    pub(crate) fn value(&self, terms: &Terms) -> f64 {
        value(&self.coefficients, terms)
    }

    #[expect(clippy::cast_possible_truncation, reason = "checked")]
    /// Returns the most likely power, W, of a source at (`x_m`, `y_m`), given the measurements. `None` if the power is
    /// outside of 1e-6 to 1e9 W.
    pub(crate) fn power_w(&self, mission: &Mission, [x_m, y_m]: [f32; 2]) -> Option<f32> {
        let unit = Interferer {
            power_w: mission.config().common.power_w,
            x_m,
            y_m,
        };
        let shape = coefficients(mission, &unit);
        let [a, b, c, d] = shape;
        let [av, bv, cv, dv] = self.right;
        let with = a * av + b * bv + c * cv + d * dv;
        let power_w = (f64::from(unit.power_w) * quadratic(&self.products, shape) / with) as f32;
        (1e-6..=1e9).contains(&power_w).then_some(power_w)
    }

    /// Returns the relative variance of the fitted inverse interference at a position with these `terms`.
    pub(crate) fn relative_variance(&self, terms: &Terms) -> f64 {
        let heard = self.value(terms);
        self.variance * self.factor.variance(terms.map(f64::from)) / (heard * heard)
    }

    pub(crate) const fn variance(&self) -> f64 {
        self.variance
    }

    pub(crate) const fn expected(&self) -> f64 {
        self.expected
    }

    /// Residual of the fit: the sum of the squared relative errors of all measured positions.
    pub(crate) const fn seen(&self) -> f64 {
        self.seen
    }

    /// Returns true if the fit has more measured positions than unknowns, and its variance is small. The variance must
    /// be below four times the variance that the operator expects.
    pub(crate) fn is_consistent(&self) -> bool {
        self.beyond > 1.5 && self.variance < 4.0 * self.expected
    }

    /// Returns the information in the measurements.
    ///
    /// It is the number of positions divided by the variance of one position's error.
    pub(crate) fn information(&self) -> f64 {
        self.count / self.variance
    }

    /// Returns the mean square relative difference of two sources' interference at the measured positions. Each source
    /// is given by its four coefficients ([`coefficients`]).
    pub(crate) fn mean_square_difference(&self, one: &[f64; 4], others: &[f64; 4]) -> f64 {
        let [a, b, c, d] = *one;
        let [p, q, r, s] = *others;
        quadratic(&self.products, [a - p, b - q, c - r, d - s]) / self.count
    }

    /// Returns the mean square relative difference in interference between the fit and a given source. The mean is over
    /// the measured positions. The source is given by its four coefficients ([`coefficients`]).
    pub(crate) fn mean_square_from_fit(&self, others: &[f64; 4]) -> f64 {
        self.mean_square_difference(&self.coefficients, others)
    }

    /// Returns the expected mean square relative error of the fitted interference.
    pub(crate) fn chance(&self) -> f64 {
        let unknowns = if self.factor.full_rank { 4.0 } else { 3.0 };
        unknowns * self.variance / self.count
    }

    /// Returns the source of interference that fits the measurements, or else the closest one.
    ///
    /// The measured positions may not determine if the y of the source is above or below their mean y. The source is
    /// then on the same side of their mean y as `side_m`, a lateral offset, m.
    ///
    /// # Errors
    /// [`Unfit::NoSource`] if no source on the ground fits.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the mission checks the range of what comes of it"
    )]
    pub fn source(&self, mission: &Mission, side_m: f32) -> Result<FoundSource, Unfit> {
        let [a, b, k, d] = self.coefficients;
        let [aa, _, _, ad, ..] = self.products;
        let half = 0.5 * f64::from(mission.config().distance_m);
        let t = ad / aa;
        let is_known = self.factor.full_rank && d * d * self.factor.last() > 4.0 * self.variance;
        let left = if is_known {
            d > 0.0
        } else {
            f64::from(side_m) / half < t
        };
        let sign = if left { -1.0 } else { 1.0 };
        let x = -0.5 * b / k;
        let above = (a + d * t) / k;
        let squared = t * t + above - 1.0 / 3.0 - x * x;
        let source = |[x, y, k]: [f64; 3]| Interferer {
            power_w: strength(mission, k) as f32,
            x_m: ((x + 1.0) * half) as f32,
            y_m: (y * half) as f32,
        };
        if k > 0.0 && squared > 0.0 {
            let apart = libm::sqrt(squared);
            let found = source([x, t + sign * apart, k]);
            if found.is_valid() {
                // Derivatives of the position by the coefficients.
                let along = [0.0, -0.5 / k, -x / k, 0.0];
                let side = 0.5 / (apart * k);
                let aside = [side, side * x, side * (2.0 * x * x - above), side * t];
                let variance =
                    |slopes| (self.variance * self.factor.variance(slopes) * half * half) as f32;
                return Ok(FoundSource {
                    source: found,
                    variance_m2: [variance(along), variance(aside)],
                    is_one: true,
                });
            }
        }
        // Weights normalised to a sum of 1, so that an f32 holds their squares.
        let scale = libm::sqrt(aa);
        let products = self.products.map(|product| (product / aa) as f32);
        let right = self.right.map(|product| (product / scale) as f32);
        let found = nearest(&products, &right, t as f32, sign as f32).ok_or(Unfit::NoSource)?;
        let [x, y, k] = found.map(f64::from);
        let found = source([x, y, k / scale]);
        found
            .is_valid()
            .then_some(FoundSource {
                source: found,
                variance_m2: [0.0; 2],
                is_one: false,
            })
            .ok_or(Unfit::NoSource)
    }
}

/// Returns the mean square relative error of the measurements for a source with these `coefficients`. `sums` are the
/// sums of the measurements.
pub(crate) fn misfit(sums: &Sums, coefficients: &[f64; 4]) -> f64 {
    let [products @ .., av, bv, cv, dv, vv, count, _, _] = sums.numbers.map(f64::from);
    let [a, b, c, d] = *coefficients;
    let left = vv - 2.0 * (a * av + b * bv + c * cv + d * dv) + quadratic(&products, *coefficients);
    if count > 0.0 { left / count } else { 0.0 }
}

fn quadratic(products: &[f64; 10], [a, b, c, d]: [f64; 4]) -> f64 {
    let [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd] = products;
    a * (aa * a + 2.0 * (ab * b + ac * c + ad * d))
        + b * (bb * b + 2.0 * (bc * c + bd * d))
        + c * (cc * c + 2.0 * cd * d)
        + dd * d * d
}

/// Returns a function that converts the terms of a position to v = 1e-12 W / I there. I is the interference power of
/// the mission's interferer. The function gives `None` if the source is not known, or if v is outside of the measurable
/// range.
pub(crate) fn expected_at(mission: &Mission) -> impl Fn(&Terms) -> Option<f32> {
    let known = mission
        .known_source()
        .map(|source| coefficients(mission, &source));
    move |terms| expected_v(value(&known?, terms))
}

/// Half width of the square searched for a source, in units of D / 2; D is the distance from Tx to Rx. The square
/// reaches from x = -D to x = 2 D, and from y = -1.5 D to y = 1.5 D.
const FARTHEST: f32 = 3.0;

/// Number of grid steps from the middle to the edge of the first grid of the search for a source.
const COARSE: i8 = 8;

/// Number of grid steps from the middle to the edge of each finer grid of the search for a source.
const FINE: i8 = 2;

/// Number of finer grids in the search for a source. The steps of each grid are 0.4 times the steps of the previous
/// grid.
const FINER: u8 = 5;

/// Returns position X', Y' and strength k of the best-fitting source; `None` if none fits. The search tries the points
/// of grids. Positions are in units of half the distance from Tx to Rx.
///
/// The search covers Y' above `side`, the mean Y' of the measured positions, if `sign` is 1, and Y' below it if `sign`
/// is -1. It tries 414 positions, in some 16 000 instructions on a Cortex-M4F.
pub(super) fn nearest(
    products: &[f32; 10],
    right: &[f32; 4],
    side: f32,
    sign: f32,
) -> Option<[f32; 3]> {
    let mut best = Best {
        products,
        right,
        score: 0.0,
        at: None,
    };
    let step = FARTHEST / f32::from(COARSE);
    best.look([0.0, side], step, COARSE, side, sign);
    let mut step = step;
    for _ in 0..FINER {
        let [x, y, _] = best.at?;
        step *= 0.4;
        best.look([x, y], step, FINE, side, sign);
    }
    best.at
}

struct Best<'a> {
    products: &'a [f32; 10],
    right: &'a [f32; 4],
    score: f32,
    at: Option<[f32; 3]>,
}

impl Best<'_> {
    fn look(&mut self, [x, y]: [f32; 2], step: f32, steps: i8, side: f32, sign: f32) {
        for i in -steps..=steps {
            for j in -steps..=steps {
                let (x, y) = (x + f32::from(i) * step, y + f32::from(j) * step);
                if (y - side) * sign >= 0.0 {
                    self.weigh(x, y);
                }
            }
        }
    }

    fn weigh(&mut self, x: f32, y: f32) {
        let [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd] = *self.products;
        let [av, bv, cv, dv] = *self.right;
        let (a, b, d) = (x * x + y * y + 1.0 / 3.0, -2.0 * x, -2.0 * y);
        let with = a * av + b * bv + cv + d * dv;
        let square = a * (aa * a + 2.0 * (ab * b + ac + ad * d))
            + b * (bb * b + 2.0 * (bc + bd * d))
            + cc
            + d * (2.0 * cd + dd * d);
        let score = with * with / square;
        if with > 0.0 && square > 0.0 && score > self.score {
            self.score = score;
            self.at = Some([x, y, with / square]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Factor;

    /// Symmetric matrix of the fit for four measured positions. Its rows are linearly independent.
    const MATRIX: [[f64; 4]; 4] = [
        [4.0, 0.6, 1.1, -0.7],
        [0.6, 3.0, -0.4, 0.9],
        [1.1, -0.4, 2.0, 0.5],
        [-0.7, 0.9, 0.5, 1.5],
    ];

    fn factor(least: f64) -> Factor {
        let [a, b, c, d] = MATRIX;
        let products = [a[0], a[1], a[2], a[3], b[1], b[2], b[3], c[2], c[3], d[3]];
        Factor::new(products, least).unwrap()
    }

    fn times(x: [f64; 4]) -> [f64; 4] {
        MATRIX.map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum())
    }

    /// Checks that the factorisation solves the fit's equations, and that the variance is r^T G^-1 r.
    #[test]
    fn the_equations_of_the_fit_are_solved() {
        let factor = factor(0.0);
        for unknown in [[1.0, -2.0, 0.5, 3.0], [0.3, 0.2, -1.5, -0.8]] {
            let right = times(unknown);
            let solved = factor.solve(right);
            for (ours, expected) in solved.iter().zip(unknown) {
                assert!((ours - expected).abs() < 1e-12, "{solved:?} {unknown:?}");
            }
            let variance: f64 = right.iter().zip(unknown).map(|(r, x)| r * x).sum();
            assert!((factor.variance(right) - variance).abs() < 1e-12);
        }
    }

    /// Checks that the last unknown is 0 if its pivot is too small. The other unknowns then solve their equations.
    #[test]
    fn an_unknown_that_is_not_seen_is_left_out() {
        let factor = factor(10.0);
        let unknown = [1.0, -2.0, 0.5, 0.0];
        let solved = factor.solve(times(unknown));
        for (ours, expected) in solved.iter().zip(unknown) {
            assert!((ours - expected).abs() < 1e-12, "{solved:?}");
        }
    }
}
