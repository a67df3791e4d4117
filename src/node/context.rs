//! State that every layer receives, effects of one layer on the other layers, and common durations.

use crate::features::ALTITUDE;
use crate::mission::{Band, Interference, Mission};
use crate::node::circulation::Path;
use crate::place::Placement;
use crate::settings::{Method, Settings};
use crate::side::{Heading, Side};
use crate::time::{Duration, Instant};
use crate::view::ViewId;
use crate::wire::digest::{MissionId, digest};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// Mission that this relay flies now. The number of its relays is the number of members of the accepted view (list
    /// of the chain's members).
    pub(crate) mission: Mission,
    /// Interference as configured in the active mission, not as estimated from measurements.
    pub(crate) interference: Interference,
    pub(crate) settings: Settings,
    /// Node number of this relay: 1 is the relay next to Tx.
    pub(crate) node: u16,
    /// Number of relays in the mission loaded before flight.
    pub(crate) all: u16,
    /// Digest (16-bit checksum) of the mission loaded before flight.
    pub(crate) digest: u16,
    /// Identifier of the mission that this relay flies now.
    pub(crate) active: MissionId,
    /// Identifier of the view that this relay accepted last. A view is the agreed list of the chain's members.
    pub(crate) view: ViewId,
    /// Index of this relay among the members of the view, counted from 1 at Tx.
    pub(crate) index: u16,
}

impl Member {
    pub(crate) fn new(mission: Mission, settings: Settings, node: u16) -> Self {
        let digest = digest(&mission);
        Self {
            settings,
            node,
            all: mission.relays(),
            digest,
            active: MissionId { version: 0, digest },
            view: ViewId::LOADED,
            index: node,
            interference: *mission.interference(),
            mission,
        }
    }

    /// Returns this relay's rank in the mission loaded before flight, and the number of relays in it. Rank 1 is that of
    /// the leader. View changes alter neither number.
    pub(crate) const fn rank_in_all(&self) -> (u16, u16) {
        let place = match self.mission.heading() {
            Heading::TowardRx => self.node,
            Heading::TowardTx => self.relays_to_end(Side::Downstream),
        };
        (place, self.all)
    }

    /// Returns the number of relays from this relay (included) to the end of the chain at `side`.
    pub(crate) const fn relays_to_end(&self, side: Side) -> u16 {
        match side {
            Side::Upstream => self.node,
            Side::Downstream => self.all.saturating_sub(self.node).saturating_add(1),
        }
    }

    /// Returns the node `distance` numbers away at `side`.
    pub(crate) const fn beyond(&self, side: Side, distance: u16) -> u16 {
        match side {
            Side::Upstream => self.node.saturating_sub(distance),
            Side::Downstream => self.node.saturating_add(distance),
        }
    }

    /// Returns the node of the ground station at `side`.
    pub(crate) const fn station(&self, side: Side) -> u16 {
        self.beyond(side, self.relays_to_end(side))
    }

    pub(crate) const fn is_relay(&self, node: u16) -> bool {
        node >= 1 && node <= self.all
    }

    /// Returns true if the view keeps a quorum without its members `nodes`, or needs none. A node
    /// number of 0 does not count.
    pub(crate) fn keeps_quorum_without(&self, nodes: &[u16]) -> bool {
        let relays = self.mission.relays();
        let known = nodes.iter().filter(|node| **node != 0);
        let left = known.fold(relays, |left, _| left.saturating_sub(1));
        let proposer = match self.view {
            ViewId::LOADED => self.mission.leader(),
            view => view.proposer(),
        };
        let weight = 2 * left + u16::from(!nodes.contains(&proposer));
        left >= 1 && (!self.settings.quorum || weight > relays)
    }

    /// Returns a digest of the active mission and the accepted view. Every message of an agreement on positions
    /// contains it.
    pub(crate) const fn pass_digest(&self) -> u16 {
        self.active.digest.wrapping_add(self.view.mark())
    }
}

/// State of the relay that every protocol layer receives as an argument.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) now: Instant,
    pub(crate) member: &'a Member,
    /// Identifier of the newest mission that this relay has stored. The stored mission can be newer than the active
    /// one.
    pub(crate) latest: MissionId,
    /// True if this relay is the last one that the leader reaches.
    ///
    /// It has no neighbour on the side away from the leader. The view can have further members.
    pub(crate) is_last_reachable: bool,
    /// Remaining lease times of other relays. Until these leases have ended, no relay may use the positions of a new
    /// view.
    pub(crate) other_leases: OtherLeases,
}

