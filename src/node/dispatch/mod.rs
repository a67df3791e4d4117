//! Dispatch of messages, timers and effects to the layers.
//!
//! [`Node`] is one struct. Each file has the methods of `Node` for one purpose. This file has its state and the layers.
//! It applies the effects of one layer to the other layers, and selects the next message by urgency.
//!
//! | file | content |
//! | --- | --- |
//! | `incoming` | received messages: checks, side of the sender, choice of the layer; results of handshakes |
//! | `timers` | expired timers of all layers |
//! | `adoption` | adoption of a decided view and its mission |
//! | `motion` | the setpoint, and the drone's reports that affect it |
//! | `claims` | claims to this node's number |
//! | `departure` | relays that leave the chain, or wait outside of it |
//! | `hellos` | pending hellos, and selection of the neighbour by received ones |
//! | `offers` | newer missions, exchanged with neighbours and with the ground |
//! | `telemetry` | reports of this relay's state, and forwarded reports of other relays |
//!
//! A relay without a quorum drops its links after a while, and searches for neighbours again. Otherwise two interleaved
//! parts, such as 1 - 3 - 5 and 2 - 4, would keep their links forever. A part that has not selected the node toward the
//! rest of the chain would keep its links as well. A part without a quorum loses nothing by dropping its links.

use crate::event::{Event, NodeEvent, Pending};
use crate::features::SENSING;
use crate::geodetic::Sites;
use crate::mission::Mission;
use crate::node::context::{Context, Effects, Ignored, LayerEvent, Member, Peer, first_pass};
use crate::node::duplicate::IndexClaims;
use crate::node::lease::Lease;
use crate::node::mission_update::MissionUpdate;
use crate::node::neighbour::Neighbours;
use crate::node::reports::Reporting;
use crate::node::round::Round;
use crate::node::round::state::Phase;
use crate::node::steering::Steering;
use crate::node::view::change::ViewChange;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::optimiser::joint::fitted::SlotShares;
use crate::sample::Sample;
use crate::settings::{Identity, Method, Settings};
use crate::side::Side;
use crate::stats::{Stats, bump};
use crate::time::{Duration, Instant};
use crate::wire::message::{Claim, Message, Proposal};
use departure::Leaving;

mod adoption;
mod claims;
#[cfg_attr(not(feature = "departures"), path = "no_departure.rs")]
pub(crate) mod departure;
mod hellos;
mod incoming;
mod motion;
mod offers;
mod telemetry;
mod timers;

#[cfg(feature = "upload")]
#[cfg(test)]
mod tests;

/// Received claim that must be sent back: side and number of its sender, and the claim. A claim lets two nodes with one
/// node number detect each other.
pub(crate) type Echo = (Side, u16, Claim);

#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(super) member: Member,
    pub(super) layers: Layers,
    pub(super) steering: Steering,
    pub(crate) reporting: Reporting,
    pub(super) duplicate: IndexClaims,
    pub(super) no_quorum_timer: NoQuorumTimer,
    /// Received claim that must be sent back to its sender as an echo; `None` if there is none.
    pub(super) echo: Option<Echo>,
    /// Side of the neighbour that receives this relay's next claim. Claims let two nodes with one node number detect
    /// each other.
    pub(super) claim_side: Side,
    /// Votes on views that the firmware has confirmed as stored.
    persisted: ViewRecord,
    pub(super) telemetry: Telemetry,
}

fn seed_of(identity: Identity, seed: u32) -> u32 {
    seed.wrapping_add(u32::from(identity.index))
}

impl Node {
    /// Creates a relay with valid `identity` and `settings`. The relay does nothing until [`begin`](Self::begin) is
    /// called.
    ///
    /// All fields of the new value are plain numbers, so that the compiler can write it in place, without a copy on the
    /// stack.
    pub(crate) fn new(
        mission: &Mission,
        identity: Identity,
        settings: &Settings,
        seed: u32,
        now: Instant,
    ) -> Self {
        let leads = identity.index == mission.leader();
        let profile = settings.profile.unwrap_or(mission.config().common);
        let seed = seed_of(identity, seed);
        let [a, b, ..] = seed.wrapping_mul(0x9E37_79B1).to_le_bytes();
        let number = u16::from_le_bytes([a, b]);
        let member = Member::new(*mission, *settings, identity.index);
        let view = ViewChange::new(member.all, mission.leader(), !seed);
        Self {
            persisted: view.record(member.digest),
            layers: Layers {
                neighbours: Neighbours::NONE,
                view,
                lease: Lease::new(!seed.rotate_left(16), now, settings),
                update: MissionUpdate::new(&member, seed.rotate_left(4), now),
                round: Round::new(leads, number, profile, settings, seed, now),
                leaving: Leaving::new(),
            },
            steering: Steering::NONE,
            reporting: Reporting::default(),
            duplicate: IndexClaims::new(seed.rotate_left(24), now, settings),
            no_quorum_timer: NoQuorumTimer::NONE,
            echo: None,
            claim_side: Side::Upstream,
            telemetry: Telemetry::default(),
            member,
        }
    }

