//! The source that sums speak of: weighted least squares, and how sure it is.
//!
//! With relative errors of variance s^2 the unknowns have the covariance s^2 G^-1, G the products. s^2 is what is left of the sums, over
//! the places beyond the unknowns; four places' worth of what the operator expects is put to it, for of few places little is left.
//!
//! The source that comes nearest to sums which no source would make: on a grid, and a finer one about the best of it.
//!
//! Of a source at (X', Y') the coefficients are k g, g = (X'^2 + Y'^2 + 1/3, -2 X', 1, -2 Y'). The best k is m g / (g G g), G the
//! products and m those with v; and what it leaves of the sums is least where (m g)^2 / (g G g) is largest. Two numbers are left to look for.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

use super::factor::Factor;
use super::sums::Sums;
use super::terms::{Terms, coefficients, expected_v, strength, value};
use crate::mission::{Interferer, Mission};

/// Why sums are of no source.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Unfit {
    /// They are of too few places, or of places too close to one another: what is heard elsewhere does not follow.
    Places,
    /// No single source on the ground would be heard like that.
    NoSource,
    /// What is heard does not fit together, and nobody knows whose measurements are wrong: of four relays or fewer nobody can, nor where more
    /// than one is, nor where the ground between the interferer and an end takes more than the mission says.
    Contradiction,
}

/// How much the operator's expectation of errors counts beside what is seen, in places.
const EXPECTED: f64 = 4.0;

/// How far apart in t places must be, as a variance, to tell the sides of the line from each other.
const SIDES: f64 = 2.5e-5;

/// A source that was found.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FoundSource {
    /// It.
    pub source: Interferer,
    /// The variance of its place, along the line and to its right, m^2.
    pub variance_m2: [f32; 2],
    /// Whether what is heard is that of one source; if not, it is the one that comes nearest, and the variance is not known.
    pub is_one: bool,
}

/// A fit of the four coefficients.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    coefficients: [f64; 4],
    products: [f64; 10],
    right: [f64; 4],
    factor: Factor,
    /// Variance of the relative error of one place, and what of it is expected.
    variance: f64,
    expected: f64,
    /// What is left of the sums, and the places beyond the unknowns.
    seen: f64,
    beyond: f64,
    count: f64,
}

impl Fit {
    /// Of `sums`, where a place is expected to be off by `relative_error`. About 6 000 instructions on a Cortex-M4F: doubles in software.
    ///
    /// # Errors
    /// [`Unfit::Places`]: the three unknowns of the line cannot be told apart.
    pub fn of(sums: &Sums, relative_error: f32) -> Result<Self, Unfit> {
        let [
            aa,
            ab,
            ac,
            ad,
            bb,
            bc,
            bd,
            cc,
            cd,
            dd,
            av,
            bv,
            cv,
            dv,
            vv,
            count,
            measured,
            _,
        ] = sums.numbers.map(f64::from);
        let products = [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd];
        let factor = Factor::new(products, SIDES * aa).ok_or(Unfit::Places)?;
        let right = [av, bv, cv, dv];
        let coefficients = factor.solve(right);
        let [a, b, c, d] = coefficients;
        let left = vv - (a * av + b * bv + c * cv + d * dv);
        let unknowns = if factor.whole { 4.0 } else { 3.0 };
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

    /// What it says that is heard at these terms, as v.
    pub(crate) fn value(&self, terms: &Terms) -> f64 {
        value(&self.coefficients, terms)
    }

    #[expect(clippy::cast_possible_truncation, reason = "checked")]
    /// The power that a source at this place most likely has, W: k = m g / (g G g), as in `nearest`.
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

    /// The variance of that, relative to the square of what is heard.
    pub(crate) fn relative_variance(&self, terms: &Terms) -> f64 {
        let heard = self.value(terms);
        self.variance * self.factor.variance(terms.map(f64::from)) / (heard * heard)
    }

    /// The variance of what one place is off, relative.
    pub(crate) const fn variance(&self) -> f64 {
        self.variance
    }

    /// The variance of what one place is expected to be off, relative.
    pub(crate) const fn expected(&self) -> f64 {
        self.expected
    }

    /// What its places are off, relative: the sum of the squares.
    pub(crate) const fn seen(&self) -> f64 {
        self.seen
    }

    /// Whether there are more places than unknowns, and they are off no more than is expected.
    pub(crate) fn is_of_one_mind(&self) -> bool {
        self.beyond > 1.5 && self.variance < 4.0 * self.expected
    }

    /// How much its sums say: places over the variance of one.
    pub(crate) fn information(&self) -> f64 {
        self.count / self.variance
    }

    /// The mean square of the relative differences between two lots of coefficients, over the places that it is of.
    pub(crate) fn off(&self, one: &[f64; 4], others: &[f64; 4]) -> f64 {
        let [a, b, c, d] = *one;
        let [p, q, r, s] = *others;
        quadratic(&self.products, [a - p, b - q, c - r, d - s]) / self.count
    }

    /// How far off others are from itself.
    pub(crate) fn off_by(&self, others: &[f64; 4]) -> f64 {
        self.off(&self.coefficients, others)
    }

    /// How far off it may be itself by chance, in the same measure.
    pub(crate) fn chance(&self) -> f64 {
        let unknowns = if self.factor.whole { 4.0 } else { 3.0 };
        unknowns * self.variance / self.count
    }

    /// The source, and whether what is heard is that of one. Its side of the line is that of `side_m` where the places do not tell.
    ///
    /// # Errors
    /// [`Unfit::NoSource`]: nothing on the ground makes anything like it.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the mission checks the range of what comes of it"
    )]
    pub fn source(&self, mission: &Mission, side_m: f32) -> Result<FoundSource, Unfit> {
        let [a, b, k, d] = self.coefficients;
        let [aa, _, _, ad, ..] = self.products;
        let half = 0.5 * f64::from(mission.config().distance_m);
        let t = ad / aa;
        let told = self.factor.whole && d * d * self.factor.last() > 4.0 * self.variance;
        let left = if told {
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
                // By how much they change with the coefficients.
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
        // Of weights that add up to 1, so that an f32 holds their squares.
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

/// The mean square of what coefficients leave of `sums`, relative.
pub(crate) fn misfit(sums: &Sums, coefficients: &[f64; 4]) -> f64 {
    let [
        aa,
        ab,
        ac,
        ad,
        bb,
        bc,
        bd,
        cc,
        cd,
        dd,
        av,
        bv,
        cv,
        dv,
        vv,
        count,
        _,
        _,
    ] = sums.numbers.map(f64::from);
    let [a, b, c, d] = *coefficients;
    let products = [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd];
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

/// What is expected at terms by what the mission says, as v; `None` where it says nothing, or what nobody measures.
pub(crate) fn expected_at(mission: &Mission) -> impl Fn(&Terms) -> Option<f32> {
    let known = mission
        .known_source()
        .map(|source| coefficients(mission, &source));
    move |terms| expected_v(value(&known?, terms))
}

/// As far as sources are looked for, in halves of the distance: from one distance before Tx to one beyond Rx, and 1.5 to the side.
const FARTHEST: f32 = 3.0;

/// Steps from the middle to the edge of the first grid, and of the finer ones.
const COARSE: i8 = 8;
const FINE: i8 = 2;

/// Finer grids, each a third as wide as the one before.
const FINER: u8 = 5;

/// X', Y' and k of the source nearest to these products, and on this side of the line of places (1 or -1, from `side` on). 414 places,
/// some 16 000 instructions on a Cortex-M4F. `None` where no source makes anything of them.
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
