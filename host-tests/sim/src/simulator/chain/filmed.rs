//! Recording of the film.

use uav_relay::{Port, Side};

use super::super::film::{Sent, Shot};
use super::state::Chain;

impl Chain {
    /// Records the state of relay `index` (from 0) if it changed.
    pub(super) fn film(&mut self, index: usize) {
        let (Some(film), Some(member)) = (&mut self.outcome.film, self.members.get_mut(index))
        else {
            return;
        };
        let is_on = member.killed.is_none();
        let before = member.filmed;
        let place = if is_on {
            member.relay.setpoint()
        } else {
            before.and_then(|(_, place)| place)
        };
        if before != Some((is_on, place)) {
            member.filmed = Some((is_on, place));
            film.shots.push(Shot {
                at: self.now,
                relay: member.node,
                is_on,
                place,
                messages: self.outcome.messages,
            });
        }
    }

    pub(super) fn film_frame(&mut self, index: usize, port: Port) {
        if let (Some(film), Some(member)) = (&mut self.outcome.film, self.members.get(index)) {
            film.sent.push(Sent {
                at: self.now,
                relay: member.node,
                to: match port {
                    Port::Upstream => Some(Side::Upstream),
                    Port::Downstream => Some(Side::Downstream),
                    Port::Shared => None,
                },
            });
        }
    }
}
