//! A hello that has come in: whether its sender hears this relay, and whether it is taken for the neighbour.

use super::state::Node;
use crate::event::About;
use crate::node::mission_update::takes_uploads;
use crate::node::neighbour::candidate::Candidate;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::Hello;

impl Node {
    /// A hello from node `from` at `side`, of the same mission.
    pub(super) fn on_hello(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.member.node;
        let known = self.layers.view.newest();
        self.layers.view.heard_of(hello.newest);
        if self.searches() {
            let heard = hello.is_heard(from, own);
            // One that asks for nothing may be the answer to what was heard just now.
            if heard || hello.ask {
                self.says_it_hears(side, from, heard);
            }
            let (distance, settings) = (from.abs_diff(own), &self.member.settings);
            let neighbour = self.layers.neighbours.at_mut(side);
            neighbour.says(distance, hello.neighbour, heard, now, settings);
        }
        if hello.ask {
            self.owe_hello(side, from, false);
        }
        if self.layers.neighbours.at(side).node() == from {
            #[cfg(feature = "upload")]
            {
                self.layers.neighbours.at_mut(side).asked = hello.nonce;
                self.layers.update.may_answer(side, now);
                if hello.refused {
                    self.hear_refused(side, hello.holds);
                } else {
                    self.compare(side, from, hello.holds);
                }
            }
            self.layers.neighbours.at_mut(side).holds = Some(hello.holds);
            if self.searches() {
                let two_way = hello.is_heard(from, own);
                // A run of lost frames does not undo what was heard before: silence has its own measure.
                let linked = self.layers.neighbours.at(side).is_mutual();
                let mutual = hello.neighbour == own && (two_way || linked);
                self.told(now, side, mutual);
            }
            let waits = self.layers.view.awaited().is_some();
            // One that holds a newer mission takes part in no view without it: it is asked for once this relay holds it, too.
            let newer = takes_uploads(&self.member)
                && !hello.refused
                && hello.holds > self.layers.update.latest();
            if hello.form && !newer && (hello.newest >= known || hello.fresh && !waits) {
                if self.layers.view.newest() > known {
                    self.layers.view.asking.ask_anew(now);
                } else {
                    self.layers.view.asking.ask(now);
                }
            }
        } else if self.searches() {
            self.consider(now, side, from, hello);
        }
        self.review(now);
    }

    /// Node `from` at `side` has said whether it hears this relay.
    pub(super) fn says_it_hears(&mut self, side: Side, from: u16, heard: bool) {
        let distance = from.abs_diff(self.member.node);
        if self
            .layers
            .neighbours
            .at_mut(side)
            .says_it_hears(distance, heard)
        {
            self.raise_about(About::NotHeard, side, from);
        }
    }

    /// A hello from node `from` at `side`, which is not taken for the neighbour there.
    ///
    /// One that does not hear this relay is none: nothing can be agreed on with it.
    fn consider(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.member.node;
        let there = self.beyond(side);
        let (layers, settings) = (&mut self.layers, &self.member.settings);
        let neighbour = layers.neighbours.at_mut(side);
        neighbour.notice(now, settings);
        // It would rather have this relay than one that is farther away.
        let farther = hello.neighbour.abs_diff(from) > own.abs_diff(from);
        let taken = hello.neighbour != own && hello.neighbour != 0 && !farther;
        if taken || !hello.is_heard(from, own) {
            return;
        }
        let pairs = hello.neighbour == own;
        // The candidate leads to all relays of the last view beyond the node taken, except that node: they have closed up without it.
        let all_but_one = hello.behind > 1 && hello.behind.checked_add(1) == Some(there);
        let candidate = Candidate {
            node: from,
            distance: from.abs_diff(own),
            downstream: from > own,
            pairs,
            nearer: from.abs_diff(own) < neighbour.node().abs_diff(own),
            ready: hello.ready,
            longer: hello.behind > there || all_but_one,
        };
        if neighbour.consider(candidate, now, settings) {
            let tells = neighbour.tells_found();
            neighbour.holds = Some(hello.holds);
            #[cfg(feature = "upload")]
            {
                neighbour.asked = hello.nonce;
                layers.update.may_answer(side, now);
                layers.update.begin_offers(side);
            }
            self.steering.link(side, Some(from));
            if tells {
                self.raise_about(About::Back, side, from);
            }
            self.owe_hello(side, from, true);
            self.told(now, side, pairs);
        }
    }

    /// The neighbour at `side` has said, one way or the other, whether it takes this relay for its own.
    pub(super) fn told(&mut self, now: Instant, side: Side, mutual: bool) {
        if !self.layers.neighbours.at_mut(side).told(mutual, now) || !mutual {
            return;
        }
        let newer = self.layers.view.newest() > self.member.view;
        if newer && !self.layers.neighbours.at(side).has_grace(now) {
            // One of the two has missed something.
            self.layers.view.asking.ask(now);
        }
        self.layers.resend();
    }
}
