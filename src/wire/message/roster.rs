//! Messages of the gathering pass of the joint method, which collects the relays' profiles.

use heapless::Vec;

use super::parts::{MessageError, PassId, Word, profile, read, write};
use crate::mission::MAX_RELAYS;

/// Maximum number of relays in one roster.
pub const MOST_NAMED: usize = 8;

/// Profile of a relay that differs from the mission's common one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OwnSeat {
    /// Index of the relay in the view, from 1 next to Tx.
    pub index: u16,
    /// Fixed altitude, m; 0 if the relay chooses.
    pub held_m: f32,
    /// Transmit power, W.
    pub power_w: f32,
}

/// Profiles of some relays, in the order of their indices.
pub type OwnSeats = Vec<OwnSeat, MOST_NAMED>;

/// Profiles: onward of the relays up to the sender, back of the whole chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Roster {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// Index of the last relay in earlier passes; 0 in the first pass.
    pub after: u16,
    /// Profiles of the relays after that one. If the roster is full, the next pass collects the rest.
    pub seats: OwnSeats,
}

/// Index, altitude or 0, and power of each relay.
type Parts = Vec<(Word, f32, f32), MOST_NAMED>;

impl Roster {
    pub(super) fn encode(&self, tag: u8, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let mut parts = Parts::new();
        for seat in &self.seats {
            _ = parts.push((Word::new(seat.index), seat.held_m, seat.power_w));
        }
        write(&(tag, pass, Word::new(self.after), parts), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, after, parts): (PassId, Word, Parts) = read(body)?;
        // The count has no empty varint bytes: see `take_targets`.
        if body.len() != 7 + 10 * parts.len() {
            return Err(MessageError::Encoding);
        }
        let mut roster = Self {
            number: pass.number(),
            mission: pass.mission(),
            after: after.number(),
            seats: OwnSeats::new(),
        };
        let mut last = roster.after;
        // By reference, because the code that drops the rest of a by-value iterator could panic.
        for &(index, held_m, power_w) in &parts {
            let index = index.number();
            let chooses = held_m.to_bits() == 0;
            let sound = profile(if chooses { 1.0 } else { held_m }, power_w).is_some();
            if !(sound && index > last && index <= MAX_RELAYS) {
                return Err(MessageError::Value);
            }
            _ = roster.seats.push(OwnSeat {
                index,
                held_m,
                power_w,
            });
            last = index;
        }
        Ok(roster)
    }
}
