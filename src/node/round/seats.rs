//! What the relays of a view bring along, as far as a relay knows it.

use crate::mission::{Mission, Profile};
use crate::optimiser::joint::{MOST_SOLVED, Seat};
use crate::wire::message::Roster;

/// What the relays of the view bring along, as far as it is known.
#[derive(Clone, Debug)]
pub(super) struct Seats {
    /// Relays that are known, from Tx on; `None` before anybody has asked.
    pub(super) known: Option<u16>,
    /// The altitude that a relay keeps to, m, or 0; its power, W, or 0 where the mission says all.
    own: [[f32; 2]; MOST_SOLVED],
}

impl Seats {
    /// Nobody has asked.
    pub(super) const UNKNOWN: Self = Self {
        known: None,
        own: [[0.0; 2]; MOST_SOLVED],
    };

    /// What relay `index` brings along: what the mission says where nobody has asked.
    #[inline(never)] // the solver asks in many places
    pub(super) fn of(&self, mission: &Mission, index: u16) -> Seat {
        let at = usize::from(index).wrapping_sub(1);
        match self.own.get(at) {
            Some(&[altitude_m, power_w]) if power_w > 0.0 => {
                let own = Profile {
                    altitude_m,
                    power_w,
                };
                Seat::of(mission, own, altitude_m > 0.0)
            }
            _ => Seat::common(mission),
        }
    }

    /// Whether it is known of some of `relays` alone.
    pub(super) fn is_partial(&self, relays: u16) -> bool {
        self.known.is_some_and(|known| known < relays)
    }

    /// Takes what came of a pass along `relays`; whether that is all.
    pub(super) fn take(&mut self, roster: &Roster, relays: u16) -> bool {
        for seat in &roster.seats {
            let at = usize::from(seat.index).wrapping_sub(1);
            if let Some(own) = self.own.get_mut(at) {
                *own = [seat.held_m, seat.power_w];
            }
        }
        let last = roster.seats.last().filter(|_| roster.seats.is_full());
        self.known = Some(last.map_or(relays, |last| last.index));
        !self.is_partial(relays)
    }
}
