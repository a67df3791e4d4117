//! A symmetric positive 4 x 4 system by its L D L^T factors, in f64; the last unknown may be left out.

/// The factors. In the order of the terms: below the diagonal of L, and D.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor {
    below: [f64; 6],
    diagonal: [f64; 4],
    /// Whether the last unknown is solved for.
    pub(super) whole: bool,
}

/// A pivot is no pivot below this part of what it came from: seven digits of an f32, of sums of some hundred places.
const SINGULAR: f64 = 2e-6;

impl Factor {
    /// Of the products as [`Sums`](super::sums::Sums) has them. The last unknown is left out where its pivot is not above `least`. `None`
    /// where the first three cannot be told apart.
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

    /// L^-1 `right`.
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

    /// The unknowns.
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

    /// The pivot of the last unknown: one over its variance, in units of that of one place.
    pub(super) const fn last(&self) -> f64 {
        let [.., last] = self.diagonal;
        last
    }

    /// r^T G^-1 r: the variance of what the unknowns make of the terms r, in units of that of one place.
    pub(super) fn variance(&self, terms: [f64; 4]) -> f64 {
        let [da, db, dc, dd] = self.diagonal;
        let [a, b, c, d] = self.forward(terms);
        let last = if self.whole { d * d / dd } else { 0.0 };
        a * a / da + b * b / db + c * c / dc + last
    }
}
