//! Outcome of a simulated run.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use uav_relay::sensing::estimate::NumberedEstimate;
use uav_relay::{Duration, Instant, Placement, Profile, Side, Sites, SlotShares, Stats};

use super::attack::AttackCounts;
use super::drones::{Nearest, Point};
use super::faults::Injected;
use super::medium::AirCounts;
use super::observed::ObservedState;
use super::rotation::Rotated;
use super::route::Track;
use super::true_interference::Snapshot;

/// Kind of an event in the log of a run, about one relay. If the event concerns a second node, [`Moment::other`] is
/// that node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TimelineEvent {
    /// The relay was switched off: it neither sends nor receives.
    Silent,
    /// The relay was switched on again.
    Booted,
    /// The relay lost its neighbour at this side, toward Tx or toward Rx.
    Lost(Side),
    /// A lost or a new neighbour is received at this side of the relay, toward Tx or toward Rx.
    Found(Side),
    /// The relay accepted a new view: a new membership of the chain.
    ViewAccepted {
        /// Number of the accepted view.
        view: u32,
        /// Index of the relay in the accepted view, from 1 next to Tx.
        index: u16,
        /// Number of relays in the accepted view.
        relays: u16,
        /// Version of the relay's mission.
        version: u16,
    },
    /// The relay found that too few relays reach each other for a quorum, so no view can form.
    NoQuorum,
    /// The relay's lease expired: the relay may no longer rely on the last agreement on positions.
    LeaseLapsed,
    /// A node reports that it does not receive this relay.
    NotHeard,
    /// The relay found that a second node has a different mission.
    MissionMismatch,
    /// The relay found that a node does not sign its frames with the relay's key.
    KeyMismatch,
    /// The relay found that a node's epoch, the counter of that node's starts, went back.
    EpochWentBack,
    /// Two nodes use the same index, given in [`Moment::other`]. It is this relay's index or a neighbour's.
    DuplicateIndex,
    /// The chain agreed on positions, and this relay accepted its position.
    Converged,
    /// The leader found that the chain can meet no target SIR.
    Infeasible,
    /// A partition begins between this relay and the next relay toward Rx.
    Partitioned,
    /// The partition between this relay and the next relay toward Rx ends.
    PartitionEnded,
    /// The relay stops receiving the node [`Moment::other`].
    Deaf,
    /// The relay receives the node [`Moment::other`] again.
    Hears,
    /// A ground station offers a mission of this version. [`Moment::relay`] is 0 for the station at Tx, and the number
    /// of relays plus 1 for the station at Rx.
    Offered(u16),
    /// The relay stored an uploaded mission of this version.
    Uploaded(u16),
    /// The relay adopted the mission of this version, together with all members of its view.
    Adopted(u16),
    /// The relay's setpoint controls its drone from now on: the pilot has handed the drone over.
    Engaged,
    /// The relay's setpoint no longer controls the drone: the pilot or the autopilot alone flies it.
    Released,
    /// The autopilot no longer reports the position of the relay's drone.
    Blind,
    /// The autopilot of the relay's drone was restarted.
    Restarted,
    /// The relay's estimate of the interference changed.
    NewEstimate,
    /// The relay found that the measurements do not fit a single interferer.
    InterfererUnclear,
    /// The relay found that the measurements of one node do not fit those of the remaining nodes.
    SensorOff,
    /// The relay is outside of the chain, and its drone may fly away.
    MayLeave,
    /// The relay's drone has to fly home. Logged at each new value of the remaining endurance that requires this.
    MustLeave,
    /// The relay informed a node outside of the chain that its drone may fly away.
    MayLeaveTold,
}

/// Entry in the log of a run: an event at one node.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// Time of the event in the run.
    pub at: Instant,
    /// Number of the node that the entry is about: 0 for Tx, then the relays from 1, then Rx.
    pub relay: u16,
    /// Kind of the event, with its data.
    pub what: TimelineEvent,
    /// Number, from 1, of a second node that the event concerns, such as a lost neighbour.
    pub other: Option<u16>,
    /// Linear target SIR of the relay's position at this time; `None` without a target.
    pub target: Option<f32>,
    /// Number of passes and view proposals that the relay has begun until this time.
    ///
    /// A pass is a message that relays forward along the whole chain.
    pub sweeps: u32,
}

/// Reason for the end of a simulated run.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Ending {
    /// The relays of the chain all have positions, computed for the same target SIR.
    Settled,
    /// The leader found that the chain can meet no target SIR.
    Infeasible,
    /// A relay with separate links was switched off, and its living neighbours have reported the loss.
    Broken,
    /// Every group of relays that receive each other is too small for a quorum.
    NoQuorum,
    /// The fixed end of the run or its last measurement of the interference was reached. See
    /// [`Setup::soak`](super::setup::Setup::soak).
    Soaked,
    /// The deadline of the run, or the limit on its number of events, was reached.
    #[default]
    OutOfTime,
}

