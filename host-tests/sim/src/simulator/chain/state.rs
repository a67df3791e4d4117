//! The state of a run: its relays, the ground, the drones, and what is still to happen.

use rand_chacha::ChaCha8Rng;
use uav_relay::Upload;
use uav_relay::{Instant, Placement, Relay};

use super::super::attack::Attacker;
use super::super::bursts::Bursts;
use super::super::drones::Flight;
use super::super::fleet::Vehicle;
use super::super::link::Line;
use super::super::medium::Medium;
use super::super::outcome::Outcome;
use super::super::queue::Queue;
use super::super::record::Record;
use super::super::setup::Setup;
use super::super::watch::Watch;
use super::station::Station;

/// One relay in the run.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) relay: Relay,
    /// Its number in the mission, from 1.
    pub(super) node: u16,
    /// Its lines: toward Tx (or to all), toward Rx.
    pub(super) lines: [Line; 2],
    pub(super) killed: Option<Instant>,
    /// Whether its setpoint was flown when that was last looked at.
    pub(super) lent: bool,
    /// How often it has been switched on.
    pub(super) starts: u32,
    /// Passes that it has begun before it was switched on last.
    pub(super) swept: u32,
    /// What it has stored of uploads.
    pub(super) stored: Option<Upload>,
    /// Where it was told to fly when that was last found to be within its limits.
    pub(super) safe: Option<Placement>,
    /// Least and greatest coordinates of its setpoints since its drone was engaged.
    pub(super) been: Option<[Placement; 2]>,
    /// Where it has measured the interference last.
    pub(super) measured: Option<Placement>,
    /// What it looked like when it was filmed last: whether it was on, and where it was told to fly.
    pub(super) filmed: Option<(bool, Option<Placement>)>,
    /// The wake-up in the queue that counts: the earliest one. Any other is void.
    pub(super) wake: Option<Instant>,
}

/// A chain under way.
#[derive(Debug)]
pub struct Chain {
    pub(super) setup: Setup,
    pub(super) members: Vec<Member>,
    pub(super) queue: Queue,
    pub(super) rng: ChaCha8Rng,
    pub(super) outcome: Outcome,
    pub(super) now: Instant,
    pub(super) happenings: u64,
    /// How often a relay has taken a place.
    pub(super) holding: usize,
    /// Kills, boots, partitions and strikes that are still to come.
    pub(super) ahead: usize,
    pub(super) stations: Vec<Station>,
    pub(super) attacker: Option<Attacker>,
    pub(super) flight: Option<Flight>,
    pub(super) fleet: Vec<Vehicle>,
    /// Of each pair of drones that no pilot has: their distance when both were handed over last, m.
    pub(super) handed_over_m: Vec<Option<f64>>,
    /// The channel that all share, unless each has a line of its own.
    pub(super) medium: Option<Medium>,
    /// Where losses come in runs.
    pub(super) bursts: Option<Bursts>,
    /// Where all were told to be when they agreed last, and how often that has changed.
    pub(super) agreed: Option<Vec<Placement>>,
    pub(super) agreements: u32,
    /// Whether all has been heard that was to be.
    pub(super) listened: bool,
    /// Where its whole time counts.
    pub(super) watch: Option<Watch>,
    /// Where somebody wants to see what is on the air.
    pub(super) record: Option<Record>,
}
