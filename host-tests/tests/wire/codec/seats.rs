//! Profiles of relays: Gather and Gathered.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use uav_relay::wire::message::{OwnSeat, Roster};

/// Content of a Gather or Gathered message.
#[expect(clippy::struct_field_names, reason = "the vectors name it so")]
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Seats {
    pub(crate) number: u16,
    pub(crate) view_digest: u16,
    pub(crate) after: u16,
    /// Relay, altitude or 0, and power of each.
    #[serde(serialize_with = "named", deserialize_with = "unnamed")]
    pub(crate) seats: Vec<(u16, f32, f32)>,
}

impl Seats {
    pub(super) fn roster(&self) -> Roster {
        let seat = |&(index, held_m, power_w): &(u16, f32, f32)| OwnSeat {
            index,
            held_m,
            power_w,
        };
        Roster {
            number: self.number,
            view_digest: self.view_digest,
            after: self.after,
            seats: self.seats.iter().map(seat).collect(),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Seat {
    relay: u16,
    altitude_m: f32,
    power_w: f32,
}

fn named<S: Serializer>(seats: &[(u16, f32, f32)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(seats.iter().map(|&(relay, altitude_m, power_w)| Seat {
        relay,
        altitude_m,
        power_w,
    }))
}

fn unnamed<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<(u16, f32, f32)>, D::Error> {
    let seats = Vec::<Seat>::deserialize(from)?.into_iter();
    let parts = |seat: Seat| (seat.relay, seat.altitude_m, seat.power_w);
    Ok(seats.map(parts).collect())
}
