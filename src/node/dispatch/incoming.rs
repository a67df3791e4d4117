//! Received messages: checks, the sender's side, and the layer that handles the message.

use super::Node;
use crate::event::NodeEvent;
use crate::features::UPLOAD;
use crate::node::context::Effects;
use crate::node::duplicate::Duplicated;
use crate::node::mission_update::accepts_uploads;
use crate::node::neighbour::hearing::CANDIDATES;
use crate::settings::Wiring;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::STATION_REACH;
use crate::wire::message::Message;

impl Node {
    /// Handles an intact message from node `from` at `side`. Returns false if it must be counted as misaddressed.
    ///
    /// A message is misaddressed if node `from` must not send it to this relay, or while this relay is passive.
    ///
    /// Work: at most the computation of this relay's positions for 16 target SIRs.
    #[inline(never)]
    pub(crate) fn handle_message(
        &mut self,
        now: Instant,
        side: Side,
        from: u16,
        message: &Message,
    ) -> bool {
        if let Message::Claim(claim) = message {
            return self.on_claim(now, side, from, *claim);
        }
        if self.is_passive() {
            return false;
        }
        if self.ground_side(from).is_some() {
            return self.on_ground(now, side, from, message);
        }
        if let Message::Level { .. } = message {
            // Only the ground station sends this message.
            return false;
        }
        if let Message::Watch { .. } | Message::Report(_) = message {
            self.on_telemetry(now, side, from, message);
            return true;
        }
        let is_neighbour = self.layers.neighbours.at(side).node() == from;
        let distance = from.abs_diff(self.member.node);
        let neighbour = self.layers.neighbours.at_mut(side);
        neighbour.record_frame(distance, is_neighbour, now, &self.member.settings);
        if let Message::Hello(hello) = message {
            if self.is_of_mission(now, side, from, hello.mission) {
                self.on_hello(now, side, from, *hello);
                self.steer(now);
            }
            return true;
        }
        if let Message::Offer {
            upload,
            offer_number,
        } = message
            && !is_neighbour
            && accepts_uploads(&self.member)
        {
            // The sender uses this relay as its neighbour. A hello alone would only trigger the same offer again.
            if self.is_of_mission(now, side, from, upload.base()) {
                self.on_offer(now, side, from, upload, *offer_number);
            }
            return true;
        }
        if !is_neighbour {
            self.schedule_hello(side, from, false);
            return false;
        }
        if self.searches() {
            // A node sends such a message only to its neighbour, so the sender uses this relay as its neighbour.
            self.on_mutual(now, side, true);
        }
        if !self.is_of_this_view(now, side, from, message) {
            return true;
        }
        self.dispatch(now, side, from, message);
        self.steer(now);
        true
    }

    /// Returns true if `message` belongs to the current mission and, if it depends on a view, to that view.
    ///
    /// A message of a different mission or view is counted and answered by a hello. If it belongs to an agreement on
    /// positions, this relay also requests a new view.
    fn is_of_this_view(&mut self, now: Instant, side: Side, from: u16, message: &Message) -> bool {
        let Some(digest) = message.digest() else {
            return true;
        };
        let (active, latest) = (self.member.active, self.layers.update.latest());
        let proposes = message.is_view_change();
        if UPLOAD && matches!(message, Message::Fence { .. }) {
            return self.is_of_line(now, side, from, digest);
        }
        if !proposes && !message.belongs_to_view() {
            return self.is_of_mission(now, side, from, digest);
        }
        let known = match message {
            Message::Proposal(proposal) => proposal.mission_id == latest,
            Message::Decision(decision) => [active, latest].contains(&decision.mission_id),
            _ => digest == self.member.pass_digest(),
        };
        if !known {
            // The hello informs the sender of this relay's mission and view.
            bump(&mut self.telemetry.stats.view);
            self.schedule_hello(side, from, true);
            // The sender has the same mission, so only the view differs.
            let of_mission = self.layers.neighbours.at(side).latest_mission.is_some();
            if of_mission && message.belongs_to_view() && message.is_onward() {
                self.layers.view.request.start(now);
            }
        }
        known
    }

