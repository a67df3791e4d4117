//! What a relay says, and what of it first.

use super::state::Node;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::Message;

impl Node {
    /// The next message to send, to which node at which side. Call until there is none.
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
        if let Some((side, to, ask, answer)) = self.layers.neighbours.take_heartbeat(now) {
            let beat = Message::Heartbeat {
                mission,
                ask,
                answer,
            };
            return Some((side, to, beat));
        }
        if let Some((side, to, hello)) = self.next_hello(now) {
            return Some((side, to, Message::Hello(hello)));
        }
        #[cfg(feature = "upload")]
        for side in [Side::Upstream, Side::Downstream] {
            if let Some(offer) = self.next_offer(now, side) {
                return Some(offer);
            }
            if let Some((to, report)) = self.next_report(now, side) {
                return Some((side, to, report));
            }
        }
        let (side, to, fence) = self.steering.poll_transmit()?;
        let mission = self.member.line();
        Some((side, to, Message::Fence { mission, fence }))
    }

    /// The next message of a view change or of a round.
    fn next_of_a_round(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let (onward, back) = (self.onward(), self.back());
        let peer = |side| {
            let neighbour = self.layers.neighbours.at(side);
            // To one that is lost nothing is repeated until something comes from it.
            (neighbour.is_mutual() && !neighbour.is_silent())
                .then_some((neighbour.node(), neighbour.is_agreed()))
        };
        let (next, before) = (peer(onward), peer(back));
        let context = self.layers.context(now, &self.member);
        let layers = &mut self.layers;
        // Without anybody to hand it to it waits.
        if let Some((to, _)) = next
            && let Some(message) = layers.view.take_onward(&context, to)
        {
            #[cfg(feature = "upload")]
            {
                let holds = layers.neighbours.at(onward).holds;
                if layers.update.offer_to(holds).is_some() {
                    layers.neighbours.at_mut(onward).offer = true;
                    layers.update.begin_offers(onward);
                    return self.next_offer(now, onward);
                }
            }
            return Some((onward, to, message));
        }
        if let Some((to, _)) = before
            && let Some(message) = layers.view.take_back()
        {
            return Some((back, to, message));
        }
        let agreed = |peer: Option<(u16, bool)>| peer.is_some_and(|(_, agreed)| agreed);
        if layers.view.awaited().is_none() {
            if agreed(next)
                && let Some(message) = layers.lease.take_onward(&context)
                && let Some((to, _)) = next
            {
                return Some((onward, to, message));
            }
            if agreed(before)
                && let Some(message) = layers.lease.take_back(&context)
                && let Some((to, _)) = before
            {
                return Some((back, to, message));
            }
        }
        if let Some(message) = layers.round.take_onward(&context, agreed(next))
            && let Some((to, _)) = next
        {
            return Some((onward, to, message));
        }
        let message = layers.round.take_back(&context, agreed(before))?;
        let (to, _) = before?;
        Some((back, to, message))
    }
}
