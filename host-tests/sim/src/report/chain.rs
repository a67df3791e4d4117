//! Report of a simulated chain.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::{Interference, Mission, Wiring};
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Scenario, mission};

use super::attack::AttackReport;
use super::hops::{LostReport, RelayReport, WorstBack, db, hop_sirs, hop_sirs_back};
use super::sensing::SensingReport;
use super::timeline::{MomentReport, RecoveryReport, recoveries, seconds};
use super::traffic::TrafficReport;
use super::{hops, timeline};
use crate::simulator::drones::{Point, apart, point};
use crate::simulator::medium::{Access, AirCounts};
use crate::simulator::outcome::{Ending, Outcome, RelayEnd, TimelineEvent};
use crate::simulator::setup::Setup;
use crate::simulator::watch::Watched;

/// Counts of frame faults.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
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
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
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
    ///
    /// With a way back the worse of that of the way there, and of the way back divided by `reverse`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// SIR of the worst hop, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_db: Option<f64>,
    /// Worst hop of the way back; absent in a mission of one direction.
    #[serde(flatten)]
    pub back: Option<WorstBack>,
    /// Target SIR that the relays agreed on, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
    /// True in a field if no chain of equal relays can reach a higher target; false if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promised: Option<bool>,
    /// SIR of the chain before Algorithm 2 and after each round, linear.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    /// Relays of the chain in order from the transmitter; empty unless every relay has a position.
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
    /// Data traffic, if requested and if there was an agreement.
    #[serde(flatten)]
    pub traffic: Option<TrafficReport>,
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
        let sirs_back = hop_sirs_back(mission, &places);
        let back = WorstBack::of(mission, &sirs, &sirs_back);
        let worst = sirs.iter().copied().reduce(f64::min);
        let worst = worst.map(|sir| back.map_or(sir, |back| back.worst_both));
        let mut relays = hops::relays(&places, &sirs);
        let offered = outcome.offered();
        if back.is_some() {
            for (report, sir) in relays.iter_mut().zip(&sirs_back) {
                report.sir_back = Some(*sir);
            }
        }
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
            back,
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
            watched: outcome
                .watched
                .map(AvailabilityReport::of)
                .unwrap_or_default(),
            left: (!timeline.is_empty()).then_some(flown),
            lost: lost(outcome, &chain),
            recovery: recoveries(&outcome.moments, mission.relays()),
            drones: drones(outcome),
            timeline,
            seed,
            room: !mission.config().lateral.is_single(),
            ..Self::default()
        }
    }

    /// Report of a run that could not be started.
    pub fn refused(method: &str, uavs: u16, seed: u64, why: &str) -> Self {
        Self {
            method: method.to_owned(),
            uavs,
            error: Some(why.to_owned()),
            seed,
            ..Self::default()
        }
    }

    /// Formats the report as a table with the cost of the run.
    pub fn table(&self) -> String {
        let rx = (self.rx_sir, self.back.map(|back| back.rx_sir_back));
        let mut text = hops::hops_table(&self.relays, &self.lost, rx, self.room);
        if let (Some(sir), Some(sir_db)) = (self.sir, self.sir_db) {
            _ = writeln!(
                text,
                "worst hop: SIR {sir:.6} ({sir_db:.3} dB) with {} relays by `{}`",
                self.relays_left(),
                self.method
            );
        }
        if let Some(back) = self.back {
            _ = writeln!(
                text,
                "way back: worst hop SIR {:.6} ({:.3} dB); it needs {:?} of the SIR of the way there (link.reverse); worst direction: {}",
                back.worst_back, back.worst_back_db, back.reverse, back.worst_direction
            );
        }
        text += &self.flown_text();
        if self.channel.is_some() {
            _ = writeln!(
                text,
                "one radio channel, received by relays up to {} places away",
                Setup::RADIO_REACH
            );
        }
        match self.promised {
            Some(true) => {
                _ = writeln!(
                    text,
                    "no chain of identical relays has a higher SIR in this field"
                );
            }
            Some(false) => {
                _ = writeln!(
                    text,
                    "this field is uneven: a chain with a higher SIR may exist"
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
        text += &timeline::recovery_text(&self.recovery);
        if let Some(traffic) = &self.traffic {
            text += &traffic.text();
        }
        text
    }

    /// Formats the mission that the chain flies; empty without uploads.
    fn flown_text(&self) -> String {
        match self.version {
            None => String::new(),
            Some(0) if self.timeline.iter().any(|moment| moment.what == "adopted") => {
                "no remaining relay flies the mission that was uploaded and adopted\n".to_owned()
            }
            Some(0) => "the chain flies the mission that it took off with: no upload was adopted\n"
                .to_owned(),
            Some(version) => format!("the chain flies mission {version}, as uploaded\n"),
        }
    }

    /// Formats the number of remaining relays, with the total if some are lost.
    fn relays_left(&self) -> String {
        match self.left {
            Some(left) if left < self.uavs => format!("{left} of {}", self.uavs),
            _ => self.uavs.to_string(),
        }
    }
}

/// Returns the relays of the chain at the end of the run, with their numbers from 1, in order from Tx.
///
/// The chain is the largest complete view, or all living relays if there is none. On separate links a failure is only reported:
/// all relays stay. Without a quorum there is no chain.
pub(super) fn left(outcome: &Outcome) -> Vec<(u16, &RelayEnd)> {
    let all: Vec<(u16, &RelayEnd)> = (1..).zip(&outcome.relays).collect();
    match outcome.ending {
        Ending::Broken => return all,
        Ending::NoQuorum => return Vec::new(),
        _ => {}
    }
    let living: Vec<_> = all
        .into_iter()
        .filter(|(_, relay)| relay.killed.is_none())
        .collect();
    let views = living.iter().map(|(_, relay)| relay.view);
    views
        .map(|view| {
            let part = living.iter().filter(|(_, relay)| relay.view == view);
            (view, part.copied().collect::<Vec<_>>())
        })
        .filter(|(_, part)| is_counted(part))
        .max_by_key(|(view, part)| (part.len(), *view))
        .map_or(living.clone(), |(_, part)| part)
}

/// Returns true if these are all relays of their view.
fn is_counted(part: &[(u16, &RelayEnd)]) -> bool {
    (1..)
        .zip(part)
        .all(|(place, (_, relay))| relay.index == place && usize::from(relay.relays) == part.len())
}

/// Reports the relays that are not in `left`.
pub(super) fn lost(outcome: &Outcome, left: &[(u16, &RelayEnd)]) -> Vec<LostReport> {
    (1..)
        .zip(&outcome.relays)
        .filter(|(index, _)| !left.iter().any(|(other, _)| other == index))
        .map(|(index, relay)| LostReport {
            index,
            x_m: relay.setpoint.map(|place| f64::from(place.x_m)),
            y_m: relay.setpoint.map(|place| f64::from(place.y_m)),
            h_m: relay.setpoint.map(|place| f64::from(place.altitude_m)),
            version: outcome.offered().map(|_| relay.version),
            why: match outcome.ending {
                _ if relay.killed.is_some() => "silent",
                Ending::NoQuorum => "no quorum",
                _ => "apart",
            },
        })
        .collect()
}

/// Returns the mission that the chain flies at the end of a run, with all its relays.
pub fn flown(setup: &Setup, outcome: &Outcome) -> Mission {
    let version = version(outcome);
    let mut uploads = setup.uploads.iter().map(|spec| spec.upload);
    uploads
        .find(|upload| upload.version() == version)
        .and_then(|upload| Mission::try_new(*upload.config()).ok())
        .unwrap_or(setup.mission)
}

/// Returns the version of that mission; the newest one if the relays differ.
pub(super) fn version(outcome: &Outcome) -> u16 {
    let chain = left(outcome);
    let versions = chain.iter().map(|(_, relay)| relay.version);
    versions.max().unwrap_or(0)
}

/// Returns the reason for a failed run, and the upload that was not adopted, if any.
pub(super) fn error(method: &str, outcome: &Outcome) -> Option<String> {
    let error = ended(method, outcome)?;
    // A mission counts as adopted even if its relays are lost.
    let known = version(outcome).max(adopted(outcome));
    let missing = outcome.offered().filter(|newest| *newest > known);
    Some(match missing {
        Some(version) => format!("{error}; mission {version} was not adopted"),
        None => error,
    })
}

/// Returns the newest mission version that any relay adopted; 0 for the original mission.
fn adopted(outcome: &Outcome) -> u16 {
    let versions = outcome.moments.iter().map(|moment| match moment.what {
        TimelineEvent::Adopted(version) => version,
        _ => 0,
    });
    versions.max().unwrap_or(0)
}

fn ended(method: &str, outcome: &Outcome) -> Option<String> {
    match outcome.ending {
        Ending::Settled | Ending::Soaked => None,
        Ending::Infeasible if method.ends_with("-step") => Some(
            "no target SIR of the fixed-step schedule can be met; a smaller step may find one"
                .to_owned(),
        ),
        Ending::Infeasible => Some("no placement gives every hop an SIR above 0".to_owned()),
        Ending::Broken => {
            let silent: Vec<String> = (1..)
                .zip(&outcome.relays)
                .filter(|(_, relay): &(u16, _)| relay.killed.is_some())
                .map(|(index, _)| index.to_string())
                .collect();
            Some(format!(
                "the chain is broken: relay {} went silent",
                silent.join(", ")
            ))
        }
        Ending::NoQuorum => Some("no quorum: too few relays reach each other".to_owned()),
        Ending::OutOfTime => Some(format!(
            "the chain had not settled after {:.0} s",
            seconds(outcome.ended)
        )),
    }
}

/// Channel parameters and counters.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct AirReport {
    /// Access method: `csma` or `aloha`.
    pub access: &'static str,
    /// Bits per second.
    pub baud: u32,
    /// Counters of the channel.
    #[serde(flatten)]
    pub counts: AirCounts,
}

impl AirReport {
    /// Returns the channel's report of a run; `None` for wires and for an ideal channel.
    pub fn of(setup: &Setup, outcome: &Outcome) -> Option<Self> {
        let access = match (setup.settings.wiring, setup.access) {
            (Wiring::Shared, Access::Csma) => "csma",
            (Wiring::Shared, Access::Aloha) => "aloha",
            _ => return None,
        };
        Some(Self {
            access,
            baud: setup.link.baud,
            counts: outcome.air,
        })
    }

    /// Formats the report as a line; `virtual_s` is the duration of the run.
    pub(super) fn text(&self, virtual_s: f64) -> String {
        let counts = self.counts;
        let load = counts.air_time_us as f64 / 1e6 / virtual_s.max(1e-6);
        let mut text = String::new();
        _ = writeln!(
            text,
            "air ({}, {} baud): load {load:.3}, {} frames sent, {} dropped by full queues; receptions lost: {} to collisions, {} to own transmissions",
            self.access, self.baud, counts.sent, counts.dropped, counts.collided, counts.unheard
        );
        text
    }
}

/// Statistics of the availability over the whole run. All are absent in a run that does not record them.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct AvailabilityReport {
    /// Time of the first agreement, s: all relays of a view hold their positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_agreement_s: Option<f64>,
    /// Share of the time after the first agreement in which a longest possible chain held its optimum.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub availability: Option<f64>,
    /// Longest time after the first agreement without a longest possible chain at its optimum, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_outage_s: Option<f64>,
    /// Largest number of groups that held separate agreements at the same time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_flying: Option<usize>,
    /// Smallest distance of two relays, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_separation_m: Option<f64>,
}