    /// Returns true if node `from` uses the same x axis, the line from Tx to Rx. `digest` in the node's message
    /// identifies the axis. A message with a different axis is counted as rejected.
    fn is_of_line(&mut self, now: Instant, side: Side, from: u16, digest: u16) -> bool {
        let same = digest == self.layers.update.line_digest(&self.member);
        if !same && self.layers.neighbours.at(side).latest_mission.is_some() {
            bump(&mut self.telemetry.stats.stale);
        } else if !same {
            self.refuse_mission(now, side, from);
        }
        same
    }

    #[inline(never)] // called from several places
    fn is_of_mission(&mut self, now: Instant, side: Side, from: u16, digest: u16) -> bool {
        let same = digest == self.member.digest;
        if !same {
            self.refuse_mission(now, side, from);
        }
        same
    }

    pub(super) fn refuse_mission(&mut self, now: Instant, side: Side, from: u16) {
        bump(&mut self.telemetry.stats.mission);
        self.refuse(now, side, from, NodeEvent::Mission);
    }

    /// Records that this relay refuses node `from` at `side`.
    ///
    /// The node is reported to the firmware at most once a minute. `reason` is [`NodeEvent::Mission`], [`NodeEvent::Epoch`] or [`NodeEvent::Key`]. If this relay refused no node
    /// before, its next report to a ground station is early.
    pub(crate) fn refuse(&mut self, now: Instant, side: Side, from: u16, reason: NodeEvent) {
        let distance = from.abs_diff(self.member.node);
        let before = self.refusals(now);
        let neighbour = self.layers.neighbours.at_mut(side);
        if neighbour.refusals.add(reason, distance, now) {
            if before == [0; 2] && self.refusals(now) != [0; 2] {
                self.reporting.schedule(&self.member, true);
            }
            self.raise_node_event(reason, side, from);
        }
    }

    /// Passes a message of the current mission and view to the protocol layer that handles it.
    fn dispatch(&mut self, now: Instant, side: Side, from: u16, message: &Message) {
        match message {
            Message::Heartbeat { request, reply, .. } => {
                let neighbour = self.layers.neighbours.at_mut(side);
                neighbour.record_request(*request);
                if let Some(at) = neighbour.record_reply(*reply) {
                    self.confirm(now, side, at);
                }
                return;
            }
            Message::Fence { fence, .. } => {
                return self.steering.handle(side, from, fence);
            }
            Message::Offer {
                upload,
                offer_number,
            } => {
                return self.on_offer(now, side, from, upload, *offer_number);
            }
            _ => {}
        }
        if message.belongs_to_view() && !self.layers.neighbours.at(side).is_agreed() {
            // The sender is not this relay's neighbour in the view.
            return bump(&mut self.telemetry.stats.stale);
        }
        let wanted = if message.is_onward() {
            self.back()
        } else {
            self.onward()
        };
        if side != wanted {
            return bump(&mut self.telemetry.stats.misdirected);
        }
        self.layers.update_requests(now, &self.member);
        let context = self.layers.context(now, &self.member);
        let layers = &mut self.layers;
        let effects = match message {
            // The relays that the proposal leaves out may be linked soon. The proposal will be retransmitted.
            Message::Proposal(proposal) if layers.is_premature(now, side, proposal) => {
                Effects::STALE
            }
            Message::Proposal(_) | Message::Decision(_) => layers.view.handle(&context, message),
            Message::Busy { number } if layers.view.on_busy(&context, *number) => Effects::NONE,
            // No agreement on positions continues during a view change.
            _ if layers.view.outstanding().is_some() => Effects::STALE,
            _ => {
                if message.belongs_to_view() && message.is_onward() {
                    // An agreement or a lease renewal shows that all members have accepted the view.
                    layers.view.commit(self.member.view);
                    layers.lease.confirm_view(self.member.view);
                }
                if let Message::Pulse(_) | Message::Pulsed(_) = message {
                    layers.lease.handle(&context, message)
                } else {
                    layers.round.handle(&context, message)
                }
            }
        };
        self.apply(now, effects);
        if let Message::Pulse(_) | Message::Pulsed(_) = message {
            self.follow_orders(now);
        }
    }

    /// Records that the neighbour at `side` was alive at time `at`.
    ///
    /// The neighbour has replied to a message that was sent at that time.
    pub(super) fn confirm(&mut self, now: Instant, side: Side, at: Instant) {
        let neighbour = self.layers.neighbours.at_mut(side);
        if neighbour.record_sign_of_life(now, at) {
            let node = neighbour.node();
            self.raise_node_event(NodeEvent::Back, side, node);
        }
    }
}

