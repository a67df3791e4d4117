//! Symmetric positive 4 x 4 system, solved by L D L^T factorisation in f64; the last unknown may be omitted.

/// L D L^T factors in the order of the terms: L below its diagonal, and D.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor {
    below: [f64; 6],
    diagonal: [f64; 4],
    /// True if the last unknown is solved for.
    pub(super) whole: bool,
}

/// Minimum pivot relative to the first: seven digits of an f32, for sums of some hundred positions.
const SINGULAR: f64 = 2e-6;

impl Factor {
    /// Factors the products of [`Sums`](super::sums::Sums); `None` if the first three unknowns cannot be separated. The last
    /// unknown is omitted if its pivot is not above `least`.
    pub(super) fn new(products: [f64; 10], least: f64) -> Option<Self> {
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
            whole: d > least,
        })
    }

    fn forward(&self, right: [f64; 4]) -> [f64; 4] {
        let [l1, l2, m2, l3, m3, n3] = self.below;
        let [a, b, c, d] = right;
        let b = b - l1 * a;
        let c = c - l2 * a - m2 * b;
        let d = if self.whole {
            d - l3 * a - m3 * b - n3 * c
        } else {
            0.0
        };
        [a, b, c, d]
    }

    pub(super) fn solve(&self, right: [f64; 4]) -> [f64; 4] {
        let [l1, l2, m2, l3, m3, n3] = self.below;
        let [da, db, dc, dd] = self.diagonal;
        let [a, b, c, d] = self.forward(right);
        let d = if self.whole { d / dd } else { 0.0 };
        let c = c / dc - n3 * d;
        let b = b / db - m2 * c - m3 * d;
        let a = a / da - l1 * b - l2 * c - l3 * d;
        [a, b, c, d]
    }

    /// Pivot of the last unknown: the inverse of its variance, in units of that of one position.
    pub(super) const fn last(&self) -> f64 {
        let [.., last] = self.diagonal;
        last
    }

    /// Returns r^T G^-1 r: the variance of the fit at the terms r, in units of that of one position.
    pub(super) fn variance(&self, terms: [f64; 4]) -> f64 {
        let [da, db, dc, dd] = self.diagonal;
        let [a, b, c, d] = self.forward(terms);
        let last = if self.whole { d * d / dd } else { 0.0 };
        a * a / da + b * b / db + c * c / dc + last
    }
}
