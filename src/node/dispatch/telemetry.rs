//! Reports of this relay's state to a ground station that watches, and those that it hands on.

use super::Node;
use crate::features::{AUTH, TELEMETRY};
use crate::node::reports::{FIRST_PATIENCE, Own, PATIENCE};
use crate::node::round::state::Phase;
use crate::side::Side;
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::CANDIDATES;
use crate::wire::message::Message;

impl Node {
    /// Handles a telemetry message of node `from` at `side`: a Watch (request for reports) or a Report. The node need
    /// not be a neighbour.
    pub(super) fn on_telemetry(&mut self, now: Instant, side: Side, from: u16, message: &Message) {
        if !AUTH {
            return; // Ground stations sign all frames.
        }
        if message.digest() != Some(self.member.digest) {
            self.refuse_mission(now, side, from);
        } else if !(self.reporting).handle(now, &self.member, (side, from), message) {
            bump(&mut self.telemetry.stats.stale);
        }
    }

    /// Records the drone's control state, from 1. See [`Reporting::handle_control`](crate::node::reports::Reporting).
    #[cfg(feature = "telemetry")]
    pub(crate) fn report_control(&mut self, control: u16) {
        self.reporting.handle_control(&self.member, control);
    }

    /// Records that a frame of node `from` was received on the shared channel, whatever its destination.
    pub(crate) fn on_channel(&mut self, now: Instant, from: u16) {
        self.reporting.handle_frame(now, from);
    }

    /// Returns the next node to which a handshake must be sent, because no report of this node has arrived. `None` if
    /// there is no such node.
    pub(crate) fn poll_greeting(&mut self) -> Option<u16> {
        self.reporting.poll_greeting()
    }

    /// Returns the next telemetry message (Watch or Report) with its side and its destination. `None` if none is
    /// pending.
    pub(super) fn next_telemetry(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let wait = self.telemetry_waits();
        if !self.reporting.is_due(now, wait) {
            return None;
        }
        let own = if TELEMETRY {
            self.own(now)
        } else {
            Own::default()
        };
        let (member, neighbours) = (&self.member, &self.layers.neighbours);
        self.reporting.poll(now, member, neighbours, wait, own)
    }

    /// Returns the delay of telemetry reports. Above 0 only on a shared channel during an agreement on positions, which
    /// needs the channel.
    pub(super) fn telemetry_waits(&self) -> Duration {
        let is_idle = matches!(
            self.phase(),
            Phase::Holding | Phase::Infeasible | Phase::NoQuorum
        );
        match self.agreed_place() {
            _ if is_idle || !self.searches() || !TELEMETRY => Duration::from_micros(0),
            Some(_) => PATIENCE,
            None => FIRST_PATIENCE,
        }
    }

    fn own(&self, now: Instant) -> Own {
        let hold = |side| self.hold_reason(side).map_or(0, |reason| reason as u16 + 1);
        let silent = |side| u16::from(self.layers.neighbours.at(side).is_silent());
        let sides = [Side::Upstream, Side::Downstream];
        let ([a, b], [c, d]) = (sides.map(hold), sides.map(silent));
        let holds_lease = u16::from(self.lease().is_some());
        let is_duplicated = u16::from(self.duplicate.is_observed(now, &self.member.settings));
        let flags = 512 * (c + 2 * d + 4 * holds_lease) + 28_672 * is_duplicated;
        let state = self.phase() as u16 + 8 * a + 64 * b + flags;
        let [before, after] = sides.map(|side| self.layers.neighbours.at(side).refused(now));
        let mut refusals = before.into_iter().zip(after).zip([0, 2 * CANDIDATES]);
        // A mission is refused by its signed digest; the other key may be a forger's.
        let refusal = refusals.find_map(|((before, after), kind)| match (before, after) {
            (0, 0) => None,
            (before, after) if after == 0 || before != 0 && before <= after => Some(kind + before),
            (_, after) => Some(kind + CANDIDATES + after),
        });
        let refusal = refusal.unwrap_or(0);
        ([state, refusal], [self.setpoint(), self.agreed_place()])
    }
}
