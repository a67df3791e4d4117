//! Another node under this relay's number: who stands down, and what it says meanwhile.

use super::state::Node;
use crate::event::{About, Event};
use crate::node::namesake::{Claim, Twice};
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::{Hello, Message};

impl Node {
    /// A frame under this relay's own number, from another node.
    pub(crate) fn hear_namesake(&mut self, now: Instant, claim: Claim) {
        let settings = self.member.settings;
        if self.namesake.is_news(now, Twice::Own, &settings) {
            let node = self.member.node;
            self.raise_about(About::Index, Side::Upstream, node);
        }
        let tenure = self.layers.lease.tenure(now, &settings);
        let placed = self.setpoint().is_some();
        if self.namesake.hear(now, claim, tenure, &settings) {
            self.stood_down(placed);
        }
    }

    fn stood_down(&mut self, placed: bool) {
        self.layers.lease.give_way();
        if placed {
            self.raise(Event::SetpointChanged);
        }
    }

    /// Whether it stands down from now on, as it is not settled and another node of its number takes part.
    pub(super) fn gives_way(&mut self, now: Instant) -> bool {
        let settings = &self.member.settings;
        let tenure = self.layers.lease.tenure(now, settings);
        let placed = self.setpoint().is_some();
        let down = self.namesake.review(now, tenure, settings);
        if down {
            self.stood_down(placed);
        }
        down
    }

    /// What it says to its own number: while it stands down as one that has taken part in nothing, else that the number is taken.
    pub(super) fn next_to_namesake(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        if !self.namesake.take_hello() {
            return None;
        }
        let hello = Hello {
            fresh: self.stands_down(),
            form: false,
            ..self.hello(now, Side::Upstream, false, 0)
        };
        Some((Side::Upstream, self.member.node, Message::Hello(hello)))
    }

    /// Whether it takes part in nothing, because another relay has its number.
    pub(crate) const fn stands_down(&self) -> bool {
        self.namesake.stands_down()
    }

    /// The other relay with this number is gone.
    pub(crate) fn clear_namesake(&mut self, now: Instant) {
        if self.namesake.clear() {
            self.stand_up(now);
        }
    }

    /// It takes part again: in nothing that goes on without it.
    pub(super) fn stand_up(&mut self, now: Instant) {
        if self.setpoint().is_some() {
            self.raise(Event::SetpointChanged);
        }
        if !self.layers.round.is_fresh() {
            self.layers.view.asking.ask(now);
        }
    }
}
