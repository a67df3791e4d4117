//! The pass of the joint method on which relays gather what each of them brings along, and what came of it.

use heapless::Vec;

use super::parts::{MessageError, PassId, Word, profile, read, write};
use crate::mission::MAX_RELAYS;

/// The most relays that one roster names.
pub const MOST_NAMED: usize = 8;

/// A relay that brings along something else than the mission says of all.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OwnSeat {
    /// Its place in the view, from 1 next to Tx.
    pub index: u16,
    /// The altitude it keeps to, m; 0 if it chooses.
    pub held_m: f32,
    /// Its transmit power, W.
    pub power_w: f32,
}

/// Some of those relays, in their order.
pub type OwnSeats = Vec<OwnSeat, MOST_NAMED>;

/// What relays bring along: onward of those up to the sender, back of those along the whole chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Roster {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// Relays up to this one have been named by the passes before; 0 in the first one.
    pub after: u16,
    /// The next ones. A full roster may leave some out; the next pass is for them.
    pub seats: OwnSeats,
}

/// For each relay its index, its altitude or 0, and its power.
type Parts = Vec<(Word, f32, f32), MOST_NAMED>;

impl Roster {
    /// The message of this tag, onward or back.
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
        // No empty varint bytes in the count: see `take_targets`.
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
        // By reference: what is left of an iterator by value is dropped by code that could panic.
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
