//! A message that has come in: whether it is one to say to this relay, and to which layer.

use super::state::Node;
use crate::event::About;
use crate::node::context::Effects;
#[cfg(feature = "upload")]
use crate::node::mission_update::takes_uploads;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::message::Message;

impl Node {
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
        if let Message::Claim(claim) = message {
            return self.on_claim(now, side, from, *claim);
        }
        if self.is_passive() {
            return false;
        }
        #[cfg(feature = "upload")]
        if self.ground_side(from).is_some() {
            return self.on_ground(now, side, from, message);
        }
        #[cfg(feature = "upload")]
        if let Message::Level { .. } = message {
            // The ground alone says that.
            return false;
        }
        let taken = self.layers.neighbours.at(side).node() == from;
        let distance = from.abs_diff(self.member.node);
        let neighbour = self.layers.neighbours.at_mut(side);
        neighbour.heard(distance, taken, now, &self.member.settings);
        if let Message::Hello(hello) = message {
            if self.is_of_mission(now, side, from, hello.mission) {
                self.on_hello(now, side, from, *hello);
                self.steer(now);
            }
            return true;
        }
        #[cfg(feature = "upload")]
        if let Message::Offer { upload, answer } = message
            && !taken
            && takes_uploads(&self.member)
        {
            // It takes this relay for its neighbour: a hello alone would only make it say the same again.
            if self.is_of_mission(now, side, from, upload.base()) {
                self.on_offer(now, side, from, upload, *answer);
            }
            return true;
        }
        if !taken {
            self.owe_hello(side, from, false);
            return false;
        }
        if self.searches() {
            // Nobody says anything else to a node that it has not taken.
            self.told(now, side, true);
        }
        if !self.is_of_this_view(now, side, from, message) {
            return true;
        }
        self.dispatch(now, side, from, message);
        self.steer(now);
        true
    }

    /// Whether `message` from the neighbour `from` is of the mission and, if it is of one, of the view that this relay is in.
    /// What is not is counted and answered by a hello, and a pass of another view has the relay ask for one.
    fn is_of_this_view(&mut self, now: Instant, side: Side, from: u16, message: &Message) -> bool {
        let Some(digest) = message.mission() else {
            return true;
        };
        let (active, latest) = (self.member.active, self.layers.update.latest());
        let proposes = message.is_of_a_proposal();
        #[cfg(feature = "upload")]
        if let Message::Fence { .. } = message {
            return self.is_of_line(now, side, from, digest);
        }
        if !proposes && !message.is_of_a_view() {
            return self.is_of_mission(now, side, from, digest);
        }
        let known = match message {
            Message::Proposal(proposal) => proposal.mission_id == latest,
            Message::Decision(decision) => [active, latest].contains(&decision.mission_id),
            _ => digest == self.member.pass_digest(),
        };
        if !known {
            // What it flies, and in which view, it says in a hello.
            bump(&mut self.telemetry.stats.view);
            self.owe_hello(side, from, true);
            // It has said that it is of this mission: then the two are in different views.
            let of_mission = self.layers.neighbours.at(side).holds.is_some();
            if of_mission && message.is_of_a_view() && message.is_onward() {
                self.layers.view.asking.ask(now);
            }
        }
        known
    }

    /// Whether a place that `from` tells is along the line of this relay. It is not while one of the two flies an upload with other sites.
    #[cfg(feature = "upload")]
    fn is_of_line(&mut self, now: Instant, side: Side, from: u16, digest: u16) -> bool {
        let same = digest == self.member.line();
        if !same && self.layers.neighbours.at(side).holds.is_some() {
            bump(&mut self.telemetry.stats.stale);
        } else if !same {
            self.refuse_mission(now, side, from);
        }
        same
    }

    fn is_of_mission(&mut self, now: Instant, side: Side, from: u16, digest: u16) -> bool {
        let same = digest == self.member.digest;
        if !same {
            self.refuse_mission(now, side, from);
        }
        same
    }

    pub(super) fn refuse_mission(&mut self, now: Instant, side: Side, from: u16) {
        bump(&mut self.telemetry.stats.mission);
        let distance = from.abs_diff(self.member.node);
        let neighbour = self.layers.neighbours.at_mut(side);
        if neighbour.is_stranger(distance, now) {
            self.raise_about(About::Mission, side, from);
        }
    }

    /// A message of this mission, and of this view if it is of one, from the neighbour `from` at `side`.
    fn dispatch(&mut self, now: Instant, side: Side, from: u16, message: &Message) {
        match message {
            Message::Heartbeat { ask, answer, .. } => {
                let neighbour = self.layers.neighbours.at_mut(side);
                neighbour.asked(*ask);
                if let Some(at) = neighbour.answered(*answer) {
                    self.confirm(now, side, at);
                }
                return;
            }
            Message::Fence { fence, .. } => {
                let effects = self.steering.handle(side, from, fence);
                return self.apply(now, effects);
            }
            #[cfg(feature = "upload")]
            Message::Offer { upload, answer } => {
                return self.on_offer(now, side, from, upload, *answer);
            }
            _ => {}
        }
        if message.is_of_a_view() && !self.layers.neighbours.at(side).is_agreed() {
            // It is in no view with this relay yet.
            return bump(&mut self.telemetry.stats.stale);
        }
        let wanted = if message.is_onward() {
            self.back()
        } else {
            self.onward()
        };
        if side != wanted {
            return bump(&mut self.telemetry.stats.misdirected);
        }
        let context = self.layers.context(now, &self.member);
        let layers = &mut self.layers;
        let effects = match message {
            Message::Proposal(_) | Message::Decision(_) => layers.view.handle(&context, message),
            Message::Busy { sweep } if layers.view.on_busy(&context, *sweep) => Effects::NONE,
            // No pass goes on while a view is proposed.
            _ if layers.view.awaited().is_some() => Effects::STALE,
            _ => {
                if message.is_of_a_view() && message.is_onward() {
                    // What was agreed on in the view has come: all have accepted it.
                    layers.view.commit(self.member.view);
                    layers.lease.commit();
                }
                if let Message::Pulse(_) | Message::Pulsed(_) = message {
                    layers.lease.handle(&context, message)
                } else {
                    layers.round.handle(&context, message)
                }
            }
        };
        self.apply(now, effects);
    }

    /// The neighbour at `side` was there `at` that time or later: it has answered what this relay said then.
    pub(super) fn confirm(&mut self, now: Instant, side: Side, at: Instant) {
        let neighbour = self.layers.neighbours.at_mut(side);
        if neighbour.confirmed(now, at) {
            let node = neighbour.node();
            self.raise_about(About::Back, side, node);
        }
    }
}