    /// Starts the relay at `now`, with the same `seed` as in [`new`](Self::new).
    #[inline(never)] // as `Steering::begin`
    pub(crate) fn begin(&mut self, identity: Identity, seed: u32, now: Instant) {
        let Member {
            settings,
            mission,
            all,
            ..
        } = &self.member;
        let seed = seed_of(identity, seed);
        let neighbours = &mut self.layers.neighbours;
        neighbours.begin(identity.index, *all, seed.rotate_left(8), now, settings);
        self.steering.begin(settings, neighbours.nodes(), seed, now);
        let leads = identity.index == mission.leader();
        if leads || settings.method == Method::Joint {
            self.layers.round.work_soon(now);
        }
        if !leads {
            self.await_first(now);
        }
    }

    pub(crate) fn raise(&mut self, event: Event) {
        self.telemetry.events.raise(event);
    }

    #[inline(never)] // called from many places
    pub(super) fn raise_node_event(&mut self, kind: NodeEvent, side: Side, node: u16) {
        self.telemetry.events.raise_node_event(kind, side, node);
    }

    /// Applies the effects of one protocol layer's step to the other layers, the events and the counters.
    pub(super) fn apply(&mut self, now: Instant, effects: Effects) {
        let stats = &mut self.telemetry.stats;
        for (happened, counter) in [
            (effects.ignored == Some(Ignored::Stale), &mut stats.stale),
            (
                effects.ignored == Some(Ignored::Duplicate),
                &mut stats.repeated,
            ),
            (effects.resent, &mut stats.repeats),
            (effects.began, &mut stats.passes_begun),
        ] {
            if happened {
                bump(counter);
            }
        }
        let (back, onward) = (self.back(), self.onward());
        if let Some(proposer) = effects.proposed_by {
            self.layers.neighbours.at_mut(back).proposed_by(proposer);
        }
        if let Some((peer, at)) = effects.alive {
            let side = match peer {
                Peer::Next => onward,
                Peer::Previous => back,
            };
            self.confirm(now, side, at);
        }
        if effects.view_proposed {
            self.layers.round.suspend();
        }
        if effects.view_needed {
            self.layers.view.request.start(now);
        }
        match effects.event {
            Some(LayerEvent::Lapsed)
                if core::mem::replace(&mut self.telemetry.lapse_reported, true) => {}
            Some(LayerEvent::Lapsed) => self.raise(Event::LeaseLapsed),
            Some(LayerEvent::RequestView) => {
                let to = self.layers.neighbours.at(back).node();
                self.schedule_hello(back, to, true);
            }
            Some(LayerEvent::ProposalDecided(decided)) => {
                self.adopt_view(now, decided);
                self.update_no_quorum_timer(now);
            }
            Some(LayerEvent::Converged) => {
                self.raise(Event::Converged);
                let leads = self.layers.context(now, &self.member).leads_view();
                self.layers.lease.on_agreement(now, leads);
            }
            Some(LayerEvent::Infeasible) => self.raise(Event::Infeasible),
            None => {}
        }
        let sensed = effects.sensed;
        if SENSING && sensed.new_estimate {
            self.apply_estimate();
        }
        if sensed.unclear {
            self.raise(Event::InterfererUnclear);
        }
        if let Some(node) = sensed.faulty_sensor {
            self.raise_node_event(NodeEvent::Sensor, onward, node);
        }
    }

    /// Replaces the interference in the active mission by the current estimate, and reports the change.
    fn apply_estimate(&mut self) {
        let estimate = self.layers.round.sensing().estimate();
        let Member {
            mission,
            interference,
            ..
        } = &self.member;
        if let Ok(mission) = estimate.estimate.mission(mission, *interference) {
            self.member.mission = mission;
            self.raise(Event::NewEstimate);
        }
    }

