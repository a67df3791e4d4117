//! Which coordinate of a place follows from the other two, once a hop is as long as it may be.
//!
//! Where a hop may end is a surface, the outside of which hears too little. Along most of a chain x is a smooth function of y and h
//! on it; where the chain climbs straight up, or steps straight aside, it is h or y that is one of the other two.

use crate::place::Placement;

/// A coordinate.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Coordinate {
    #[default]
    X,
    Y,
    H,
}

/// (x, y, h), or any three numbers of which each belongs to one coordinate.
pub(crate) type Triple = [f32; 3];

impl Coordinate {
    /// This coordinate first, then the other two in their order.
    #[inline(never)] // called from many places
    pub(crate) const fn first(self, [x, y, h]: Triple) -> Triple {
        match self {
            Self::X => [x, y, h],
            Self::Y => [y, x, h],
            Self::H => [h, x, y],
        }
    }

    /// (x, y, h) again.
    #[inline(never)] // called from many places
    pub(crate) const fn back(self, [first, second, third]: Triple) -> Triple {
        match self {
            Self::X => [first, second, third],
            Self::Y => [second, first, third],
            Self::H => [second, third, first],
        }
    }

    /// A symmetric matrix with this coordinate first.
    pub(crate) fn first_of(self, bend: [Triple; 3]) -> [Triple; 3] {
        self.first_row(bend).map(|row| self.first(row))
    }

    /// The matrix by (x, y, h) again.
    pub(crate) fn back_of(self, bend: [Triple; 3]) -> [Triple; 3] {
        let [a, b, c] = bend.map(|row| self.back(row));
        match self {
            Self::X => [a, b, c],
            Self::Y => [b, a, c],
            Self::H => [b, c, a],
        }
    }

    const fn first_row(self, [x, y, h]: [Triple; 3]) -> [Triple; 3] {
        match self {
            Self::X => [x, y, h],
            Self::Y => [y, x, h],
            Self::H => [h, x, y],
        }
    }
}

/// The coordinates of a place.
pub(super) const fn triple(place: Placement) -> Triple {
    [place.x_m, place.y_m, place.altitude_m]
}

/// One place as seen from another.
pub(super) fn minus([a, b, c]: Triple, [x, y, z]: Triple) -> Triple {
    [a - x, b - y, c - z]
}
