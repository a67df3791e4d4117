//! The gathering of the joint method: where relays bring along what the mission does not say, everybody comes to know it from all.
//!
//! A pass has room for a few relays. Each that differs adds itself while there is room, and what came of the pass tells all of them. Where
//! a roster is full, the next pass goes on after the last relay in it.

use super::computation::{Computation, PassKind};
use super::seats::Seats;
use super::state::Action;
use crate::node::context::Context;
use crate::optimiser::joint::Seat;
use crate::wire::message::{OwnSeat, OwnSeats, Roster};

impl Computation {
    /// What this relay brings along.
    pub(super) fn seat(&self, context: &Context<'_>) -> Seat {
        let holds = context.settings().hold_altitude;
        Seat::of(context.mission(), self.profile, holds)
    }

    /// Whether that is something else than the mission says of all.
    pub(super) fn differs(&self, context: &Context<'_>) -> bool {
        self.seat(context) != Seat::common(context.mission())
    }

    /// Whether this relay leads, and its next pass is to gather what relays bring along: one differs, and not all of it is known.
    pub(super) fn gathers(&self, context: &Context<'_>) -> bool {
        let told = matches!(&self.pass, PassKind::Sweep(sweeping) if sweeping.own);
        let leads = context.index() == context.mission().leader();
        leads
            && context.joins()
            && match self.seats.known {
                None => told || self.differs(context),
                Some(known) => known < context.mission().relays(),
            }
    }

    /// The leader begins such a pass.
    pub(super) fn begin_gathering(&mut self, context: &Context<'_>) -> Action {
        let after = self.seats.known.unwrap_or(0);
        self.gather(context, after, OwnSeats::new())
    }

    /// One from the relay before.
    pub(crate) fn on_gather(&mut self, context: &Context<'_>, roster: &Roster) -> Action {
        let own = context.index();
        let same = matches!(&self.pass, PassKind::Gather(known) if known.after == roster.after
            && known.seats.iter().take_while(|seat| seat.index < own).eq(&roster.seats));
        let arrival = self.state.arrival(roster.number, same);
        if let Some(next) = arrival.refused(self.state) {
            return next;
        }
        let before = roster.seats.last().is_none_or(|seat| seat.index < own);
        if context.mission().interferer().is_none() || !before {
            return Action::Stale;
        }
        if roster.after > 0 && self.seats.known != Some(roster.after) {
            // It was not there when the relays before that were named.
            return Action::Foreign;
        }
        self.state.take(roster.number);
        self.gather(context, roster.after, roster.seats.clone())
    }

    fn gather(&mut self, context: &Context<'_>, after: u16, mut seats: OwnSeats) -> Action {
        let index = context.index();
        if after == 0 {
            // Till the answer comes nothing is known, whatever was before.
            self.seats = Seats::UNKNOWN;
            self.seats.known = Some(0);
        }
        if index > after && self.differs(context) {
            let holds = context.settings().hold_altitude;
            // Where there is no room, the next pass asks again.
            _ = seats.push(OwnSeat {
                index,
                held_m: if holds { self.profile.altitude_m } else { 0.0 },
                power_w: self.profile.power_w,
            });
        }
        self.pass = PassKind::Gather(Roster {
            number: self.state.number(),
            mission: context.digest(),
            after,
            seats,
        });
        self.state.wait();
        if context.is_last() {
            return self.conclude_gathering(context);
        }
        Action::Forward
    }

    /// What came of it, from the relay after.
    pub(crate) fn on_gathered(&mut self, context: &Context<'_>, roster: &Roster) -> Action {
        let relays = context.mission().relays();
        if let PassKind::Gather(known) = &mut self.pass
            && self.state.awaits(roster.number)
            && roster.after == known.after
            && roster.seats.starts_with(&known.seats)
            && roster.seats.last().is_none_or(|seat| seat.index <= relays)
        {
            known.seats.clone_from(&roster.seats);
            return self.conclude_gathering(context);
        }
        Action::Stale
    }

    fn conclude_gathering(&mut self, context: &Context<'_>) -> Action {
        let PassKind::Gather(roster) = &self.pass else {
            return Action::Stale;
        };
        self.state.answer();
        if self.seats.take(roster, context.mission().relays()) {
            // The chain is solved anew, as it is.
            self.task.rest();
            self.chosen = None;
        }
        if context.index() == context.mission().leader() {
            return Action::Work;
        }
        Action::Answer { agreed: false }
    }
}
