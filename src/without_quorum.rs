//! What a relay does while its part of the chain has no quorum.

use crate::place::Placement;

/// What a relay does while its part of the chain is too small to fly anything, so that it is in nobody's way.
///
/// Set it alike on all relays: then those that leave keep their order and their distances.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WithoutQuorum {
    /// It stays where it was agreed to be.
    #[default]
    Hold,
    /// It leaves the line, along y and upward from there; with a guard as far as its box goes
    /// ([`GuardConfig::with_room_for`](crate::guard::config::GuardConfig::with_room_for)).
    Leave {
        /// How far to the side, m: -1e4 to 1e4.
        y_m: f32,
        /// How far up, m: 0 to 1e4.
        up_m: f32,
    },
}

impl WithoutQuorum {
    pub(crate) fn is_valid(self) -> bool {
        match self {
            Self::Hold => true,
            Self::Leave { y_m, up_m } => (-1e4..=1e4).contains(&y_m) && (0.0..=1e4).contains(&up_m),
        }
    }

    /// Where a relay is to be then that was agreed to be at `place`.
    pub(crate) fn place(self, place: Placement) -> Placement {
        match self {
            Self::Hold => place,
            Self::Leave { y_m, up_m } => Placement {
                y_m: place.y_m + y_m,
                altitude_m: place.altitude_m + up_m,
                ..place
            },
        }
    }
}
