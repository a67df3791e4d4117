//! Expired timers of all layers: silent neighbours, view requests, wait for the first message.

use super::Node;
use crate::event::NodeEvent;
use crate::node::context::first_pass;
use crate::node::neighbour::liveness::patient_tick;
use crate::settings::Wiring;
use crate::side::Side;
use crate::time::Instant;

impl Node {
    /// Handles the expired timers of all protocol layers. Work: at most one step of a long computation.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        if self.duplicate.handle_timeout(now, &self.member.settings) {
            self.become_active(now);
        }
        if self.is_passive() {
            return;
        }
        let solved = self.is_solving(now);
        let context = self.layers.context(now, &self.member);
        let effects = self.layers.round.handle_timeout(&context);
        self.apply(now, effects);
        self.layers.update_requests(now, &self.member);
        let context = self.layers.context(now, &self.member);
        let effects = self.layers.lease.handle_timeout(&context);
        self.apply(now, effects);
        if solved && !self.is_solving(now) {
            self.on_solved(now);
        }
        self.drop_links_if_expired(now);
        self.return_if_expired(now);
        self.repeat_orders(now);
        for side in [Side::Upstream, Side::Downstream] {
            if self.layers.neighbours.at(side).is_due(now) {
                self.on_neighbour_timeout(now, side);
            }
        }
        if self.layers.leaving.is_outside() {
            // A relay outside of the chain has no vote. An upload or the end of a computation must not make it propose
            // a view.
            self.layers.view.request.stop();
        } else if self.awaits_first() && self.is_solving(now) {
            if self.layers.view.request.is_due(now) {
                self.await_first(now);
            }
        } else {
            let is_first = self.layers.neighbours.at(self.back()).has_no_peer();
            let fresh = self.layers.round.is_idle();
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.view.handle_timeout(&context, is_first, fresh);
            self.apply(now, effects);
        }
        self.layers.update.handle_timeout(now);
        self.steering
            .handle_timeout(now, self.member.settings.hop_time);
        self.reporting.handle_timeout(now);
        self.steer(now);
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        if self.is_passive() {
            return self.duplicate.next_timeout();
        }
        [
            self.duplicate.next_timeout(),
            self.layers.neighbours.next_timeout(),
            self.layers.view.next_timeout(),
            self.layers.lease.next_timeout(),
            self.layers.round.next_timeout(),
            self.steering.next_timeout(),
            self.no_quorum_timer.next_timeout(),
            self.layers.leaving.next_timeout(),
            self.layers.update.next_timeout(),
            self.reporting.next_timeout(self.telemetry_waits()),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    fn on_neighbour_timeout(&mut self, now: Instant, side: Side) {
        let (solving, searches) = (self.is_solving(now), self.searches());
        let (layers, settings) = (&mut self.layers, &self.member.settings);
        let neighbour = layers.neighbours.at_mut(side);
        if layers.leaving.is_outside() {
            // On a channel that loses frames, only frequent hellos keep the members informed of this relay.
            neighbour.record_unselected(now, settings);
        }
        if solving && neighbour.excuse_silence(now, settings) {
            return;
        }
        let node = neighbour.node();
        let ended = neighbour.has_no_peer();
        let dead = layers.lease.silence_until_lost(settings);
        // Before the first lease many relays may search on the channel at the same time.
        let is_crowded = settings.wiring == Wiring::Shared && layers.lease.is_pending();
        let asking = is_crowded.then(|| patient_tick(settings, self.member.all));
        let lost = neighbour.handle_timeout(now, settings, dead, searches, asking);
        let ends = neighbour.has_no_peer() && !ended;
        self.steering
            .set_neighbour(side, Some(neighbour.node()).filter(|node| *node != 0));
        if lost {
            self.raise_node_event(NodeEvent::Lost, side, node);
        }
        if ends {
            self.layers.view.request.repeat_now(now);
        }
        self.review_neighbours(now);
    }

    /// Requests a new view if the neighbours have changed since the last decision on a view.
    pub(super) fn review_neighbours(&mut self, now: Instant) {
        if self.layers.neighbours.have_changed(now) {
            self.layers.view.request.start(now);
        }
        if self.layers.neighbours.at(self.onward()).has_no_peer()
            && self.layers.view.outstanding().is_some()
        {
            // The next relay, which should reply to the outstanding proposal, is lost. So this relay is the last one
            // and decides.
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.view.decide(&context);
            self.apply(now, effects);
        }
    }

    /// Returns true while this relay computes its part of the joint solution of the whole chain.
    fn is_solving(&self, now: Instant) -> bool {
        self.layers
            .round
            .is_solving(&self.layers.context(now, &self.member))
    }

    /// Restarts two timers after the joint computation of all positions. One timer is for silent neighbours, the second
    /// for the first message along the chain.
    ///
    /// All relays compute at the same time and send nothing meanwhile. The timers must not expire because of that.
    fn on_solved(&mut self, now: Instant) {
        for side in [Side::Upstream, Side::Downstream] {
            let neighbour = self.layers.neighbours.at_mut(side);
            neighbour.excuse_silence(now, &self.member.settings);
        }
        if self.awaits_first() {
            self.await_first(now);
        }
    }

    /// Returns true until this relay's first message along the chain or view request.
    fn awaits_first(&self) -> bool {
        self.layers.round.is_idle() && !self.layers.view.request.is_pending()
    }

    /// Starts the timer for the first message along the chain. If the timer expires, the relay requests a new view.
    pub(super) fn await_first(&mut self, now: Instant) {
        let (settings, all) = (&self.member.settings, self.member.all);
        let there_and_back = settings.hop_time.times(2 * u32::from(all));
        let usual = now + settings.probe_after + there_and_back;
        let slow = now + first_pass(settings, all);
        self.layers.view.request.await_first(usual.max(slow));
    }
}
