//! Report of a simulated chain.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::{Interference, Mission};

use super::air::AirReport;
use super::all_interferers::AllInterferersReport;
use super::attack::AttackReport;
use super::availability::AvailabilityReport;
use super::drones::{DroneReport, drones};
use super::failure::error;
use super::final_mission::version;
use super::hops::{self, RelayReport, db, hop_sirs};
use super::recovery::{self, RecoveryReport, recoveries};
use super::remaining::{LostReport, left, lost};
use super::sensing::SensingReport;
use super::silences::{SilenceReport, silences};
use super::timeline::{self, MomentReport, seconds};
use crate::simulator::outcome::{Ending, Outcome};
use crate::simulator::setup::Setup;

/// Counts of frame faults.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct FaultReport {
    /// Lost frames.
    pub lost: u64,
    /// Corrupted frames.
    pub corrupted: u64,
    /// Duplicated frames.
    pub duplicated: u64,
    /// Delayed frames.
    pub reordered: u64,
    /// Frames that the relays rejected for any reason.
    pub rejected: u64,
}

/// Result of `cargo chain`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct ChainReport {
    /// Planning method, as on the command line.
    pub method: String,
    /// Requested number of relays.
    pub uavs: u16,
    /// Version of the final mission if one was uploaded; 0 for the original one. All SIRs refer to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Error message, if the run failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Best possible SIR, if no positions were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_sir: Option<f64>,
    /// SIR of the worst hop, linear; absent unless every relay of the chain has a position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// SIR of the worst hop, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_db: Option<f64>,
    /// Target SIR that the relays agreed on, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
    /// True in a field if no chain of equal relays can reach a higher target; false if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promised: Option<bool>,
    /// SIR of the chain before Algorithm 2 and after each round, linear.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    /// Relays of the chain, from the transmitter, if all of them have a position.
    pub relays: Vec<RelayReport>,
    /// SIR at the receiver, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir: Option<f64>,
    /// SIR at the receiver, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir_db: Option<f64>,
    /// Forward passes along the chain.
    pub sweeps: u32,
    /// Frames sent on all links.
    pub messages: u64,
    /// Bytes sent on all links.
    pub bytes: u64,
    /// Virtual duration of the run, s.
    pub virtual_s: f64,
    /// Frame faults.
    pub faults: FaultReport,
    /// Detected failures of relays.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub silences: Vec<SilenceReport>,
    /// `shared` for a common radio channel; absent for a separate link to each neighbour.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<&'static str>,
    /// Counters of the channel, unless it is ideal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub air: Option<AirReport>,
    /// Statistics over the whole run, if recorded.
    #[serde(flatten)]
    pub watched: AvailabilityReport,
    /// Result of the search for the interferer, for relays that measure it.
    #[serde(flatten)]
    pub listened: Option<SensingReport>,
    /// SIR against all interferers, if the relays assumed a single one.
    #[serde(flatten)]
    pub against_all: Option<AllInterferersReport>,
    /// Number of relays in the chain at the end, if the run had other events than convergence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left: Option<u16>,
    /// Relays outside the chain, with their last positions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<LostReport>,
    /// Final positions of drones with autopilots.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drones: Vec<DroneReport>,
    /// Log of the run, if it has more than convergence.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub timeline: Vec<MomentReport>,
    /// Recovery times for each new view.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recovery: Vec<RecoveryReport>,
    /// Result of the attack, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attack: Option<AttackReport>,
    /// Seed of every random draw.
    pub seed: u64,
    /// True if relays may leave the line: the table then has a y column.
    #[serde(skip)]
    pub room: bool,
}

impl ChainReport {
    /// Report of a run in which the chain's final mission is `mission`.
    pub fn new(method: &str, mission: &Mission, outcome: &Outcome, seed: u64) -> Self {
        let chain = left(outcome);
        let timeline = timeline::timeline(&outcome.moments);
        let places: Option<Vec<_>> = chain
            .iter()
            .map(|(_, relay)| Some((relay.setpoint?, relay.profile)))
            .collect();
        let places = places.unwrap_or_default();
        let sirs = hop_sirs(mission, &places);
        let worst = sirs.iter().copied().reduce(f64::min);
        let mut relays = hops::relays(&places, &sirs);
        let offered = outcome.offered();
        for (report, (node, relay)) in relays.iter_mut().zip(&chain) {
            report.index = *node;
            report.version = offered.map(|_| relay.version);
        }
        let flown = u16::try_from(chain.len()).unwrap_or(u16::MAX);
        let rx_sir = sirs.last().copied();
        let injected = outcome.injected;
        let target = chain.first().and_then(|(_, head)| head.target);
        // True if no chain can exceed the target, within the tolerance.
        let bound = outcome.relays.iter().find_map(|relay| relay.bound);
        let promised = match (mission.interference(), target, bound) {
            (Interference::Field(_), Some(target), Some(bound)) => {
                Some(bound <= target * (1.0 + 2.0 * mission.config().tolerance))
            }
            _ => None,
        };
        Self {
            method: method.to_owned(),
            uavs: mission.relays(),
            version: offered.map(|_| version(outcome)),
            error: error(method, outcome),
            // A fixed step may skip feasible targets.
            best_sir: (outcome.ending == Ending::Infeasible && !method.ends_with("-step"))
                .then_some(0.0),
            sir: worst,
            sir_db: worst.map(db),
            target: target.map(f64::from),
            promised,
            rounds: outcome.rounds.iter().copied().map(f64::from).collect(),
            relays,
            rx_sir,
            rx_sir_db: rx_sir.map(db),
            sweeps: outcome.sweeps,
            messages: outcome.messages,
            bytes: outcome.bytes,
            virtual_s: seconds(outcome.ended),
            faults: FaultReport {
                lost: injected.lost,
                corrupted: injected.corrupted,
                duplicated: injected.duplicated,
                reordered: injected.reordered,
                rejected: outcome
                    .relays
                    .iter()
                    .map(|relay| u64::from(relay.stats.rejected()))
                    .sum(),
            },
            silences: silences(outcome),
            channel: None,
            air: None,
            listened: None,
            against_all: None,
            watched: outcome
                .watched
                .map(AvailabilityReport::of)
                .unwrap_or_default(),
            left: (!timeline.is_empty()).then_some(flown),
            lost: lost(outcome, &chain),
            recovery: recoveries(&outcome.moments, mission.relays()),
            drones: drones(outcome),
            timeline,
            attack: None,
            seed,
            room: !mission.config().lateral.is_single(),
        }
    }

