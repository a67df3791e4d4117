//! Outcome of a simulated run.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use uav_relay::sensing::estimate::NumberedEstimate;
use uav_relay::{Duration, Instant, Placement, Profile, Side, Sites, Stats};

use super::attack::Struck;
use super::drones::{Nearest, Point};
use super::faults::Injected;
use super::medium::AirCounts;
use super::route::Track;
use super::true_interference::Stand;
use super::watch::Seen;

/// Kind of a log entry about a relay; "the other node" is [`Moment::other`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TimelineEvent {
    /// The relay went silent.
    Silent,
    /// The relay was switched on again.
    Booted,
    /// The relay lost its neighbour at that side.
    Lost(Side),
    /// The relay receives its lost neighbour, or a new neighbour, at this side.
    Found(Side),
    /// The relay accepted a new view.
    ViewAccepted {
        /// Number of the view.
        view: u32,
        /// Index of the relay in the view, from 1 at Tx.
        index: u16,
        /// Number of relays in the view.
        relays: u16,
        /// Version of the mission.
        version: u16,
    },
    /// The relay's part of the chain has no quorum.
    NoQuorum,
    /// The relay's lease expired.
    LeaseLapsed,
    /// Another node reports that it does not receive the relay.
    NotHeard,
    /// Another node has a different mission.
    MissionMismatch,
    /// Another node signs with a different key.
    KeyMismatch,
    /// Another node's epoch went back.
    EpochWentBack,
    /// Two nodes use the index [`Moment::other`], which is this relay's or a neighbour's.
    DuplicateIndex,
    /// The relay accepted its position in an agreement.
    Converged,
    /// The leader found that the chain can meet no target SIR.
    Infeasible,
    /// A partition begins between this relay and the next relay toward Rx.
    Partitioned,
    /// The partition between this relay and the next relay toward Rx ends.
    PartitionEnded,
    /// The relay stops receiving another node.
    Deaf,
    /// The relay receives another node again.
    Hears,
    /// A ground station offers a mission of this version. Tx counts as relay 0, Rx as the relay after the last.
    Offered(u16),
    /// The relay stored an uploaded mission of this version.
    Uploaded(u16),
    /// The relay adopted the mission of this version, together with all members of its view.
    Adopted(u16),
    /// The relay's setpoint controls its drone from now on.
    Engaged,
    /// The relay's setpoint no longer controls its drone: the pilot, or the autopilot alone, flies it.
    Released,
    /// The position of the relay's drone is unknown.
    Blind,
    /// The autopilot of the relay's drone was restarted.
    Restarted,
    /// The relay's estimate of the interference changed.
    NewEstimate,
    /// The measurements do not fit a single interferer.
    InterfererUnclear,
    /// The measurements of another node contradict the measurements of all other nodes.
    SensorOff,
}

/// Log entry of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// Time of the entry.
    pub at: Instant,
    /// Relay number, from 1.
    pub relay: u16,
    /// Kind of the entry.
    pub what: TimelineEvent,
    /// Node that the entry is about, from 1: a lost or found neighbour, a relay that is not received, ...
    pub other: Option<u16>,
    /// Target SIR of the relay's position, linear.
    pub target: Option<f32>,
    /// Number of sweeps that the relay has begun until this time.
    pub sweeps: u32,
}

/// Reason for the end of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Ending {
    /// Every relay holds its position for the same target.
    Settled,
    /// The leader found that no target can be met.
    Infeasible,
    /// Relays went silent, and all their neighbours have noticed.
    Broken,
    /// Each part of the chain lacks a quorum.
    NoQuorum,
    /// The planned end ([`Setup::soak`](super::setup::Setup::soak), or of the measurements) was reached.
    Soaked,
    /// The deadline or the event limit was reached.
    #[default]
    OutOfTime,
}

/// Final state of a relay.
#[derive(Clone, Debug)]
pub struct RelayEnd {
    /// Setpoint, if any.
    pub setpoint: Option<Placement>,
    /// Target SIR of that setpoint, linear.
    pub target: Option<f32>,
    /// Upper bound on the SIR of any chain, linear, at the leader.
    pub bound: Option<f32>,
    /// Profile of the relay.
    pub profile: Profile,
    /// Counters of the relay.
    pub stats: Stats,
    /// Time of its failure; `None` if it is on.
    pub killed: Option<Instant>,
    /// Index of the relay in its view, from 1 at Tx.
    pub index: u16,
    /// Number of relays in the view.
    pub relays: u16,
    /// Number of the view.
    pub view: u32,
    /// Version of its mission.
    pub version: u16,
    /// Interference estimate of the relay.
    pub believed: NumberedEstimate,
    /// Sites of the relay's mission; `None` for those loaded before take-off.
    pub sites: Option<Sites>,
    /// Observed state.
    pub seen: Seen,
}

/// Statistics over the whole run.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Watched {
    /// Time of the first agreement: all relays of a view hold their positions.
    pub first_agreement: Option<Instant>,
    /// Share of the time after the first agreement in which a longest possible chain held its optimum.
    pub availability: Option<f64>,
    /// Longest time after the first agreement without a longest possible chain at its optimum.
    pub longest_wrong: Option<Duration>,
    /// Largest number of groups that held separate agreements at the same time.
    pub most_flying: usize,
    /// Smallest distance of two relays, m.
    pub least_separation_m: Option<f64>,
}

