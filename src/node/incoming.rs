//! What a message does: who it is from, which mission and view it is of, and then the relay's share.

use super::exchange::{Next, Phase};
use super::members::Members;
use super::share::{ADJUST, ALTITUDE};
use super::timers::Timer;
use super::{GUARD, MEMBERSHIP, Node};
use crate::event::Event;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::message::Message;

/// A pass whose digest is so many views off is of the same mission.
const VIEWS: u16 = 64;

impl Node {
    /// Node `from` at `side` has made itself known, for the first time if `first`: then what waits for an answer from there is
    /// said again.
    #[cfg(feature = "auth")]
    pub(crate) fn meet(&mut self, now: Instant, side: Side, from: u16, first: bool) {
        #[cfg(feature = "upload")]
        if self.ground_side(from).is_some() {
            return;
        }
        if self.beside(side).node() != from {
            if first {
                // What was to be said to it before could not be read there.
                self.owe_hello(side, from, true);
            }
            return;
        }
        self.hear(now, side);
        if first
            && side == Side::onward(self.mission.heading())
            && self.share.phase() == Phase::Waiting
        {
            self.onward_due = true;
        }
    }

    /// A message from node `from` at `side`, intact and addressed to this relay; whether it was one to say to this relay.
    /// Bounded by 16 reaches.
    #[inline(never)]
    pub(crate) fn handle_message(
        &mut self,
        now: Instant,
        side: Side,
        from: u16,
        message: &Message,
    ) -> bool {
        #[cfg(feature = "upload")]
        if self.ground_side(from).is_some() {
            return self.on_ground(now, side, message);
        }
        let taken = self.beside(side).node() == from;
        if taken {
            self.hear(now, side);
        }
        if MEMBERSHIP && let Message::Hello(hello) = message {
            if self.is_of_mission(side, hello.mission) {
                self.on_hello(now, side, from, *hello);
                self.steer(now);
            }
            return true;
        }
        #[cfg(feature = "upload")]
        if let Message::Offer(upload) = message
            && !taken
            && self.takes_uploads()
        {
            // It takes this relay for its neighbour: a hello alone would only make it say the same again.
            if self.is_of_mission(side, upload.base()) {
                self.on_offer(now, side, from, upload);
            }
            return true;
        }
        if !taken {
            self.owe_hello(side, from, false);
            return false;
        }
        if self.seeks() {
            // Nobody says anything else to a node that it has not taken.
            self.told(now, side, true);
        }
        if !self.is_of_this_view(now, side, from, message) {
            return true;
        }
        self.handle(now, side, message);
        self.steer(now);
        true
    }

    /// Whether `message` from the neighbour `from` is of the mission and, if it is of one, of the view that this relay is in.
    /// What is not is counted, and answered by a hello if the two may have to come to one view.
    fn is_of_this_view(&mut self, now: Instant, side: Side, from: u16, message: &Message) -> bool {
        let Some(told) = message.mission() else {
            return true;
        };
        let Members { flown, held, .. } = self.members;
        let calls = message.is_of_a_call();
        if !calls && !message.is_of_a_view() {
            return self.is_of_mission(side, told);
        }
        let known = match message {
            Message::Proposal(proposal) => proposal.mission_id == held,
            Message::Decision(count) => count.mission_id == held || count.mission_id == flown,
            _ => told == self.members.pass_digest(),
        };
        if known {
            return true;
        }
        let off = told.wrapping_sub(self.members.pass_digest());
        let near = !calls && off.min(off.wrapping_neg()) <= VIEWS;
        // It was loaded with the same mission, so it flies an older or a newer one.
        let kin = self.takes_uploads() && self.beside(side).holds.is_some();
        if !(MEMBERSHIP && (near || kin)) {
            self.refuse_mission(side);
            if self.takes_uploads() {
                self.owe_hello(side, from, false);
            }
            return false;
        }
        bump(&mut self.stats.view);
        if near && message.is_onward() {
            self.call(now);
        }
        self.owe_hello(side, from, false);
        false
    }

    fn is_of_mission(&mut self, side: Side, digest: u16) -> bool {
        let same = digest == self.members.digest;
        if !same {
            self.refuse_mission(side);
        }
        same
    }

    pub(super) fn refuse_mission(&mut self, side: Side) {
        bump(&mut self.stats.mission);
        self.pending.raise(Event::MissionMismatch(side));
    }

    /// A sign of life from the neighbour at `side`.
    pub(crate) fn hear(&mut self, now: Instant, side: Side) {
        let quiet = self.settings.quiet;
        let beside = self.beside(side);
        let back = beside.heard(now);
        if beside.is_mutual() {
            self.timers.set(Timer::of(side), now + quiet);
        }
        if back {
            self.pending.raise(Event::NeighbourBack(side));
        }
    }

    /// A message of this mission, and of this view if it is of one, from the neighbour at `side`.
    fn handle(&mut self, now: Instant, side: Side, message: &Message) {
        if let Message::Heartbeat { answer, .. } = message {
            self.beside(side).signs.answer |= *answer;
            return;
        }
        if GUARD && let Message::Fence { fence, .. } = message {
            let from = self.beside(side).node();
            if let Some(guard) = &mut self.guard {
                guard.hear(side, from, fence);
            }
            return;
        }
        #[cfg(feature = "upload")]
        if let Message::Offer(upload) = message {
            let from = self.beside(side).node();
            return self.on_offer(now, side, from, upload);
        }
        if message.is_of_a_view() && !self.beside(side).is_agreed() {
            // It has not been counted with this relay yet.
            bump(&mut self.stats.stale);
            return;
        }
        let heading = self.mission.heading();
        let wanted = if message.is_onward() {
            Side::back(heading)
        } else {
            Side::onward(heading)
        };
        if side != wanted {
            bump(&mut self.stats.misdirected);
            return;
        }
        let all = self.members.all;
        let (share, own) = self.parts();
        let next = match message {
            Message::Sweep(sweep) => share.on_sweep(own, sweep),
            Message::Verdict(answer) => share.on_verdict(own, answer),
            Message::Course(course) if ALTITUDE => share.on_course(own, course),
            Message::Worth(worth) if ALTITUDE => share.on_worth(own, worth),
            Message::Token(token) if ADJUST => share.on_token(own, token),
            Message::Moved(moved) if ADJUST => share.on_moved(own, moved),
            // A chain has no more relays than its mission.
            Message::Proposal(proposal) if MEMBERSHIP && proposal.place >= all => Next::Stale,
            Message::Decision(count) if MEMBERSHIP && count.relays.is_some_and(|n| n > all) => {
                Next::Stale
            }
            Message::Proposal(proposal) if MEMBERSHIP => {
                self.members.heard_of(proposal.view);
                self.beside(side).called(false);
                let (share, own) = self.parts();
                let next = share.on_proposal(own, proposal);
                if next == Next::Foreign {
                    // Whoever calls has to take a higher number.
                    self.members.heard_of(self.members.newest.saturating_add(1));
                }
                next
            }
            Message::Decision(count) if MEMBERSHIP => share.on_decision(own, count),
            Message::Busy { sweep } => {
                if self.share.phase() == Phase::Waiting && *sweep == self.share.number() {
                    // It has arrived: what is missing is the answer, and that may take its time.
                    self.repeats.heard();
                    let patience = self.patience();
                    self.timers.set(Timer::Repeat, now + patience);
                }
                return;
            }
            _ => return,
        };
        self.proceed(now, next);
    }
}
