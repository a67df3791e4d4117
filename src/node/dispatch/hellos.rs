//! Pending hellos, received hellos, and the selection of the neighbours.

use super::Node;
use crate::event::NodeEvent;
use crate::features::{DEPARTURES, UPLOAD};
use crate::guard::Guard;
use crate::node::mission_update::accepts_uploads;
use crate::node::neighbour::hearing::CANDIDATES;
use crate::node::neighbour::state::Candidate;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::digest::MissionId;
use crate::wire::message::Hello;

/// Mission fields of a hello: the newest mission that this relay has stored, and three flags.
///
/// The flags state whether the mission is active at this relay, whether it is known to be active at all relays of the
/// view, and whether it was refused.
struct MissionState {
    latest: MissionId,
    is_active: bool,
    is_active_in_view: bool,
    is_refused: bool,
}

impl Node {
    /// Schedules a hello to node `to` at `side`. If `ask` is true, the hello requests a hello in return.
    #[inline(never)] // called from many places
    pub(super) fn schedule_hello(&mut self, side: Side, to: u16, ask: bool) {
        let distance = to.abs_diff(self.member.node);
        self.layers
            .neighbours
            .at_mut(side)
            .schedule_hello(distance, ask);
    }

    /// Returns the next pending hello with its side and destination node; `None` if none is pending.
    pub(super) fn next_hello(&mut self, now: Instant) -> Option<(Side, u16, Hello)> {
        for side in [Side::Upstream, Side::Downstream] {
            for _ in 0..CANDIDATES {
                let Some((distance, ask)) = self.layers.neighbours.at_mut(side).poll_hello() else {
                    break;
                };
                let to = self.member.beyond(side, distance);
                if self.member.is_relay(to) && self.side_of(to).is_some() {
                    let offer_number = self.layers.update.next_hello_nonce(now, &self.member);
                    let mut hello = self.hello(now, side, ask, offer_number);
                    if hello.outside {
                        hello.ready = self.layers.leaving.is_spare();
                    } else {
                        hello.ready =
                            self.is_between(now, side, to) || self.calls_to_join(side, to);
                        hello.outside = self.may_fly_away(side, to);
                        if hello.outside {
                            self.on_freed(side, to);
                        }
                    }
                    return Some((side, to, hello));
                }
            }
        }
        None
    }

    pub(super) fn hello(&self, now: Instant, side: Side, ask: bool, offer_number: u16) -> Hello {
        let state = self.mission_state();
        Hello {
            mission: self.member.digest,
            latest_view: self.layers.view.latest_view(),
            neighbour: self.layers.neighbours.at(side).node(),
            requests_reply: ask,
            requests_view: self.layers.view.request.is_pending() && side == self.back(),
            fresh: self.layers.round.is_idle() || self.layers.leaving.is_outside(),
            ready: false,
            behind: self.relays_through(side.other()),
            hears: self
                .layers
                .neighbours
                .at(side)
                .received_nodes(now, &self.member.settings),
            latest_mission: state.latest,
            active: state.is_active,
            active_in_view: state.is_active_in_view,
            refused: state.is_refused,
            outside: self.layers.leaving.is_outside(),
            offer_number,
        }
    }

    /// Returns the mission fields of a hello, for the stored mission or for a newer one that was refused.
    fn mission_state(&self) -> MissionState {
        let (active, latest) = (self.member.active, self.layers.update.latest());
        if let Some(refused) = self.layers.update.refused_mission(active) {
            return MissionState {
                latest: refused,
                is_active: false,
                is_active_in_view: false,
                is_refused: true,
            };
        }
        let flies = active == latest;
        let whole = UPLOAD && flies && latest.version > 0 && self.layers.lease.is_whole();
        MissionState {
            latest,
            is_active: flies,
            is_active_in_view: whole,
            is_refused: false,
        }
    }