impl Node {
    /// Handles a valid signed frame of node `from` at `side`. If it is the first frame of a session (`first`), this
    /// relay repeats the messages that the node could not verify before.
    pub(crate) fn on_authentic(&mut self, now: Instant, side: Side, from: u16, first: bool) {
        if self.ground_side(from).is_some() {
            return;
        }
        if first {
            self.reporting.handle_session(now, &self.member, side, from);
        }
        if self.layers.neighbours.at(side).node() != from {
            if first {
                // Node `from` could not verify earlier messages of this relay.
                self.schedule_hello(side, from, true);
            }
            return;
        }
        if first && side == self.onward() {
            self.layers.resend();
        }
    }

    /// Handles a valid handshake of node `from` at `side`. The handshake does not prove that the node receives this
    /// relay, so the node is recorded as one that does not.
    pub(crate) fn on_handshake(&mut self, side: Side, from: u16) {
        self.on_key_match(side, from);
        if self.searches() {
            self.record_reception(side, from, false);
        }
    }

    /// Handles a handshake of node `from` at `side` that is not signed with this relay's key. After several such
    /// handshakes in a row the node is reported to the firmware.
    pub(crate) fn on_forged(&mut self, now: Instant, side: Side, from: u16) {
        let distance = from.abs_diff(self.member.node);
        let neighbour = self.layers.neighbours.at_mut(side);
        if neighbour.count_forged(distance) {
            self.refuse(now, side, from, NodeEvent::Key);
        }
    }

    /// Records that node `from` at `side` signs with the same key as this relay, and with a new epoch.
    pub(crate) fn on_key_match(&mut self, side: Side, from: u16) {
        let distance = from.abs_diff(self.member.node);
        self.layers.neighbours.at_mut(side).on_key_match(distance);
    }
}

impl Node {
    /// Returns the side of this relay toward the last relay, away from the leader.
    pub(super) const fn onward(&self) -> Side {
        Side::onward(self.member.mission.heading())
    }

    pub(super) const fn back(&self) -> Side {
        Side::back(self.member.mission.heading())
    }

    /// Returns the side of node `sender`. `None` unless `sender` is a neighbour, a possible neighbour, or a ground
    /// station that may upload missions.
    pub(crate) fn side_of(&self, sender: u16) -> Option<Side> {
        if let Some(side) = self.ground_side(sender) {
            return Some(side);
        }
        let own = self.member.node;
        let near = sender.abs_diff(own) <= if self.searches() { CANDIDATES } else { 1 };
        if !near || sender == own || sender < 1 || sender > self.member.all {
            return None;
        }
        Some(if sender < own {
            Side::Upstream
        } else {
            Side::Downstream
        })
    }

    /// Returns the side of the ground station `node` if this relay accepts its messages. Otherwise, or if `node` is no
    /// ground station, returns `None`.
    pub(super) fn ground_side(&self, node: u16) -> Option<Side> {
        let (own, all) = (self.member.node, self.member.all);
        let most = match self.member.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => STATION_REACH,
        };
        let near = accepts_uploads(&self.member) && node.abs_diff(own) <= most;
        match node {
            0 if near => Some(Side::Upstream),
            _ if near && node == all.saturating_add(1) => Some(Side::Downstream),
            _ => None,
        }
    }

    /// Returns true on a shared channel. There a relay receives many nodes, and searches for its neighbours.
    pub(super) fn searches(&self) -> bool {
        self.member.settings.wiring == Wiring::Shared
    }

    /// Handles a frame of node `from` received at port `through`. If node `from` is also received at the relay's other
    /// port, two nodes use the same number, and this is reported to the firmware.
    pub(crate) fn on_received_at_both_ports(&mut self, now: Instant, through: Side, from: u16) {
        let Some(side) = self.side_of(from).filter(|side| *side != through) else {
            return;
        };
        let settings = self.member.settings;
        if self.layers.neighbours.at(side).is_present()
            && self
                .duplicate
                .should_report(now, Duplicated::Neighbour, &settings)
        {
            self.raise_node_event(NodeEvent::Index, side, from);
        }
    }
}
