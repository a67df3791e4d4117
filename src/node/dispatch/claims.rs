//! Claims to this relay's node number, in case a second node uses the same number.

use super::Node;
use crate::event::{Event, NodeEvent};
use crate::node::duplicate::Duplicated;
use crate::settings::Wiring;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::message::{Claim, Message};
use crate::wire::session::Sender;

impl Node {
    pub(crate) fn on_duplicate_index(&mut self, now: Instant, sender: Sender) {
        let settings = self.member.settings;
        let shown = match sender {
            Sender::Itself => false,
            // Without signatures, the frame may be an echo of this relay's own. Only a claim shows whose it is.
            Sender::Unknown => settings.auth.is_some(),
            Sender::Rival(rival) => rival.is_current,
        };
        if shown
            && self
                .duplicate
                .should_report(now, Duplicated::Own, &settings)
        {
            let node = self.member.node;
            self.raise_node_event(NodeEvent::Index, Side::Upstream, node);
            if let Sender::Rival(rival) = sender
                && rival.newer_epoch
            {
                // The sender may be this relay itself, before its epoch went back.
                self.raise_node_event(NodeEvent::Epoch, Side::Upstream, node);
            }
        }
        let placed = self.setpoint().is_some();
        // A pending lease counts, too. The relay keeps its position during a view change, which a duplicate may have
        // requested.
        let lease = &self.layers.lease;
        let leased = lease.is_pending() || lease.until().is_some_and(|until| until > now);
        let may_defend_number = placed && leased;
        if self
            .duplicate
            .handle_frame(now, sender, may_defend_number, &settings)
        {
            self.layers.round.discard_agreed_place();
            if placed {
                self.raise(Event::SetpointChanged);
            }
        }
    }

    /// Handles a claim message of node `from`. Nodes with the same node number detect each other by claims. Returns
    /// false if frames are signed, because signed handshakes then replace claims.
    ///
    /// A claim of node `from` to its own number is sent back to it as an echo. A claim to this relay's number is
    /// compared with this relay's own claim.
    pub(super) fn on_claim(&mut self, now: Instant, side: Side, from: u16, claim: Claim) -> bool {
        if self.member.settings.auth.is_some() {
            return false;
        }
        if claim.echo {
            let sender = self.duplicate.rival(claim);
            if sender != Sender::Itself {
                self.on_duplicate_index(now, sender);
            }
        } else if !self.is_passive() {
            let claim = Claim {
                echo: true,
                ..claim
            };
            self.echo = Some((side, from, claim));
        }
        true
    }

    pub(super) fn next_claim(&mut self) -> Option<(Side, u16, Message)> {
        if let Some((side, to, claim)) = self.echo.take() {
            return Some((side, to, Message::Claim(claim)));
        }
        let (side, to) = self.poll_claim()?;
        let claim = Claim {
            number: self.duplicate.number(),
            other_number: self.duplicate.other_number(),
            passive: self.is_passive(),
            echo: false,
        };
        Some((side, to, Message::Claim(claim)))
    }

    /// Returns the node to which a claim must be sent, and marks the claim as sent. `None` if no claim is due. Claims
    /// let two nodes with one node number detect each other.
    ///
    /// The two neighbours receive claims alternately. On a shared channel, a relay without neighbours addresses its
    /// claims to its own number, so that a second node with that number receives them.
    pub(crate) fn poll_claim(&mut self) -> Option<(Side, u16)> {
        if !self.duplicate.poll_claim() {
            return None;
        }
        let side = self.claim_side;
        self.claim_side = side.other();
        let nodes = [side, side.other()].map(|side| (side, self.layers.neighbours.at(side).node()));
        let neighbour = nodes.into_iter().find(|(_, node)| *node != 0);
        neighbour.or_else(|| self.searches().then_some((side, self.member.node)))
    }

    /// Returns the new claim number if the authentication sessions must restart; otherwise `None`. A claim number
    /// distinguishes two nodes that use the same node number.
    ///
    /// The new sessions count their nonces from the claim number.
    pub(crate) fn poll_sessions(&mut self) -> Option<u32> {
        self.duplicate.poll_sessions()
    }

    pub(crate) const fn claim_number(&self) -> u32 {
        self.duplicate.number()
    }

    /// Returns the sequence number of a lease renewal if this relay must send a handshake after `message`.
    ///
    /// Otherwise `None`. On a shared channel each relay sends one handshake per lease renewal: the leader after its
    /// renewal message, every other relay after its reply that the renewal is complete. By this handshake a second node
    /// with the same node number detects this relay, even if the chain sends no other message.
    pub(crate) fn handshake_of(&self, message: &Message) -> Option<u16> {
        let number = match message {
            Message::Pulse(pulse) if self.layers.neighbours.at(self.back()).has_no_peer() => {
                pulse.number
            }
            Message::Pulsed(pulsed) if pulsed.done => pulsed.number,
            _ => return None,
        };
        (self.member.settings.wiring == Wiring::Shared).then_some(number)
    }

    pub(crate) fn rival(&self, claim: Claim) -> Sender {
        self.duplicate.rival(claim)
    }

    /// Returns true while this relay is passive, because a second node uses the same node number.
    pub(crate) const fn is_passive(&self) -> bool {
        self.duplicate.is_passive()
    }

    /// Handles the firmware's report that the duplicate of this relay's node number has been removed.
    pub(crate) fn clear_duplicate(&mut self, now: Instant) {
        if self.duplicate.clear(now, &self.member.settings) {
            self.become_active(now);
        }
    }

    /// Makes this passive relay active again, as after a restart. The relay leaves its view, because the other node
    /// with its number may have caused a view change.
    pub(super) fn become_active(&mut self, now: Instant) {
        self.layers.neighbours.leave();
        self.layers.lease.end();
        if !self.layers.round.is_idle() {
            self.layers.round.suspend();
            self.layers.view.leave(now);
        }
    }
}
