//! What one relay brings along to a chain that is solved.

use crate::mission::{Mission, Profile};
use crate::optimiser::joint::room::Room;

/// What one relay brings along, as far as it is known.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Seat {
    /// Where it may fly across the line.
    pub room: Room,
    /// Its transmit power, W.
    pub power_w: f32,
}

impl Seat {
    /// That of a relay which was given nothing of its own.
    pub const fn common(mission: &Mission) -> Self {
        Self {
            room: Room::of(mission),
            power_w: mission.config().common.power_w,
        }
    }

    /// That of a relay which holds `own`, and its altitude if it `holds` that.
    pub const fn of(mission: &Mission, own: Profile, holds: bool) -> Self {
        let room = Room::of(mission);
        Self {
            room: if holds {
                room.at_altitude(own.altitude_m)
            } else {
                room
            },
            power_w: own.power_w,
        }
    }
}
