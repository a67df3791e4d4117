//! Profiles of relays: Gather and Gathered.

use serde::Deserialize;
use uav_relay::wire::message::{OwnSeat, Roster};

use super::bytes::{pass, reals};
use super::limits::{is_altitude, is_power};
use super::reader::Reader;

/// Content of a Gather or Gathered message.
#[expect(clippy::struct_field_names, reason = "the vectors name it so")]
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Seats {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    pub(crate) after: u16,
    /// Relay, altitude or 0, and power of each.
    pub(crate) seats: Vec<(u16, f32, f32)>,
}

impl Seats {
    pub(super) fn body(&self, tag: u8) -> Vec<u8> {
        let mut out = pass(tag, [self.number, self.mission]);
        out.extend(self.after.to_le_bytes());
        out.push(u8::try_from(self.seats.len()).unwrap());
        for &(index, altitude_m, power_w) in &self.seats {
            out.extend(index.to_le_bytes());
            reals(&mut out, &[altitude_m, power_w]);
        }
        out
    }

    pub(super) fn roster(&self) -> Roster {
        let seat = |&(index, held_m, power_w): &(u16, f32, f32)| OwnSeat {
            index,
            held_m,
            power_w,
        };
        Roster {
            number: self.number,
            mission: self.mission,
            after: self.after,
            seats: self.seats.iter().map(seat).collect(),
        }
    }

    pub(super) fn in_range(&self) -> bool {
        let mut before = self.after;
        self.seats.iter().all(|&(index, held_m, power_w)| {
            let later = index > before && index <= 1000;
            before = index;
            later && (held_m.to_bits() == 0 || is_altitude(held_m)) && is_power(power_w)
        })
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        let (number, mission, after) = (rest.word()?, rest.word()?, rest.word()?);
        let count = rest.byte().filter(|&count| count <= 8)?;
        let seats = (0..count).map(|_| Some((rest.word()?, rest.real()?, rest.real()?)));
        let seats = seats.collect::<Option<_>>()?;
        Some(Self {
            number,
            mission,
            after,
            seats,
        })
    }
}