    pub(crate) fn poll_event(&mut self) -> Option<Event> {
        self.telemetry.events.take()
    }

    /// Returns the time at which this relay's lease expires; `None` if it has no lease.
    pub(crate) const fn lease(&self) -> Option<Instant> {
        self.layers.lease.until()
    }

    /// Returns start and end of this relay's time slots, as fractions of the frame (all slots together). `None` without
    /// a valid agreement, and if all slots have the same length.
    pub(crate) fn slot_shares(&self) -> Option<SlotShares> {
        let void = self.layers.lease.has_lapsed() || self.layers.view.has_no_quorum();
        self.layers.round.slot_shares().filter(|_| !void)
    }

    pub(crate) fn phase(&self) -> Phase {
        if self.layers.view.has_no_quorum() {
            Phase::NoQuorum
        } else if self.layers.view.outstanding().is_some() {
            Phase::ViewChange
        } else {
            self.layers.round.phase()
        }
    }

    pub(crate) const fn member(&self) -> &Member {
        &self.member
    }

    /// Returns the Tx and Rx positions of the active mission; `None` if the configured positions apply.
    pub(crate) fn sites(&self) -> Option<Sites> {
        self.layers.update.sites()
    }

    pub(crate) fn neighbours(&self) -> [Option<u16>; 2] {
        self.layers.neighbours.nodes()
    }

    pub(crate) const fn round(&self) -> &Round {
        &self.layers.round
    }

    pub(crate) const fn stats(&self) -> &Stats {
        &self.telemetry.stats
    }

    pub(crate) const fn stats_mut(&mut self) -> &mut Stats {
        &mut self.telemetry.stats
    }

    /// Returns the votes on views if the firmware has not stored them yet; otherwise `None`.
    pub(crate) fn unpersisted(&self) -> Option<ViewRecord> {
        let record = self.view_record();
        (record != self.persisted).then_some(record)
    }

    pub(crate) const fn view_record(&self) -> ViewRecord {
        self.layers.view.record(self.member.digest)
    }

    /// Records that the firmware has stored the votes in `record`.
    pub(crate) const fn persisted(&mut self, record: &ViewRecord) {
        self.persisted = *record;
    }

    /// Restores the stored votes on views after a start.
    pub(crate) fn resume_view(
        &mut self,
        now: Instant,
        record: &ViewRecord,
    ) -> Result<(), RecordError> {
        let untouched = self.layers.round.is_untouched();
        self.layers
            .view
            .resume(now, &self.member, record, untouched)?;
        self.persisted = *record;
        self.layers.lease.resume(&self.member.settings);
        Ok(())
    }

    /// Handles a measurement from the firmware. A rejected measurement is counted.
    pub(crate) fn handle_sample(&mut self, now: Instant, sample: Sample) {
        if !self.layers.round.handle_sample(now, &self.member, sample) {
            bump(&mut self.telemetry.stats.samples_rejected);
        } else if let Sample::Heard { power_w, .. } | Sample::Interference { power_w } = sample {
            self.reporting.handle_measured(power_w);
        }
    }

    /// Restarts the search for the best target SIR. The call has an effect only at the leader, and not during a view
    /// change.
    pub(crate) fn restart(&mut self, now: Instant) {
        let leads = self.member.index == self.member.mission.leader();
        let is_in = !self.is_passive() && !self.layers.leaving.is_outside();
        let may = leads && !self.layers.view.has_no_quorum() && is_in;
        if may && self.layers.view.outstanding().is_none() {
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.round.restart(&context);
            self.apply(now, effects);
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub(super) neighbours: Neighbours,
    pub(super) view: ViewChange,
    pub(super) lease: Lease,
    pub(super) update: MissionUpdate,
    pub(super) round: Round,
    pub(super) leaving: Leaving,
}

impl Layers {
    /// Returns the state that a protocol layer receives as an argument. The state borrows only `member`, so that the
    /// layers can be borrowed mutably at the same time.
    pub(super) fn context<'a>(&self, now: Instant, member: &'a Member) -> Context<'a> {
        let onward = Side::onward(member.mission.heading());
        Context {
            now,
            member,
            latest: self.update.latest(),
            is_last_reachable: self.neighbours.at(onward).has_no_peer(),
            other_leases: self.lease.other_leases(now),
        }
    }