    /// Returns true if this relay fits between node `other` at `side` and the neighbour B of `other`.
    ///
    /// B must be on the opposite side of this relay. In addition, one of three conditions must hold: this relay and B
    /// receive each other; this relay is linked to a node nearer than B; or this relay's link crosses the link from
    /// `other` to B.
    fn is_between(&self, now: Instant, side: Side, other: u16) -> bool {
        let own = self.member.node;
        let beyond = self
            .layers
            .neighbours
            .at(side)
            .selected_by(other.abs_diff(own));
        let fits = match side {
            Side::Upstream => beyond > own,
            Side::Downstream => beyond != 0 && beyond < own,
        };
        let settings = &self.member.settings;
        let far = self.layers.neighbours.at(side.other());
        let distance = beyond.abs_diff(own);
        // If two links cross, the link that ends nearer to Rx is replaced.
        let crosses = side == Side::Downstream && far.has_link_beyond(distance);
        fits && (far.is_two_way(distance, now, settings) || far.links_within(distance) || crosses)
    }

    /// Returns the number of relays that a node on one side of this relay can reach through it. They are this relay,
    /// and all relays on the other side, `far`.
    fn relays_through(&self, far: Side) -> u16 {
        // A relay that has just started belongs to no part of the chain. A relay that the view leaves out still has its
        // count from the view before, although no neighbour selects it.
        if self.layers.round.is_idle() || !self.layers.neighbours.at(far).is_mutual() {
            1
        } else {
            self.relays_on(far).saturating_add(1)
        }
    }

    /// Returns the number of relays on `side`, according to the last view proposal.
    pub(super) fn relays_on(&self, side: Side) -> u16 {
        if self.layers.neighbours.at(side).has_no_peer() {
            return 0;
        }
        let (place, all) = self
            .layers
            .view
            .rank_and_count()
            .unwrap_or_else(|| self.member.rank_in_all());
        if side == self.back() {
            place.saturating_sub(1)
        } else {
            all.saturating_sub(place)
        }
    }
}

impl Node {
    /// Handles a hello from node `from` at `side`. The node has loaded the same mission before flight.
    pub(super) fn on_hello(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.member.node;
        let known = self.layers.view.latest_view();
        self.layers.view.observe_view(hello.latest_view);
        if self.searches() {
            let heard = hello.is_heard(from, own);
            // A hello that requests no reply may itself be the reply to a hello that was just sent.
            if heard || hello.requests_reply {
                self.record_reception(side, from, heard);
            }
            let (distance, settings) = (from.abs_diff(own), &self.member.settings);
            let neighbour = self.layers.neighbours.at_mut(side);
            neighbour.record_hello(distance, hello.neighbour, heard, now, settings);
        }
        if hello.requests_reply {
            self.schedule_hello(side, from, false);
        }
        if self.handle_outside_hello(now, side, from, &hello) {
            return self.review_neighbours(now);
        }
        if self.layers.neighbours.at(side).node() == from {
            self.layers
                .update
                .record_neighbour_nonce(side, hello.offer_number, now);
            if hello.refused {
                self.on_refused(side, hello.latest_mission);
            } else {
                self.compare_missions(side, from, hello.latest_mission);
            }
            self.layers.neighbours.at_mut(side).latest_mission = Some(hello.latest_mission);
            if self.searches() {
                let two_way = hello.is_heard(from, own);
                // A few lost frames do not end a link. The neighbour's silence has its own timer.
                let linked = self.layers.neighbours.at(side).is_mutual();
                let mutual = hello.neighbour == own && (two_way || linked);
                self.on_mutual(now, side, mutual);
            }
            let waits = self.layers.view.outstanding().is_some();
            // A neighbour with a newer mission joins only a view with that mission. So this relay requests a view once
            // it has the mission.
            let newer = accepts_uploads(&self.member)
                && !hello.refused
                && hello.latest_mission > self.layers.update.latest();
            if hello.requests_view
                && !newer
                && (hello.latest_view >= known || hello.fresh && !waits)
            {
                if self.layers.view.latest_view() > known {
                    self.layers.view.request.request_now(now);
                } else {
                    self.layers.view.request.start(now);
                }
            }
        } else if self.searches() {
            self.consider_candidate(now, side, from, hello);
        }
        self.review_neighbours(now);
    }

