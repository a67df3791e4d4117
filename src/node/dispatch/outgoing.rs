//! Output of a relay: the next message in order of urgency, expired timers, and the setpoint.

use super::Node;
use crate::event::{About, Event};
use crate::guard::HoldReason;
use crate::node::context::Member;
use crate::node::context::first_pass;
use crate::node::neighbour::liveness::patient_tick;
use crate::place::Placement;
use crate::settings::Wiring;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::Message;

impl Node {
    /// Returns the next message with its side and its destination node; call it until it returns `None`.
    pub(crate) fn poll_message(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        if self.member.settings.auth.is_none()
            && let Some(claim) = self.next_claim()
        {
            return Some(claim);
        }
        if self.is_passive() {
            return None;
        }
        if let Some(message) = self.next_of_a_round(now) {
            return Some(message);
        }
        let mission = self.member.digest;
        if let Some((side, to, request, reply)) = self.layers.neighbours.poll_heartbeat(now) {
            let beat = Message::Heartbeat {
                mission,
                request,
                reply,
            };
            return Some((side, to, beat));
        }
        if let Some((side, to, hello)) = self.next_hello(now) {
            return Some((side, to, Message::Hello(hello)));
        }
        for side in [Side::Upstream, Side::Downstream] {
            if let Some(offer) = self.next_offer(now, side) {
                return Some(offer);
            }
            if let Some((to, report)) = self.next_report(now, side) {
                return Some((side, to, report));
            }
        }
        let (side, to, fence) = self.steering.poll_transmit()?;
        let mission = self.layers.update.line_digest(&self.member);
        Some((
            side,
            to,
            Message::Fence {
                line_digest: mission,
                fence,
            },
        ))
    }

    /// Returns the next message of a view change, a lease renewal or a round.
    fn next_of_a_round(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let (onward, back) = (self.onward(), self.back());
        let peer = |side| {
            let neighbour = self.layers.neighbours.at(side);
            // A lost neighbour gets no retransmissions until it is received again.
            (neighbour.is_mutual() && !neighbour.is_silent())
                .then_some((neighbour.node(), neighbour.is_agreed()))
        };
        let (next, before) = (peer(onward), peer(back));
        let context = self.layers.context(now, &self.member);
        let layers = &mut self.layers;
        // A proposal waits while there is no next relay.
        if let Some((to, _)) = next
            && let Some(message) = layers.view.poll_onward(&context, to)
        {
            let holds = layers.neighbours.at(onward).holds;
            if layers.update.offer_for(holds).is_some() {
                layers.update.schedule_offer(onward);
                layers.update.reset_offers(onward);
                return self.next_offer(now, onward);
            }
            return Some((onward, to, message));
        }
        if let Some((to, _)) = before
            && let Some(message) = layers.view.poll_back()
        {
            return Some((back, to, message));
        }
        let agreed = |peer: Option<(u16, bool)>| peer.is_some_and(|(_, agreed)| agreed);
        if layers.view.outstanding().is_none() {
            if agreed(next)
                && let Some(message) = layers.lease.poll_onward(&context)
                && let Some((to, _)) = next
            {
                return Some((onward, to, message));
            }
            if agreed(before)
                && let Some(message) = layers.lease.poll_back(&context)
                && let Some((to, _)) = before
            {
                return Some((back, to, message));
            }
        }
        if let Some(message) = layers.round.poll_onward(&context, agreed(next))
            && let Some((to, _)) = next
        {
            return Some((onward, to, message));
        }
        let message = layers.round.poll_back(&context, agreed(before))?;
        let (to, _) = before?;
        Some((back, to, message))
    }
}

impl Node {
    /// Returns the agreed position, or without a quorum the one by `Settings::without_quorum`.
    fn wanted(&self) -> Option<Placement> {
        let agreed = self.layers.round.agreed_place()?;
        Some(if self.layers.view.has_no_quorum() {
            self.member.settings.without_quorum.place(agreed)
        } else {
            agreed
        })
    }

    pub(super) fn steer(&mut self, now: Instant) {
        if self.steering.steer(now, self.wanted()) {
            self.raise(Event::SetpointChanged);
        }
    }