impl AvailabilityReport {
    /// Report of `watched`.
    pub fn of(watched: Watched) -> Self {
        let longest = watched.longest_wrong;
        Self {
            first_agreement_s: watched.first_agreement.map(seconds),
            availability: watched.availability,
            longest_outage_s: longest.map(|span| span.as_micros() as f64 / 1e6),
            most_flying: Some(watched.most_flying),
            least_separation_m: watched.least_separation_m.filter(|least| least.is_finite()),
        }
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        if let Some(availability) = self.availability {
            let outage = self.longest_outage_s.unwrap_or(0.0);
            _ = match self.first_agreement_s {
                Some(first) => writeln!(
                    text,
                    "availability: {availability:.6} since the first agreement at {first:.3} s; the longest outage took {outage:.3} s"
                ),
                None => writeln!(
                    text,
                    "availability: {availability:.6}, because there was no agreement"
                ),
            };
        }
        if let Some(most) = self.most_flying {
            _ = writeln!(
                text,
                "most groups with separate agreements at the same time: {most}"
            );
        }
        if let Some(least) = self.least_separation_m {
            _ = writeln!(text, "least separation of two relays: {least:.3} m");
        }
        text
    }
}

/// Final state of a drone.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct DroneReport {
    /// Relay number in the mission, from 1.
    pub index: u16,
    /// True position along the line, m.
    pub x_m: f64,
    /// True position to the right of the line, m.
    pub y_m: f64,
    /// True height above the ground, m.
    pub h_m: f64,
    /// True if the relay controls the drone.
    pub flown: bool,
    /// Distance of the drone from the relay's setpoint, m; absent without a setpoint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off_m: Option<f64>,
}