    /// Records whether node `from` receives this relay (`heard`). After several consecutive reports that it does not,
    /// the node is reported to the firmware.
    pub(super) fn record_reception(&mut self, side: Side, from: u16, heard: bool) {
        let distance = from.abs_diff(self.member.node);
        if self
            .layers
            .neighbours
            .at_mut(side)
            .record_reception(distance, heard)
        {
            self.raise_node_event(NodeEvent::NotHeard, side, from);
        }
    }

    /// Selects node `from` as the neighbour on `side` if the side has none, or if the node is better. A node is better
    /// if it is nearer, or if more relays can be reached through it. A node that does not receive this relay is not
    /// selected.
    fn consider_candidate(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.member.node;
        let there = self.relays_on(side);
        let leavers = self.layers.lease.orders().leavers;
        let is_leaver = |node: u16| DEPARTURES && node != 0 && leavers.contains(&node);
        let (layers, settings) = (&mut self.layers, &self.member.settings);
        let neighbour = layers.neighbours.at_mut(side);
        neighbour.record_unselected(now, settings);
        // The candidate's neighbour is farther away than this relay, so the candidate would prefer this relay.
        let farther = hello.neighbour.abs_diff(from) > own.abs_diff(from);
        let before = neighbour.node();
        // The node beyond a neighbour that is ordered to leave, once that one has received the fence beside it.
        let passes = is_leaver(before)
            && [own, before].contains(&hello.neighbour)
            && (side == Side::Upstream
                || self.steering.known_guard().is_none_or(Guard::is_answered));
        let taken = hello.neighbour != own && hello.neighbour != 0 && !farther && !passes;
        // A neighbour that this relay has passed asks for a hello until it knows: it is not selected again.
        if taken || is_leaver(from) || !hello.is_heard(from, own) {
            return;
        }
        let pairs = hello.neighbour == own;
        // The candidate reaches all relays beyond the current neighbour except one. So the other relays have a link
        // that skips that one.
        let all_but_one = hello.behind > 1 && hello.behind.checked_add(1) == Some(there);
        let candidate = Candidate {
            node: from,
            distance: from.abs_diff(own),
            downstream: from > own,
            pairs,
            nearer: from.abs_diff(own) < neighbour.node().abs_diff(own),
            ready: hello.ready,
            longer: hello.behind > there || all_but_one,
            passes,
        };
        if neighbour.consider_candidate(candidate, now, settings) {
            let tells = neighbour.should_report_found() && !passes;
            neighbour.latest_mission = Some(hello.latest_mission);
            layers
                .update
                .record_neighbour_nonce(side, hello.offer_number, now);
            layers.update.reset_offers(side);
            self.steering.set_neighbour(side, Some(from));
            if tells {
                self.raise_node_event(NodeEvent::Back, side, from);
            }
            self.schedule_hello(side, from, true);
            if passes {
                self.schedule_hello(side, before, false);
            }
            self.on_mutual(now, side, pairs);
        }
    }

    /// Records whether the neighbour at `side` has selected this relay (`mutual`). If it has just selected this relay,
    /// unanswered messages are retransmitted.
    pub(super) fn on_mutual(&mut self, now: Instant, side: Side, mutual: bool) {
        if !self.layers.neighbours.at_mut(side).set_mutual(mutual, now) || !mutual {
            return;
        }
        let newer = self.layers.view.latest_view() > self.member.view;
        if newer && !self.layers.neighbours.at(side).has_grace(now) {
            // One of the two relays has missed a view change.
            self.layers.view.request.start(now);
        }
        self.layers.resend();
    }
}