impl<'a> Context<'a> {
    pub(crate) const fn mission(&self) -> &'a Mission {
        &self.member.mission
    }

    pub(crate) const fn settings(&self) -> &'a Settings {
        &self.member.settings
    }

    pub(crate) const fn index(&self) -> u16 {
        self.member.index
    }

    pub(crate) const fn digest(&self) -> u16 {
        self.member.pass_digest()
    }

    /// Returns true if every relay itself computes the positions of the whole chain (joint method).
    ///
    /// The settings must select the joint method. The relays must be free to choose a lateral offset or an altitude, or
    /// the mission must have fitted slots. Fitted slots are time slots that are as long as each hop needs.
    pub(crate) fn solves_jointly(&self) -> bool {
        let config = self.mission().config();
        let is_line = config.band.is_single() && config.lateral.is_single();
        let free = !is_line || self.mission().fitted_gap() > 0.0;
        ALTITUDE && self.settings().method == Method::Joint && free
    }

    /// Returns the maximum duration of a lease, in tenths of a second.
    pub(crate) fn longest_lease(&self) -> u16 {
        tenths(longest_lease(self.settings()))
    }

    /// Returns true if this relay is the leader of the accepted view.
    pub(crate) fn leads_view(&self) -> bool {
        self.index() == self.mission().leader()
    }

    /// Returns true if this relay is the last member of the accepted view. The first member is the leader.
    pub(crate) fn is_last_of_view(&self) -> bool {
        self.mission().after(self.index()).is_none()
    }

    pub(crate) fn path_to_last(&self) -> Path {
        let mission = self.mission();
        self.path(match mission.heading() {
            Heading::TowardRx => mission.relays().saturating_sub(self.index()),
            Heading::TowardTx => self.index().saturating_sub(1),
        })
    }

    pub(crate) fn path_to_leader(&self) -> Path {
        let relays = self.mission().relays();
        self.path(
            relays
                .saturating_sub(self.path_to_last().hops)
                .saturating_sub(1),
        )
    }

    /// Returns a path of `hops` hops, along which relays forward messages at once, without computing first.
    pub(crate) const fn path(&self, hops: u16) -> Path {
        Path {
            hop_time: self.member.settings.hop_time,
            hops,
            slow: false,
        }
    }

    /// Returns true if `place` is between Tx and Rx along x.
    pub(crate) fn is_between(&self, place: Placement) -> bool {
        (0.0..=self.mission().config().distance_m).contains(&place.x_m)
    }

    /// Returns the range of altitudes that this relay may use, m. If its altitude is fixed, the range is the single
    /// value `altitude_m`.
    pub(crate) fn band(&self, altitude_m: f32) -> Band {
        if self.settings().hold_altitude {
            Band::at(altitude_m)
        } else {
            self.mission().config().band
        }
    }
}

/// Remaining lease times of other relays, as far as this relay knows. A relay may use agreed positions during its own
/// lease.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct OtherLeases {
    /// Upper bound of the remaining lease time of the other members of `view`. This relay knows the bound, because
    /// every lease renewal passes through it.
    pub(crate) lease_left: Duration,
    /// View that this relay accepted last.
    pub(crate) view: ViewId,
    /// Longest remaining lease time from a view before `view`. `None` if unknown: some member has possibly not accepted
    /// `view` yet.
    pub(crate) earlier_lease_left: Option<Duration>,
}

impl OtherLeases {
    #[cfg(test)]
    pub(crate) const NONE: Self = Self {
        lease_left: Duration::from_micros(0),
        view: ViewId::LOADED,
        earlier_lease_left: Some(Duration::from_micros(0)),
    };

    /// Returns the time until all leases of views before `view` have ended, in tenths of a second. `u16::MAX` if
    /// unknown.
    pub(crate) fn earlier_lease_tenths(self, view: ViewId) -> u16 {
        if view == ViewId::LOADED {
            0
        } else {
            let known = self.earlier_lease_left.filter(|_| view == self.view);
            known.map_or(u16::MAX, tenths)
        }
    }
}

/// State that this relay reports about itself.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OwnState {
    /// Number of the state in an entry, without the control state.
    pub(crate) state: u16,
    /// [Refusals](crate::wire::message::Entry::refusal) toward Tx and toward Rx.
    pub(crate) refusals: [u16; 2],
    pub(crate) setpoint: Option<Placement>,
    pub(crate) agreed: Option<Placement>,
}

/// Results of one protocol layer's step, for the other layers and the firmware.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is one thing that happened or did not"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Effects {
    /// Reason why the received message was ignored; `None` if it was not ignored.
    pub(crate) ignored: Option<Ignored>,
    /// True if this step scheduled a retransmission of a message.
    pub(crate) resent: bool,
    /// True if this step started a view proposal, or a new message along the chain.
    pub(crate) began: bool,
    /// True if this step has found that a new view (list of the chain's members) is needed.
    pub(crate) view_needed: bool,
    /// Neighbour that has replied to a message of this relay, and the transmission time of this message. The neighbour
    /// was alive after that time. `None` without a reply.
    pub(crate) alive: Option<(Peer, Instant)>,
    /// Origin of the view proposal received or made in this step; `None` without a proposal.
    pub(crate) proposed_by: Option<Proposer>,
    /// True while a view proposal awaits its decision. The relays then forward no other message along the chain.
    pub(crate) view_proposed: bool,
    pub(crate) event: Option<LayerEvent>,
    /// Changes of the interference estimate and of the list of faulty interference sensors.
    pub(crate) sensed: Sensed,
}