pub(super) fn drones(outcome: &Outcome) -> Vec<DroneReport> {
    let ends = (1..).zip(outcome.fleet.iter().zip(&outcome.relays));
    ends.map(|(index, (&(at, flown), relay))| one(index, at, flown, relay))
        .collect()
}

fn one(index: u16, at: Point, flown: bool, relay: &RelayEnd) -> DroneReport {
    let [x_m, y_m, h_m] = at;
    DroneReport {
        index,
        x_m,
        y_m,
        h_m,
        flown,
        off_m: relay.setpoint.map(|place| apart(point(place), at)),
    }
}

/// Detected failure of a relay.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct SilenceReport {
    /// Failed relay.
    pub silent: u16,
    /// Neighbour that detected the failure.
    pub noticed_by: u16,
    /// Detection time, s of virtual time.
    pub at_s: f64,
}

/// Reports which neighbours detected the relays that failed. False detections over bad links are left out.
pub(super) fn silences(outcome: &Outcome) -> Vec<SilenceReport> {
    let killed = |index: u16| {
        let at = usize::from(index).checked_sub(1);
        at.and_then(|at| outcome.relays.get(at))
            .is_some_and(|relay| relay.killed.is_some())
    };
    let mut silences: BTreeMap<(u16, u16), f64> = BTreeMap::new();
    for moment in &outcome.moments {
        let Some(other) = moment.other else {
            continue;
        };
        match moment.what {
            TimelineEvent::Lost(_) if killed(other) => {
                silences.insert((moment.relay, other), seconds(moment.at));
            }
            TimelineEvent::Found(_) => {
                silences.remove(&(moment.relay, other));
            }
            _ => {}
        }
    }
    let reports = silences
        .into_iter()
        .map(|((noticed_by, silent), at_s)| SilenceReport {
            silent,
            noticed_by,
            at_s,
        });
    reports.collect()
}

