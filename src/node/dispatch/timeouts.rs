//! What has run out: timers of the layers, and the silence of a neighbour.

use super::state::Node;
use crate::event::About;
use crate::node::neighbour::liveness::patient_tick;
use crate::node::timing::first_pass;
use crate::settings::Wiring;
use crate::side::Side;
use crate::time::Instant;

impl Node {
    /// Handles what has run out by `now`, each layer once; the work is that of one portion of a computation.
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
        let context = self.layers.context(now, &self.member);
        let effects = self.layers.lease.handle_timeout(&context);
        self.apply(now, effects);
        if solved && !self.is_solving(now) {
            self.solved(now);
        }
        self.search_anew(now);
        for side in [Side::Upstream, Side::Downstream] {
            if self.layers.neighbours.at(side).is_due(now) {
                self.silence(now, side);
            }
        }
        if self.awaits_first() && self.is_solving(now) {
            if self.layers.view.asking.is_due(now) {
                self.await_first(now);
            }
        } else {
            let leads = self.layers.neighbours.at(self.back()).has_no_peer();
            let fresh = self.layers.round.is_fresh();
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.view.handle_timeout(&context, leads, fresh);
            self.apply(now, effects);
        }
        #[cfg(feature = "upload")]
        self.offer_again(now);
        self.steering.handle_timeout(now);
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
            self.adrift.next_timeout(),
            #[cfg(feature = "upload")]
            self.layers.update.next_timeout(),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    fn silence(&mut self, now: Instant, side: Side) {
        let (solving, searches) = (self.is_solving(now), self.searches());
        let (layers, settings) = (&mut self.layers, &self.member.settings);
        let neighbour = layers.neighbours.at_mut(side);
        if solving && neighbour.excuse(now, settings) {
            return;
        }
        let node = neighbour.node();
        let ended = neighbour.has_no_peer();
        let dead = layers.lease.span(settings);
        let many = settings.wiring == Wiring::Shared && layers.lease.is_open();
        let asking = many.then(|| patient_tick(settings, self.member.all));
        let lost = neighbour.handle_timeout(now, settings, dead, searches, asking);
        let ends = neighbour.has_no_peer() && !ended;
        self.steering
            .link(side, Some(neighbour.node()).filter(|node| *node != 0));
        if lost {
            self.raise_about(About::Lost, side, node);
        }
        if ends {
            self.layers.view.asking.hasten(now);
        }
        self.review(now);
    }

    /// Asks for a new view if the chain is another than the one agreed on.
    pub(super) fn review(&mut self, now: Instant) {
        if self.layers.neighbours.have_changed(now) {
            self.layers.view.asking.ask(now);
        }
        if self.layers.neighbours.at(self.onward()).has_no_peer()
            && self.layers.view.awaited().is_some()
        {
            // Whoever was to be counted next is not there any more.
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.view.decide(&context);
            self.apply(now, effects);
        }
    }

    /// Whether it is at the chain's solution, as every relay of its view is.
    fn is_solving(&self, now: Instant) -> bool {
        self.layers
            .round
            .is_solving(&self.layers.context(now, &self.member))
    }

    /// It has just found out where it is to be: what it waits for it waits for from now on.
    fn solved(&mut self, now: Instant) {
        for side in [Side::Upstream, Side::Downstream] {
            let neighbour = self.layers.neighbours.at_mut(side);
            neighbour.excuse(now, &self.member.settings);
        }
        if self.awaits_first() {
            self.await_first(now);
        }
    }

    /// Whether no pass has come yet, and it has not asked for a view.
    fn awaits_first(&self) -> bool {
        self.layers.round.is_fresh() && !self.layers.view.asking.asks()
    }

    /// By when the first pass should have come, were this the beginning.
    pub(super) fn await_first(&mut self, now: Instant) {
        let (settings, all) = (&self.member.settings, self.member.all);
        let there_and_back = settings.hop_time.times(2 * u32::from(all));
        let usual = now + settings.probe_after + there_and_back;
        let slow = now + first_pass(settings, all);
        self.layers.view.asking.await_first(usual.max(slow));
    }
}