/// Reason why a received message was ignored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Ignored {
    Stale,
    Duplicate,
}

/// Previous or next relay. The order is from the leader to the last relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Peer {
    Next,
    Previous,
}

/// Event in the result of one protocol layer's step.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LayerEvent {
    /// The relays of the chain have all agreed on their positions.
    Converged,
    /// The leader has found no feasible target SIR.
    Infeasible,
    /// Expiry of this relay's lease. Relays of a later view may already use different positions.
    Lapsed,
    /// The next hello to the neighbour toward the leader must request a new view.
    RequestView,
    /// A view proposal has been decided.
    ProposalDecided(ProposalOutcome),
}

/// Changes of the interference estimate and of the faulty sensors after a new measurement.
///
/// The node uses a changed estimate, and reports the other changes to the firmware.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Sensed {
    /// True if the interference estimate has changed.
    pub(crate) new_estimate: bool,
    /// True if no single interferer explains the measurements.
    pub(crate) unclear: bool,
    /// Node whose measurements contradict those of the other nodes, found in this step. `None` without such a finding.
    pub(crate) faulty_sensor: Option<u16>,
}

/// Decision on a view proposal.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ProposalOutcome {
    /// Accepted: the view has `relays` members.
    ///
    /// Its positions may be used after `usable_in` tenths of a second, when older leases have ended.
    Granted { relays: u16, usable_in: u16 },
    /// An earlier decision on a different view is accepted instead. The leader then proposes a successor of the
    /// accepted view. `view` is that view if this relay was polled in it; `usable_in` is as in `Granted`.
    Superseded {
        view: Option<ViewId>,
        usable_in: u16,
    },
    /// Rejected: too few relays are reachable for a quorum.
    NoQuorum,
}

/// Origin of a view proposal: this relay itself, or the neighbour that sent it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Proposer {
    Itself,
    Neighbour,
}

impl Effects {
    pub(crate) const NONE: Self = Self {
        ignored: None,
        resent: false,
        began: false,
        view_needed: false,
        alive: None,
        proposed_by: None,
        view_proposed: false,
        event: None,
        sensed: Sensed {
            new_estimate: false,
            unclear: false,
            faulty_sensor: None,
        },
    };

    pub(crate) const STALE: Self = Self {
        ignored: Some(Ignored::Stale),
        ..Self::NONE
    };

    pub(crate) const DUPLICATE: Self = Self {
        ignored: Some(Ignored::Duplicate),
        ..Self::NONE
    };

    /// Effects of a message from a view other than this relay's. The message is ignored, and a new view is requested.
    pub(crate) const FOREIGN: Self = Self {
        view_needed: true,
        ..Self::STALE
    };

    pub(crate) const fn of(event: LayerEvent) -> Self {
        Self {
            event: Some(event),
            ..Self::NONE
        }
    }

    /// Returns these effects with `proposer` as the origin of the view proposal.
    pub(crate) const fn by(self, proposer: Proposer) -> Self {
        Self {
            proposed_by: Some(proposer),
            ..self
        }
    }
}

/// Pause between two steps of a long computation. During the pause the firmware's main loop can do other work.
pub(crate) const PAUSE: Duration = Duration::from_micros(250);

/// Maximum duration of a lease, in units of `dead_after`.
const MAX_LEASE: u32 = 8;

pub(crate) const fn longest_lease(settings: &Settings) -> Duration {
    settings.dead_after.times(MAX_LEASE)
}

/// Returns the duration of the motion to a newly agreed position.
pub(crate) const fn respacing(settings: &Settings) -> Duration {
    #[cfg(feature = "departures")]
    return settings.respacing;
    #[cfg(not(feature = "departures"))]
    return settings.dead_after.times(0);
}

/// Returns the number of relays that the leader keeps in the chain; 0 for no such number.
pub(crate) const fn flying(settings: &Settings) -> u16 {
    #[cfg(feature = "departures")]
    return settings.flying;
    #[cfg(not(feature = "departures"))]
    {
        _ = settings;
        0
    }
}

/// Returns the maximum time from the leader's first message along the chain until its result returns.
///
/// The chain has `all` relays, and loses half of its frames.
pub(crate) fn first_pass(settings: &Settings, all: u16) -> Duration {
    settings.hop_time.times(24 * u32::from(all))
}

/// Converts a duration to tenths of a second, rounded up.
#[inline(never)] // called from several places
pub(crate) fn tenths(span: Duration) -> u16 {
    // Uses 32-bit words: the 64-bit division, which nothing else in a relay needs, takes 900 bytes of flash.
    let micros = u32::try_from(span.as_micros().div_ceil(32)).unwrap_or(u32::MAX);
    u16::try_from(micros.div_ceil(3_125)).unwrap_or(u16::MAX)
}

/// Returns the earlier of two times; `None` counts as later than any time.
pub(crate) fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    [a, b].into_iter().flatten().min()
}