/// SIR of the chain against all interferers, if its relays assumed a single one.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AllInterferersReport {
    /// SIR of the worst hop against all interferers, linear.
    pub all_sir: f64,
    /// SIR of the worst hop against all interferers, dB.
    pub all_sir_db: f64,
    /// Relative loss from the SIR that the relays assume; negative for a gain.
    pub all_loss: f64,
}

impl AllInterferersReport {
    /// Evaluates `relays`, which assume `sir`; `None` if there is a single interferer or a field.
    pub fn of(scenario: &Scenario, relays: &[RelayReport], sir: f64) -> Option<Self> {
        mission::hypothetical(scenario)?;
        let last = relays.last()?.index;
        let mut scene = Scene::new(scenario, last)?;
        // Remaining relays, in order.
        let all = std::mem::take(&mut scene.relays);
        let of = |relay: &RelayReport| all.get(usize::from(relay.index) - 1).copied();
        scene.relays = relays.iter().filter_map(of).collect();
        let places: Vec<Place> = relays
            .iter()
            .map(|relay| Place {
                x: relay.x_m,
                y: relay.y_m,
                h: relay.h_m,
            })
            .collect();
        let all_sir = scene.chain_sir(&places);
        Some(Self {
            all_sir,
            all_sir_db: db(all_sir),
            all_loss: 1.0 - all_sir / sir,
        })
    }

    /// Formats the result as a line of text.
    pub fn text(&self) -> String {
        let Self {
            all_sir,
            all_sir_db,
            all_loss,
        } = self;
        let part = 100.0 * all_loss.abs();
        let side = if *all_loss < 0.0 { "above" } else { "below" };
        format!(
            "against all interferers: SIR {all_sir:.6} ({all_sir_db:.3} dB), {part:.1} % {side} the relays' estimate; `cargo plan` has the \
             best positions against all\n"
        )
    }
}
