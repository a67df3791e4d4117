//! A relay's turn in Algorithm 2, and what comes back of the turns after its own.

use core::task::Poll;

use super::core::{Own, PLACES_AT_ONCE, Pass, Share};
use super::state::Next;
use super::task::Lead;
use super::turning::Turning;
use crate::optimiser::local::HopEnd as Beside;
use crate::wire::message::{AdjustStep as Turn, Moved, Token};

impl Share {
    /// The token, from the relay before.
    pub(crate) fn on_token(&mut self, own: Own<'_>, token: &Token) -> Next {
        let same = matches!(&self.pass, Pass::Turn(turning) if turning.turn == token.turn);
        let arrival = self.exchange.arrival(token.number, same);
        if let Some(next) = arrival.refused(self.exchange) {
            return next;
        }
        if self.setpoint.is_none() {
            // It has none to tell: it was not there when the places were agreed on.
            return Next::Foreign;
        }
        if own.mission.interferer().is_none() || !own.is_between(token.place) {
            // Nobody stands beyond Rx.
            return Next::Stale;
        }
        self.exchange.take(token.number);
        let before = Beside {
            place: token.place,
            apart_m: own.mission.config().min_separation_m,
        };
        let gain = own.mission.relay_gain(token.power_w);
        self.take_turn(own, Turning::new(token.turn, token.sir, before, gain))
    }

    /// The token is here.
    pub(super) fn take_turn(&mut self, own: Own<'_>, mut turning: Turning) -> Next {
        self.exchange.wait();
        let mut searching = false;
        if let Some(at) = self.setpoint
            && let Some(interferer) = own.mission.interferer()
            && (own.is_last() || self.after.is_some())
        {
            let band = own.band(at.altitude_m);
            let hops = turning.hops(own.mission, interferer, self.profile.power_w, self.after);
            searching = turning.begin(hops, at, (band.least_m, band.most_m));
        }
        self.pass = Pass::Turn(turning);
        if searching {
            Next::Work { moved: false }
        } else {
            self.pass_on_turn(own, false)
        }
    }

    /// Weighs some more places.
    pub(super) fn go_on_with_turn(&mut self, own: Own<'_>) -> Next {
        let Pass::Turn(turning) = &mut self.pass else {
            return Next::Stale;
        };
        match turning.step(PLACES_AT_ONCE) {
            Poll::Pending => Next::Work { moved: false },
            Poll::Ready(None) => self.pass_on_turn(own, false),
            Poll::Ready(Some(place)) => {
                self.setpoint = Some(place);
                self.at = place.cross_section();
                self.pass_on_turn(own, true)
            }
        }
    }

    pub(super) fn pass_on_turn(&mut self, own: Own<'_>, moved: bool) -> Next {
        if !own.is_last() {
            return Next::Forward { moved };
        }
        self.conclude_turn(own, moved, f32::MAX)
    }

    /// What a turn came to, from the relay after.
    pub(crate) fn on_moved(&mut self, own: Own<'_>, moved: &Moved) -> Next {
        if let Pass::Turn(turning) = &mut self.pass
            && !turning.is_searching()
            && self.exchange.awaits(moved.number)
            && own.is_between(moved.place)
        {
            turning.any |= moved.any;
            self.after = Some(moved.place);
            return self.conclude_turn(own, false, moved.worst);
        }
        Next::Stale
    }

    /// What the current turn came to is known; `worst` is the worst SIR beyond the next hop.
    pub(super) fn conclude_turn(&mut self, own: Own<'_>, moved: bool, worst: f32) -> Next {
        let (Pass::Turn(turning), Some(at), Some(interferer)) =
            (&mut self.pass, self.setpoint, own.mission.interferer())
        else {
            return Next::Stale;
        };
        let hops = turning.hops(own.mission, interferer, self.profile.power_w, self.after);
        let (incoming, outgoing) = hops.both(at);
        turning.worst = worst.min(outgoing).min(f32::MAX);
        let stop = turning.turn == Turn::Stop;
        if stop {
            self.target = Some(turning.sir);
        }
        if stop {
            self.exchange.hold();
        } else {
            self.exchange.answer();
        }
        if let Lead::Adjusting(rounds) = &mut self.lead {
            if !rounds.advance(turning.any, turning.worst.min(incoming)) {
                return Next::Work { moved };
            }
            self.lead = Lead::No;
        }
        Next::Answer {
            moved,
            agreed: stop,
        }
    }
}
