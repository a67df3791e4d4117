//! Behaviour of a relay while its part of the chain has no quorum.

use crate::place::Placement;

/// Behaviour of a relay while the relays that it can reach are too few for a quorum of the chain.
///
/// [`Leave`](Self::Leave) clears the line for the relays that have a quorum. Set the same value on all relays: relays
/// that leave the line then keep their order and distances.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WithoutQuorum {
    /// The drone holds its last agreed position while there is no quorum.
    #[default]
    Hold,
    /// Leave the line from Tx to Rx: fly from the last agreed position sideways (along y) and upward. With a guard,
    /// only within its geofence ([`GuardConfig::with_room_for`](crate::guard::config::GuardConfig::with_room_for)).
    Leave {
        /// Lateral offset that is added to the agreed position, m: -1e4 to 1e4.
        y_m: f32,
        /// Height that is added to the agreed position, m: 0 to 1e4.
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

    /// Returns the position at which a relay without a quorum waits; `place` is the last agreed position.
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