/// Outcome of a run.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Reason for the end of the run.
    pub ending: Ending,
    /// Final states of the relays, from relay 1.
    pub relays: Vec<RelayEnd>,
    /// SIR of the chain before the first and after each round of Algorithm 2, linear.
    pub rounds: Vec<f32>,
    /// Forward passes along the chain.
    pub sweeps: u32,
    /// Frames sent on all links.
    pub messages: u64,
    /// Bytes sent on all links.
    pub bytes: u64,
    /// End time of the run.
    pub ended: Instant,
    /// Injected faults.
    pub injected: Injected,
    /// Classification of the attacker's frames.
    pub struck: Struck,
    /// Neighbours missing at the end: observer's index (from 1) and side, with the time of the loss.
    pub noticed: BTreeMap<(u16, Side), Instant>,
    /// Log of the run.
    pub moments: Vec<Moment>,
    /// Closest approach of two drones, if their flight was simulated.
    pub nearest: Option<Nearest>,
    /// Closest approach of two drones with autopilots, neither in its pilot's hands.
    pub nearest_lent: Option<Nearest>,
    /// Smallest separation margin, m, of two drones that no pilot flies; infinite if there were none.
    ///
    /// The margin is the distance less the smaller of the required separation and the distance at their last hand-over.
    pub margin_m: f64,
    /// Closest approach with that margin.
    pub margin_at: Option<Nearest>,
    /// Targets that an autopilot received well after it reported a state in which none may be sent. Nonzero is a bug.
    pub stray_targets: u64,
    /// Final positions of the drones with autopilots along their relay's line; true if the relay flies it.
    pub fleet: Vec<(Point, bool)>,
    /// Setpoints outside their limits. Nonzero is a bug.
    pub unsafe_setpoints: u64,
    /// Counters of the shared channel.
    pub air: AirCounts,
    /// Statistics over the whole run, for soaks and shared channels.
    pub watched: Option<Watched>,
    /// Snapshots of the positions at each measurement.
    pub stands: Vec<Stand>,
    /// Film of the run, if [`Setup::film`](super::setup::Setup::film) was set.
    pub film: Option<Film>,
    /// States of the relays for the traffic, if [`Setup::track`](super::setup::Setup::track) was set.
    pub track: Option<Track>,
}

impl Outcome {
    /// Returns the smallest distance of two drones, m; infinite if their flight was not simulated.
    pub fn nearest_m(&self) -> f64 {
        self.nearest
            .map_or(f64::INFINITY, |nearest| nearest.apart_m)
    }

    /// Returns the bit patterns of the setpoints (x, y, altitude); `None` for a relay without one.
    pub fn bits(&self) -> Vec<Option<[u32; 3]>> {
        let bits = |place: Placement| [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits);
        let places = self.relays.iter().map(|relay| relay.setpoint);
        places.map(|place| place.map(bits)).collect()
    }

    /// Returns the newest mission version that the ground has offered.
    pub fn offered(&self) -> Option<u16> {
        let versions = self.moments.iter().filter_map(|moment| match moment.what {
            TimelineEvent::Offered(version) => Some(version),
            _ => None,
        });
        versions.max()
    }
}

/// Changed state of a relay.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shot {
    /// Time of the change.
    pub at: Instant,
    /// Relay number, from 1.
    pub relay: u16,
    /// True while the relay is switched on.
    pub is_on: bool,
    /// Setpoint, if any; a relay that is switched off keeps its last one.
    pub place: Option<Placement>,
    /// Number of frames sent on all links until this time.
    pub messages: u64,
}

/// Transmission of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Transmission {
    /// Time of the transmission.
    pub at: Instant,
    /// Relay number, from 1.
    pub relay: u16,
    /// Direction of the transmission; `None` on a shared channel.
    pub to: Option<Side>,
}

/// Film of a whole run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Film {
    /// State changes, in order of time.
    pub shots: Vec<Shot>,
    /// Transmissions, in order of time.
    pub sent: Vec<Transmission>,
}

/// Link of a frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Link {
    /// The shared channel.
    Shared,
    /// Link between this node and the next node toward Rx; Tx is node 0.
    After(u16),
}

/// Transmitted frame.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct OnAir {
    /// Time of its last bit.
    pub at: Instant,
    /// Order of transmission, for frames that end at the same time.
    order: u64,
    /// Link of the frame.
    pub link: Link,
    /// Bytes as sent.
    pub bytes: Vec<u8>,
    /// Faults on the path; empty if all receivers got the frame intact and in time.
    pub note: String,
}

/// Recorded frames that were not read yet.
#[derive(Debug, Default)]
pub struct Record {
    frames: BinaryHeap<Reverse<OnAir>>,
    order: u64,
}

impl Record {
    /// Adds a frame.
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

    /// Removes and returns the frames that ended by `until`.
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
