//! Pairs and 2 x 2 matrices over (along, up), and the linear system of a chain: one 2 x 2 block per relay, coupled to its
//! neighbours, and one more unknown coupled to all.

use std::ops::{Add, Mul, Neg, Sub};

/// A place, a step or a slope: along Tx-Rx and up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Pair {
    pub(super) x: f64,
    pub(super) h: f64,
}

impl Pair {
    pub(super) fn new(x: f64, h: f64) -> Self {
        Self { x, h }
    }

    pub(super) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.h * other.h
    }
}

impl Add for Pair {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.h + other.h)
    }
}

impl Sub for Pair {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.h - other.h)
    }
}

impl Mul<f64> for Pair {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.h * factor)
    }
}

impl Neg for Pair {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

/// A 2 x 2 matrix, by its rows.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Square {
    x: Pair,
    h: Pair,
}

impl Square {
    pub(super) fn diagonal(value: f64) -> Self {
        Self {
            x: Pair::new(value, 0.0),
            h: Pair::new(0.0, value),
        }
    }

    /// `row` times the transpose of `column`.
    pub(super) fn outer(row: Pair, column: Pair) -> Self {
        Self {
            x: column * row.x,
            h: column * row.h,
        }
    }

    fn transpose(self) -> Self {
        Self {
            x: Pair::new(self.x.x, self.h.x),
            h: Pair::new(self.x.h, self.h.h),
        }
    }

    pub(super) fn apply(self, to: Pair) -> Pair {
        Pair::new(self.x.dot(to), self.h.dot(to))
    }

    fn product(self, other: Self) -> Self {
        let columns = other.transpose();
        Self {
            x: columns.apply(self.x),
            h: columns.apply(self.h),
        }
    }

    /// The inverse of a symmetric matrix, if that is positive definite.
    fn positive_inverse(self) -> Option<Self> {
        let determinant = self.x.x * self.h.h - self.x.h * self.h.x;
        let size = self.x.x * self.h.h;
        (self.x.x > 0.0 && determinant > 1e-14 * size).then(|| Self {
            x: Pair::new(self.h.h, -self.x.h) * determinant.recip(),
            h: Pair::new(-self.h.x, self.x.x) * determinant.recip(),
        })
    }
}

impl Add for Square {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            h: self.h + other.h,
        }
    }
}

impl Sub for Square {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul<f64> for Square {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            x: self.x * factor,
            h: self.h * factor,
        }
    }
}

/// The rows of one relay in a symmetric system.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    /// Against the relay itself; symmetric.
    pub(super) own: Square,
    /// Against the relay before.
    pub(super) before: Square,
    /// Against the unknown that is common to all.
    pub(super) common: Pair,
    /// Right-hand side.
    pub(super) right: Pair,
}

/// Solves the system, `corner` and `corner_right` being the row of the common unknown; `None` unless the matrix is positive
/// definite. O(N).
pub(super) fn solve(blocks: &[Block], corner: f64, corner_right: f64) -> Option<(Vec<Pair>, f64)> {
    // Per relay: the inverse of its reduced block, and the reduced right-hand sides (of the system, of the common column).
    let mut reduced: Vec<(Square, Pair, Pair)> = Vec::with_capacity(blocks.len());
    for block in blocks {
        let (mut own, mut right, mut common) = (block.own, block.right, block.common);
        if let Some(&(inverse, last_right, last_common)) = reduced.last() {
            let carry = block.before.product(inverse);
            own = own - carry.product(block.before.transpose());
            right = right - carry.apply(last_right);
            common = common - carry.apply(last_common);
        }
        reduced.push((own.positive_inverse()?, right, common));
    }
    let mut columns = Vec::with_capacity(blocks.len());
    let (mut right, mut common, mut link) = (Pair::default(), Pair::default(), Square::default());
    for (block, &(inverse, own_right, own_common)) in blocks.iter().zip(&reduced).rev() {
        right = inverse.apply(own_right - link.apply(right));
        common = inverse.apply(own_common - link.apply(common));
        link = block.before.transpose();
        columns.push((right, common));
    }
    columns.reverse();
    let (mut pivot, mut rest) = (corner, corner_right);
    for (block, &(right, common)) in blocks.iter().zip(&columns) {
        pivot -= block.common.dot(common);
        rest -= block.common.dot(right);
    }
    let last = rest / pivot;
    (pivot > 0.0 && last.is_finite()).then(|| {
        let steps = columns
            .into_iter()
            .map(|(right, common)| right - common * last);
        (steps.collect(), last)
    })
}