    /// Report of a run that could not be started.
    pub fn refused(method: &str, uavs: u16, seed: u64, why: &str) -> Self {
        Self {
            method: method.to_owned(),
            uavs,
            version: None,
            error: Some(why.to_owned()),
            best_sir: None,
            sir: None,
            sir_db: None,
            target: None,
            promised: None,
            rounds: Vec::new(),
            relays: Vec::new(),
            rx_sir: None,
            rx_sir_db: None,
            sweeps: 0,
            messages: 0,
            bytes: 0,
            virtual_s: 0.0,
            faults: FaultReport {
                lost: 0,
                corrupted: 0,
                duplicated: 0,
                reordered: 0,
                rejected: 0,
            },
            silences: Vec::new(),
            channel: None,
            air: None,
            listened: None,
            against_all: None,
            watched: AvailabilityReport::default(),
            left: None,
            lost: Vec::new(),
            drones: Vec::new(),
            timeline: Vec::new(),
            recovery: Vec::new(),
            attack: None,
            seed,
            room: false,
        }
    }

    /// Formats the report as a table with the cost of the run.
    pub fn table(&self) -> String {
        let mut text = hops::hops_table(&self.relays, &self.lost, self.rx_sir, self.room);
        if let (Some(sir), Some(sir_db)) = (self.sir, self.sir_db) {
            _ = writeln!(
                text,
                "worst hop: SIR {sir:.6} ({sir_db:.3} dB) with {} relays by `{}`",
                self.relays_left(),
                self.method
            );
        }
        match self.version {
            None => {}
            Some(0) if self.timeline.iter().any(|moment| moment.what == "adopted") => {
                _ = writeln!(
                    text,
                    "no relay is left in a chain that flies what was uploaded and adopted"
                );
            }
            Some(0) => {
                _ = writeln!(
                    text,
                    "the chain flies the mission that it took off with: no upload was adopted"
                );
            }
            Some(version) => {
                _ = writeln!(text, "the chain flies mission {version}, as uploaded");
            }
        }
        if self.channel.is_some() {
            _ = writeln!(
                text,
                "by one radio channel that relays up to {} away hear",
                Setup::RADIO_REACH
            );
        }
        match self.promised {
            Some(true) => {
                _ = writeln!(text, "no chain of equals can have more in this field");
            }
            Some(false) => {
                _ = writeln!(
                    text,
                    "this field is uneven: that no chain can have more is not certain"
                );
            }
            None => {}
        }
        if let (Some(first), Some(last)) = (self.rounds.first(), self.rounds.last()) {
            _ = writeln!(
                text,
                "Algorithm 2: {} rounds, from SIR {first:.6} to {last:.6}",
                self.rounds.len() - 1
            );
        }
        _ = writeln!(
            text,
            "cost: {} sweeps, {} messages, {} bytes, {:.3} s of virtual time",
            self.sweeps, self.messages, self.bytes, self.virtual_s
        );
        let faults = self.faults;
        if faults.lost + faults.corrupted + faults.duplicated + faults.reordered + faults.rejected
            > 0
        {
            _ = writeln!(
                text,
                "faults: {} lost, {} corrupted, {} duplicated, {} reordered; {} frames rejected (seed {})",
                faults.lost,
                faults.corrupted,
                faults.duplicated,
                faults.reordered,
                faults.rejected,
                self.seed
            );
        }
        if let Some(listened) = &self.listened {
            text += &listened.text();
        }
        if let Some(against_all) = &self.against_all {
            text += &against_all.text();
        }
        if let Some(air) = &self.air {
            text += &air.text(self.virtual_s);
        }
        text += &self.watched.text();
        if let Some(attack) = &self.attack {
            text += &attack.text();
        }
        text += &timeline::text(&self.timeline);
        text += &recovery::text(&self.recovery);
        text
    }

    /// Formats the number of remaining relays, with the total if some are lost.
    fn relays_left(&self) -> String {
        match self.left {
            Some(left) if left < self.uavs => format!("{left} of {}", self.uavs),
            _ => self.uavs.to_string(),
        }
    }
}
