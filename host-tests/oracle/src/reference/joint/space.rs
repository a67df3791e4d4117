//! Positions in space and 3 x 3 matrices over (along, sideways, up).

use std::ops::{Add, Mul, Neg, Sub};

/// Position in the cross-section: sideways and up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Across {
    pub(super) y: f64,
    pub(super) h: f64,
}

impl Across {
    pub(super) fn new(y: f64, h: f64) -> Self {
        Self { y, h }
    }

    pub(super) fn apart_2(self, other: Self) -> f64 {
        (self.y - other.y).powi(2) + (self.h - other.h).powi(2)
    }
}

/// A position, step or slope: along Tx-Rx, sideways and up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Triple {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) h: f64,
}

impl Triple {
    pub(super) fn new(x: f64, y: f64, h: f64) -> Self {
        Self { x, y, h }
    }

    pub(super) fn at(x: f64, across: Across) -> Self {
        Self::new(x, across.y, across.h)
    }

    pub(super) fn across(self) -> Across {
        Across::new(self.y, self.h)
    }

    pub(super) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y + self.h * other.h
    }

    pub(super) fn times(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.h * other.h)
    }

    pub(super) fn size(self) -> f64 {
        self.x.abs().max(self.y.abs()).max(self.h.abs())
    }
}

impl Add for Triple {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.h + other.h)
    }
}

impl Sub for Triple {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.h - other.h)
    }
}

impl Mul<f64> for Triple {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.y * factor, self.h * factor)
    }
}

impl Neg for Triple {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Square {
    x: Triple,
    y: Triple,
    h: Triple,
}

impl Square {
    pub(super) fn diagonal(of: Triple) -> Self {
        Self {
            x: Triple::new(of.x, 0.0, 0.0),
            y: Triple::new(0.0, of.y, 0.0),
            h: Triple::new(0.0, 0.0, of.h),
        }
    }

    pub(super) fn even(value: f64) -> Self {
        Self::diagonal(Triple::new(value, value, value))
    }

    pub(super) fn outer(row: Triple, column: Triple) -> Self {
        Self {
            x: column * row.x,
            y: column * row.y,
            h: column * row.h,
        }
    }

    pub(super) fn transpose(self) -> Self {
        Self {
            x: Triple::new(self.x.x, self.y.x, self.h.x),
            y: Triple::new(self.x.y, self.y.y, self.h.y),
            h: Triple::new(self.x.h, self.y.h, self.h.h),
        }
    }

    pub(super) fn apply(self, to: Triple) -> Triple {
        Triple::new(self.x.dot(to), self.y.dot(to), self.h.dot(to))
    }

    pub(super) fn scaled(self, rows: Triple, columns: Triple) -> Self {
        Self {
            x: self.x.times(columns) * rows.x,
            y: self.y.times(columns) * rows.y,
            h: self.h.times(columns) * rows.h,
        }
    }

    pub(super) fn by_rows(self, of: impl Fn(Triple) -> Triple) -> Self {
        Self {
            x: of(self.x),
            y: of(self.y),
            h: of(self.h),
        }
    }

    /// Returns the Cholesky factor of a symmetric matrix; `None` unless it is positive definite.
    pub(super) fn factor(self) -> Option<Factor> {
        let root = |pivot: f64, of: f64| (pivot > 1e-14 * of && pivot > 0.0).then(|| pivot.sqrt());
        let xx = root(self.x.x, self.x.x)?;
        let (yx, hx) = (self.y.x / xx, self.h.x / xx);
        let yy = root(self.y.y - yx * yx, self.y.y)?;
        let hy = (self.h.y - hx * yx) / yy;
        let hh = root(self.h.h - hx * hx - hy * hy, self.h.h)?;
        Some(Factor {
            diagonal: Triple::new(xx, yy, hh),
            below: Triple::new(yx, hx, hy),
        })
    }
}

impl Add for Square {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
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
        self.by_rows(|row| row * factor)
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Factor {
    diagonal: Triple,
    below: Triple,
}

impl Factor {
    /// Solves the symmetric system with right-hand side `to`.
    pub(super) fn solve(self, to: Triple) -> Triple {
        let (of, below) = (self.diagonal, self.below);
        let x = to.x / of.x;
        let y = (to.y - below.x * x) / of.y;
        let h = (to.h - below.y * x - below.h * y) / of.h;
        let h = h / of.h;
        let y = (y - below.h * h) / of.y;
        Triple::new((x - below.x * y - below.y * h) / of.x, y, h)
    }
}
