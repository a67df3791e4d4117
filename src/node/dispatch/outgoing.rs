//! Next message of a relay, in order of urgency.

use super::Node;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::Message;

impl Node {
    /// Returns the next message, with the side and the node to send it to. Call it until it returns `None`.
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
        let Some((side, to, fence)) = self.steering.poll_transmit() else {
            return self.next_telemetry(now);
        };
        let line_digest = self.layers.update.line_digest(&self.member);
        Some((side, to, Message::Fence { line_digest, fence }))
    }

    /// Returns the next pending message of a view change, a lease renewal or an agreement on positions. It comes with
    /// its side and its destination node. `None` if no such message is pending.
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
            let holds = layers.neighbours.at(onward).latest_mission;
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