/// State of a relay at the end of a run.
#[derive(Clone, Debug)]
pub struct RelayEnd {
    /// Setpoint of the relay; `None` if it never had one.
    pub setpoint: Option<Placement>,
    /// Linear target SIR of the setpoint; `None` without a target.
    pub target: Option<f32>,
    /// Upper bound, linear, on the worst hop's SIR at the relays' altitudes, for any x. Known only at the leader,
    /// otherwise `None`.
    pub bound: Option<f32>,
    /// Fitted slots (as long as each hop needs) of the hops next to the relay; `None` with equal slots.
    pub slot_shares: Option<SlotShares>,
    /// Altitude and transmit power of the relay.
    pub profile: Profile,
    /// Counters of the relay since its last start.
    pub stats: Stats,
    /// Time when the relay was switched off; `None` if it is on.
    pub killed: Option<Instant>,
    /// Index of the relay in its view (membership of the chain), from 1 next to Tx.
    pub index: u16,
    /// Number of relays in the relay's view (membership of the chain).
    pub relays: u16,
    /// Number of the view (membership of the chain) that the relay has accepted.
    pub view: u32,
    /// Version of the relay's mission; 0 for the mission loaded before the start.
    pub version: u16,
    /// Interference estimate that the relay used at the end of the run.
    pub believed: NumberedEstimate,
    /// Geographic positions of Tx and Rx in the relay's mission; `None` unless an upload has moved them.
    pub sites: Option<Sites>,
    /// Phase, view and lease of the relay. The run's statistics, such as the availability, are computed from these
    /// states.
    pub observed: ObservedState,
}

/// Availability of the chain over a whole run.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Watched {
    /// Time when all relays of a view (membership of the chain) first had agreed positions. `None` if they never had.
    pub first_agreement: Option<Instant>,
    /// Fraction, 0 to 1, of the time since the first agreed positions in which the chain was available.
    ///
    /// The chain is available while the longest chain that the living relays can form is at the positions that it would
    /// reach in a run without faults. `None` unless the run has a fixed end.
    pub availability: Option<f64>,
    /// Longest outage since the first agreement on positions: a time in which the chain was not available.
    ///
    /// `None` unless the run has a fixed end.
    pub longest_wrong: Option<Duration>,
    /// Largest number of relay groups that flew at the same time by separate agreements on positions.
    pub most_flying: usize,
    /// Minimum distance between two relays during the run, m. The distance is between their drones if drones are
    /// simulated, otherwise between their setpoints.
    pub least_separation_m: Option<f64>,
}

/// Outcome of a simulated run.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Reason for the end of the run.
    pub ending: Ending,
    /// State of each relay at the end, from relay 1.
    pub relays: Vec<RelayEnd>,
    /// Linear SIR of the chain before the first round of Algorithm 2, and after each round. In a round of this
    /// algorithm each relay in turn improves its position.
    pub rounds: Vec<f32>,
    /// Number of passes (messages forwarded along the whole chain) and view proposals that relays began.
    pub sweeps: u32,
    /// Number of frames sent on all links.
    pub messages: u64,
    /// Number of bytes sent on all links.
    pub bytes: u64,
    /// Virtual time when the run ended.
    pub ended: Instant,
    /// Record of the replacements of drones; `None` if the run replaces no drones.
    pub rotated: Option<Rotated>,
    /// Counts of the frame faults that the links caused.
    pub injected: Injected,
    /// Counts of the attacker's frames by how relays classified them.
    pub attack_counts: AttackCounts,
    /// Neighbours that relays report as lost at the end of the run, with the time of the report.
    ///
    /// The key is the reporting relay's number from 1, and the side of the lost neighbour.
    pub noticed: BTreeMap<(u16, Side), Instant>,
    /// Log of the run: its events with their times.
    pub moments: Vec<Moment>,
    /// Closest approach of two flying drones; `None` if no flight was simulated.
    pub nearest: Option<Nearest>,
    /// Closest approach of two drones with autopilots, in flight and without a pilot's control. `None` if there were
    /// never two such drones at the same time.
    pub nearest_lent: Option<Nearest>,
    /// Smallest margin during the run, m: the distance of two drones minus the required distance.
    ///
    /// Only drones in flight that no pilot controls count. The required distance of two drones is the mission's
    /// separation or their distance at the last handover by their pilots, whichever is smaller. Infinite if no pair
    /// counted.
    pub margin_m: f64,
    /// Relays that forward data at each time step: number from 1, and true position of the drone.
    ///
    /// Recorded for drones without autopilots if [`Setup::track`](super::setup::Setup::track) is set. Included are the
    /// living relays with a setpoint, except spares and relays that may leave.
    pub serving: Vec<(Instant, Vec<(u16, Point)>)>,
    /// Two drones, their distance, and the time of the smallest margin, `margin_m`.
    pub margin_at: Option<Nearest>,
    /// Number of position targets that relays sent while the autopilot accepts none, such as on the ground.
    ///
    /// Targets up to 1.5 s after a change of the autopilot's flight mode or state do not count. Nonzero is a bug.
    pub stray_targets: u64,
    /// Final position of each drone with an autopilot, and a flag: true if the relay controls the drone.
    ///
    /// The position is relative to the line Tx-Rx of the relay's mission. An upload of a mission may move this line.
    pub fleet: Vec<(Point, bool)>,
    /// Number of setpoints outside of the mission's limits. Nonzero is a bug.
    pub unsafe_setpoints: u64,
    /// Counters of the shared radio channel; all 0 without such a channel.
    pub air: AirCounts,
    /// Availability of the chain; `None` unless the run has a fixed end or a shared channel.
    pub watched: Option<Watched>,
    /// Snapshots of the relays' positions, one at each measurement of the interference.
    pub snapshots: Vec<Snapshot>,
    /// Record of the run for an animation, if [`Setup::film`](super::setup::Setup::film) was set.
    pub film: Option<Film>,
    /// States of the relays over time, for the data traffic. `None` unless `Setup::track` was set.
    pub track: Option<Track>,
}