    /// Returns true if a view proposal from `side` comes too early: some relays there are not linked yet. The view
    /// would leave out these relays, although their links will soon exist.
    ///
    /// This is assumed if the proposal has visited fewer relays than the previous proposal, and its sender has only
    /// just become the neighbour.
    pub(super) fn is_premature(&self, now: Instant, side: Side, proposal: &Proposal) -> bool {
        let place = self.view.rank_and_count().map_or(0, |(place, _)| place);
        self.neighbours.at(side).has_grace(now) && proposal.place.saturating_add(1) < place
    }

    /// Schedules retransmissions of all messages that await a reply. Called when the next relay is reachable again.
    pub(super) fn resend(&mut self) {
        self.view.resend();
        self.round.resend();
    }
}

/// Events and counters of a relay, which the firmware reads.
#[derive(Clone, Debug, Default)]
pub(super) struct Telemetry {
    pub(super) events: Pending,
    pub(super) stats: Stats,
    /// True if the end of the lease was reported to the firmware in this view. One report is made per view.
    pub(super) lapse_reported: bool,
    /// True if a missing quorum was reported to the firmware in this view. One report is made per view.
    pub(super) no_quorum_reported: bool,
}

/// Time without a quorum after which relays drop their links first, in units of `dead_after`.
const FIRST_RETENTION: u32 = 3;

/// Time from one drop of the links to the next while there is no quorum, in units of `dead_after`.
const LATER_RETENTION: u32 = 4;

/// Timer after which a relay without a quorum drops its links and searches for other neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NoQuorumTimer {
    /// Time at which the timer expires; `None` while there is a quorum.
    at: Option<Instant>,
    has_expired: bool,
}

impl NoQuorumTimer {
    pub(super) const NONE: Self = Self {
        at: None,
        has_expired: false,
    };

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }
}

impl Node {
    /// Starts the no-quorum timer if there is no quorum on a shared channel. Otherwise stops it.
    pub(super) fn update_no_quorum_timer(&mut self, now: Instant) {
        if !self.searches() || !self.layers.view.has_no_quorum() {
            self.no_quorum_timer = NoQuorumTimer::NONE;
        } else if self.no_quorum_timer.at.is_none() {
            self.no_quorum_timer.at = Some(now + self.link_retention());
        }
    }

    /// Returns the time without a quorum after which links are dropped.
    fn link_retention(&self) -> Duration {
        let settings = &self.member.settings;
        let times = if self.no_quorum_timer.has_expired {
            LATER_RETENTION
        } else {
            FIRST_RETENTION
        };
        let pass = first_pass(settings, self.member.all);
        settings.dead_after.times(times).max(pass)
    }

    /// Drops the links to both neighbours if the no-quorum timer has expired.
    pub(super) fn drop_links_if_expired(&mut self, now: Instant) {
        if self.no_quorum_timer.at.is_none_or(|at| now < at) {
            return;
        }
        self.no_quorum_timer.has_expired = true;
        self.no_quorum_timer.at = Some(now + self.link_retention());
        for side in [Side::Upstream, Side::Downstream] {
            self.layers.neighbours.at_mut(side).drop_link(now);
        }
    }
}

impl Node {
    /// Returns the next message, its side and its destination node. Call this until the result is `None`.
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
            if let Some((to, report)) = self.next_for_ground(now, side) {
                return Some((side, to, report));
            }
        }
        let Some((side, to, fence)) = self.steering.poll_transmit() else {
            return self.next_telemetry(now);
        };
        let line_digest = self.layers.update.line_digest(&self.member);
        Some((side, to, Message::Fence { line_digest, fence }))
    }

    /// Returns the next pending message of a view change, a lease renewal or an agreement on positions.
    ///
    /// The result includes the side and the destination node. `None` if no message is pending.
    fn next_of_a_round(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let (onward, back) = (self.onward(), self.back());
        let peer = |side| {
            let neighbour = self.layers.neighbours.at(side);
            // A lost neighbour gets no retransmissions until this relay receives it again.
            (neighbour.is_mutual() && !neighbour.is_silent())
                .then_some((neighbour.node(), neighbour.is_agreed()))
        };
        let (next, before) = (peer(onward), peer(back));
        let context = self.layers.context(now, &self.member);
        let layers = &mut self.layers;
        // A proposal is not sent while there is no next relay.
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
