//! Where an ascent begins: chains that pass the interferer low, in an arch over it, beside it on either hand, or beyond it.
//!
//! The chain is a shortest way in a metric in which a metre near the interferer counts for more, and there is a locally shortest way on
//! each side of it. Which of them is the best depends on the room, on the power and on the number of relays; each is tried.

use crate::sir::CrossSection;

use super::link::Room;

/// One of them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Start {
    /// A parabola over the line: so much to the side and upward in the middle, in halves of D.
    Arch { aside: f32, up: f32 },
    /// The same, from a target so high that no hop leaps to the far side of the interferer.
    Near { aside: f32, up: f32 },
    /// Relay 1 right above Rx, as high or far aside as pays, the others on the way down from there.
    Far,
}

/// The shapes of arches: aside, up.
const ARCHES: [(f32, f32); 14] = [
    (0.0, 0.0),
    (0.0, 1.0),
    (0.0, 0.25),
    (0.0, 0.5),
    (0.0, 0.1),
    (0.0, 2.0),
    (-1.0, 0.0),
    (1.0, 0.0),
    (-0.7, 0.7),
    (0.7, 0.7),
    (-0.25, 0.0),
    (0.25, 0.0),
    (-0.2, 0.2),
    (0.2, 0.2),
];

impl Start {
    /// Start `number` for relays with that `room`, of which there are `relays`; `None` after the last, `Some(None)` where it is no use.
    pub(super) fn number(number: u8, room: Room, relays: u16) -> Option<Option<Self>> {
        let Room { lateral, band } = room;
        let fits = |(aside, up): (f32, f32)| {
            let sideways = if aside < 0.0 {
                lateral.least_m < 0.0
            } else if aside > 0.0 {
                lateral.most_m > 0.0
            } else {
                true
            };
            sideways && (!(up > 0.0) || !band.is_single())
        };
        let free = !(band.is_single() && lateral.is_single());
        let count = ARCHES.len();
        let number = usize::from(number);
        if number == 2 * count {
            return Some((relays > 1 && free).then_some(Self::Far));
        }
        let &(aside, up) = ARCHES
            .get(number)
            .or_else(|| ARCHES.get(number.checked_sub(count)?))?;
        let fits = fits((aside, up));
        Some(if number < count {
            fits.then_some(Self::Arch { aside, up })
        } else {
            (fits && free).then_some(Self::Near { aside, up })
        })
    }

    /// Where a relay flies across the line that comes after one at `x_m`, of a chain `distance_m` long.
    pub(super) fn across(self, distance_m: f32, x_m: f32, room: Room) -> CrossSection {
        let (aside, up) = match self {
            Self::Arch { aside, up } | Self::Near { aside, up } => (aside, up),
            Self::Far => (0.0, 0.0),
        };
        let t = (x_m / distance_m).clamp(0.0, 1.0);
        let rise = 2.0 * distance_m * t * (1.0 - t);
        room.nearest(CrossSection {
            y_m: aside * rise,
            altitude_m: up * rise,
        })
    }
}