    pub(crate) fn handle_position(&mut self, now: Instant, measured_at: Instant, place: Placement) {
        self.steering.handle_position(measured_at, place);
        self.steer(now);
    }

    /// Takes the control state of the drone: true while it flies to the setpoints. Returns true if the guard did not know it.
    pub(crate) fn handle_control(&mut self, now: Instant, flown: bool) -> bool {
        let is_news = self.steering.handle_control(now, flown);
        if is_news {
            self.steer(now);
        }
        is_news
    }

    /// Handles the report that the lost relays at `side` are not in the air any more. The others of the view at that side are not
    /// meant.
    pub(crate) fn clear_lost(&mut self, now: Instant, side: Side) {
        let Member { index, mission, .. } = &self.member;
        let in_view = match side {
            Side::Upstream => index.saturating_sub(1),
            Side::Downstream => mission.relays().saturating_sub(*index),
        };
        let lost = u16::from(self.layers.neighbours.at(side).node() != 0);
        self.steering.clear_lost(side, in_view > lost);
        self.steer(now);
    }

    pub(crate) const fn agreed_place(&self) -> Option<Placement> {
        self.layers.round.agreed_place()
    }

    /// Returns the current setpoint; `None` while the relay is passive.
    pub(crate) fn setpoint(&self) -> Option<Placement> {
        if self.is_passive() {
            return None;
        }
        self.steering.setpoint(self.wanted())
    }

    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.steering.hold_reason(side)
    }
}

impl Node {
    /// Handles expired timers, each layer once. Bounded by one portion of a computation.
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
        self.drop_links_if_expired(now);
        for side in [Side::Upstream, Side::Downstream] {
            if self.layers.neighbours.at(side).is_due(now) {
                self.silence(now, side);
            }
        }
        if self.awaits_first() && self.is_solving(now) {
            if self.layers.view.request.is_due(now) {
                self.await_first(now);
            }
        } else {
            let leads = self.layers.neighbours.at(self.back()).has_no_peer();
            let fresh = self.layers.round.is_fresh();
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.view.handle_timeout(&context, leads, fresh);
            self.apply(now, effects);
        }
        self.layers.update.handle_timeout(now);
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
            self.no_quorum_timer.next_timeout(),
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
        if solving && neighbour.excuse_silence(now, settings) {
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
            self.layers.view.request.repeat_now(now);
        }
        self.review(now);
    }

    /// Requests a new view if the neighbours differ from those of the last decision.
    pub(super) fn review(&mut self, now: Instant) {
        if self.layers.neighbours.have_changed(now) {
            self.layers.view.request.start(now);
        }
        if self.layers.neighbours.at(self.onward()).has_no_peer()
            && self.layers.view.outstanding().is_some()
        {
            // The next relay of the outstanding proposal is lost, so this relay is the last one and decides.
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.view.decide(&context);
            self.apply(now, effects);
        }
    }

    /// Returns true while this relay computes the joint solution, as all relays of its view do.
    fn is_solving(&self, now: Instant) -> bool {
        self.layers
            .round
            .is_solving(&self.layers.context(now, &self.member))
    }

    /// Restarts the timers for neighbours and for the first pass, which waited for the joint solution.
    fn solved(&mut self, now: Instant) {
        for side in [Side::Upstream, Side::Downstream] {
            let neighbour = self.layers.neighbours.at_mut(side);
            neighbour.excuse_silence(now, &self.member.settings);
        }
        if self.awaits_first() {
            self.await_first(now);
        }
    }

    /// Returns true if neither a pass has been received nor a view requested since the start.
    fn awaits_first(&self) -> bool {
        self.layers.round.is_fresh() && !self.layers.view.request.is_pending()
    }

    /// Starts the timer for the first pass; when it expires, the relay requests a view.
    pub(super) fn await_first(&mut self, now: Instant) {
        let (settings, all) = (&self.member.settings, self.member.all);
        let there_and_back = settings.hop_time.times(2 * u32::from(all));
        let usual = now + settings.probe_after + there_and_back;
        let slow = now + first_pass(settings, all);
        self.layers.view.request.await_first(usual.max(slow));
    }
}
