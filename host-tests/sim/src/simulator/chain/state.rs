//! State of a run.

use rand_chacha::ChaCha8Rng;
use uav_relay::Upload;
use uav_relay::{Instant, Placement, Relay, ViewRecord};

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

#[derive(Debug)]
pub(super) struct Member {
    pub(super) relay: Relay,
    /// Relay number in the mission, from 1.
    pub(super) node: u16,
    /// Transmit lines: toward Tx (or shared), toward Rx.
    pub(super) lines: [Line; 2],
    pub(super) killed: Option<Instant>,
    /// True if the relay controlled its drone at the last time step.
    pub(super) lent: bool,
    pub(super) starts: u32,
    /// Sweeps begun before the last start.
    pub(super) swept: u32,
    pub(super) stored: Option<Upload>,
    /// Stored view record, if the relay has voted.
    pub(super) record: Option<ViewRecord>,
    /// Last setpoint that passed the limit check.
    pub(super) safe: Option<Placement>,
    /// Least and greatest setpoint coordinates since the drone was engaged.
    pub(super) been: Option<[Placement; 2]>,
    /// Position of the last measurement.
    pub(super) measured: Option<Placement>,
    /// Last filmed state: on or off, and the setpoint.
    pub(super) filmed: Option<(bool, Option<Placement>)>,
    /// Time of the valid wake-up in the queue, the earliest; others are ignored.
    pub(super) wake: Option<Instant>,
}

/// Simulated chain during a run.
#[derive(Debug)]
pub struct Chain {
    pub(super) setup: Setup,
    pub(super) members: Vec<Member>,
    pub(super) queue: Queue,
    pub(super) rng: ChaCha8Rng,
    pub(super) outcome: Outcome,
    pub(super) now: Instant,
    pub(super) happenings: u64,
    /// Number of `Converged` events so far.
    pub(super) holding: usize,
    /// Planned kills, boots, partitions, uploads and attacker frames that are still pending.
    pub(super) ahead: usize,
    pub(super) stations: Vec<Station>,
    pub(super) attacker: Option<Attacker>,
    pub(super) flight: Option<Flight>,
    pub(super) fleet: Vec<Vehicle>,
    /// Distance of each pair of drones at their last hand-over, m. `None` while a pilot flies one of the two.
    pub(super) handed_over_m: Vec<Option<f64>>,
    /// Simulated shared channel; `None` for separate lines or an ideal channel.
    pub(super) medium: Option<Medium>,
    pub(super) bursts: Option<Bursts>,
    /// Setpoints of the last agreement.
    pub(super) agreed: Option<Vec<Placement>>,
    pub(super) agreements: u32,
    /// True after the last measurement.
    pub(super) listened: bool,
    /// Statistics, for soaks and shared channels.
    pub(super) watch: Option<Watch>,
    pub(super) record: Option<Record>,
}