impl Outcome {
    /// Returns the smallest distance between two drones in the run, m; infinite if no flight was simulated.
    pub fn nearest_m(&self) -> f64 {
        self.nearest
            .map_or(f64::INFINITY, |nearest| nearest.apart_m)
    }

    /// Returns the bit patterns of the setpoints (x, y, altitude), for the exact comparison of two runs.
    ///
    /// `None` for a relay without a setpoint.
    pub fn bits(&self) -> Vec<Option<[u32; 3]>> {
        let bits = |place: Placement| [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits);
        let places = self.relays.iter().map(|relay| relay.setpoint);
        places.map(|place| place.map(bits)).collect()
    }

    /// Returns the version of the newest mission that a ground station offered; `None` without uploads.
    pub fn offered(&self) -> Option<u16> {
        let versions = self.moments.iter().filter_map(|moment| match moment.what {
            TimelineEvent::Offered(version) => Some(version),
            _ => None,
        });
        versions.max()
    }
}

/// State of a relay after a change, for the animation of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shot {
    /// Time at which the relay's state changed.
    pub at: Instant,
    /// Number of the relay whose state changed, from 1.
    pub relay: u16,
    /// True while the relay is switched on.
    pub is_on: bool,
    /// Setpoint of the relay; `None` if it has never had a setpoint. A relay that is switched off keeps its last
    /// setpoint.
    pub place: Option<Placement>,
    /// Number of frames sent on all links until this time.
    pub messages: u64,
}

/// Transmission of a frame, for the animation of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Transmission {
    /// Time at which the relay gave the frame to its port for transmission.
    pub at: Instant,
    /// Number of the sending relay, from 1.
    pub relay: u16,
    /// Side to which the relay sends, toward Tx or toward Rx; `None` on a shared channel.
    pub to: Option<Side>,
}

/// Record of a whole run for an animation.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Film {
    /// Changes of the relays' states, in order of time.
    pub shots: Vec<Shot>,
    /// Transmitted frames, in order of time.
    pub sent: Vec<Transmission>,
}

/// Link on which a frame was sent.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Link {
    /// Radio channel that all nodes share.
    Shared,
    /// Link between the node with this number and the next node toward Rx. Tx is node 0.
    After(u16),
}

/// Frame that a node sent, for a capture file.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct OnAir {
    /// Time when the last bit of the frame was sent.
    pub at: Instant,
    /// Sequence number of the frame, which sorts frames that end at the same time.
    order: u64,
    /// Link on which the frame was sent.
    pub link: Link,
    /// Bytes of the frame as sent, before faults change them.
    pub bytes: Vec<u8>,
    /// Description of the faults of the frame; empty if all receivers got it intact and in time.
    pub note: String,
}

/// Sent frames that have been recorded and not yet taken.
#[derive(Debug, Default)]
pub struct Record {
    frames: BinaryHeap<Reverse<OnAir>>,
    order: u64,
}

impl Record {
    /// Adds a frame whose last bit was sent at `at`. `note` describes the faults of the frame.
    pub fn put(&mut self, at: Instant, link: Link, bytes: &[u8], note: String) {
        self.frames.push(Reverse(OnAir {
            at,
            order: self.order,
            link,
            bytes: bytes.to_vec(),
            note,
        }));
        self.order += 1;
    }

    /// Removes and returns the frames whose last bit was sent at `until` or earlier, in order of time.
    pub fn take(&mut self, until: Instant) -> Vec<OnAir> {
        let mut over = Vec::new();
        while let Some(Reverse(next)) = self.frames.peek()
            && next.at <= until
        {
            over.extend(self.frames.pop().map(|Reverse(frame)| frame));
        }
        over
    }
}
