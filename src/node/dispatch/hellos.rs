//! Hellos: those that a relay owes, and one that it has received: whether its sender hears this relay, and is taken for the neighbour.

use super::state::Node;
use crate::event::About;
use crate::node::mission_update::takes_uploads;
use crate::node::neighbour::hearing::CANDIDATES;
use crate::node::neighbour::state::Candidate;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::digest::MissionId;
use crate::wire::message::Hello;

/// What a hello says of a mission.
struct MissionSaid {
    holds: MissionId,
    flies: bool,
    whole: bool,
    refused: bool,
}

impl Node {
    /// Owes node `to` at `side` a hello, which may ask for one in return.
    #[inline(never)] // called from many places
    pub(super) fn owe_hello(&mut self, side: Side, to: u16, ask: bool) {
        let distance = to.abs_diff(self.member.node);
        self.layers.neighbours.at_mut(side).owe(distance, ask);
    }

    /// The next hello that is owed: at which side, to which node.
    pub(super) fn next_hello(&mut self, now: Instant) -> Option<(Side, u16, Hello)> {
        let (own, all) = (self.member.node, self.member.all);
        for side in [Side::Upstream, Side::Downstream] {
            for _ in 0..CANDIDATES {
                let Some((distance, ask)) = self.layers.neighbours.at_mut(side).take_hello() else {
                    break;
                };
                let to = match side {
                    Side::Upstream => own.saturating_sub(distance),
                    Side::Downstream => own.saturating_add(distance),
                };
                if to >= 1 && to <= all && self.side_of(to).is_some() {
                    let nonce = self.ask_number(now);
                    let ready = self.is_between(now, side, to);
                    let hello = self.hello(now, side, ask, nonce);
                    return Some((side, to, Hello { ready, ..hello }));
                }
            }
        }
        None
    }

    pub(super) fn hello(&self, now: Instant, side: Side, ask: bool, nonce: u16) -> Hello {
        let said = self.says_of_mission();
        Hello {
            mission: self.member.digest,
            newest: self.layers.view.newest(),
            neighbour: self.layers.neighbours.at(side).node(),
            ask,
            form: self.layers.view.asking.asks() && side == self.back(),
            fresh: self.layers.round.is_fresh(),
            ready: false,
            // Who has just been switched on is in no part yet.
            behind: if self.layers.round.is_fresh() {
                1
            } else {
                self.beyond(side.other()).saturating_add(1)
            },
            hears: self
                .layers
                .neighbours
                .at(side)
                .hears(now, &self.member.settings),
            holds: said.holds,
            flies: said.flies,
            whole: said.whole,
            refused: said.refused,
            nonce,
        }
    }

    /// What a hello says of the mission: of the one that is held, or of a newer one that this relay has refused.
    fn says_of_mission(&self) -> MissionSaid {
        let (active, latest) = (self.member.active, self.layers.update.latest());
        #[cfg(feature = "upload")]
        if let Some(refused) = self.layers.update.refused_of(active) {
            return MissionSaid {
                holds: refused,
                flies: false,
                whole: false,
                refused: true,
            };
        }
        let flies = active == latest;
        #[cfg(feature = "upload")]
        let whole = flies && latest.version > 0 && self.layers.lease.is_whole();
        #[cfg(not(feature = "upload"))]
        let whole = false;
        MissionSaid {
            holds: latest,
            flies,
            whole,
            refused: false,
        }
    }

    /// Whether this relay could come between node `other` at `side` and the one that it takes there: whether that one and this relay hear
    /// each other, or there is a neighbour that comes along with it.
    fn is_between(&self, now: Instant, side: Side, other: u16) -> bool {
        let own = self.member.node;
        let beyond = self
            .layers
            .neighbours
            .at(side)
            .taken_by(other.abs_diff(own));
        let there = match side {
            Side::Upstream => beyond > own,
            Side::Downstream => beyond != 0 && beyond < own,
        };
        let settings = &self.member.settings;
        let far = self.layers.neighbours.at(side.other());
        let distance = beyond.abs_diff(own);
        // Of two links that cross the one that ends nearest to Rx is given up.
        let crosses = side == Side::Downstream && far.goes_past(distance);
        there && (far.is_two_way(distance, now, settings) || far.comes_along(distance) || crosses)
    }

    /// How many relays there are on that side in the part of the chain that this relay is in, as it was counted last.
    pub(super) fn beyond(&self, side: Side) -> u16 {
        if self.layers.neighbours.at(side).has_no_peer() {
            return 0;
        }
        let (place, all) = self
            .layers
            .view
            .counted()
            .unwrap_or_else(|| self.member.place_in_all());
        if side == self.back() {
            place.saturating_sub(1)
        } else {
            all.saturating_sub(place)
        }
    }

    /// The number of a hello that is said now, for the offer that answers it; 0 where none is taken.
    #[cfg(feature = "upload")]
    pub(super) fn ask_number(&mut self, now: Instant) -> u16 {
        if takes_uploads(&self.member) {
            self.layers.update.ask(now, &self.member.settings)
        } else {
            0
        }
    }

    #[cfg(not(feature = "upload"))]
    #[expect(clippy::unused_self, reason = "as the other one")]
    pub(super) const fn ask_number(&mut self, _: Instant) -> u16 {
        0
    }
}

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
