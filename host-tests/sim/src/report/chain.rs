//! Report of a simulated chain.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::{Interference, Mission, Wiring};
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Scenario, mission};

use super::attack::AttackReport;
use super::hops::{HopSlots, LostReport, RelayReport, WorstBack, db, hop_sirs, hop_sirs_back};
use super::rotation::RotationReport;
use super::sensing::SensingReport;
use super::timeline::{MomentReport, RecoveryReport, counted, recoveries, seconds};
use super::traffic::TrafficReport;
use super::{hops, timeline};
use crate::simulator::drones::{Point, apart, point};
use crate::simulator::medium::{Access, AirCounts};
use crate::simulator::outcome::{Ending, Outcome, RelayEnd, TimelineEvent};
use crate::simulator::setup::Setup;
use crate::simulator::watch::Watched;

/// Counts of the faults that the simulated links caused, and of rejected frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct FaultReport {
    /// Number of frames that the links lost.
    pub lost: u64,
    /// Number of frames that the links corrupted.
    pub corrupted: u64,
    /// Number of frames that the links delivered twice.
    pub duplicated: u64,
    /// Number of frames that the links delayed, so that later frames could overtake them.
    pub reordered: u64,
    /// Number of received frames that relays rejected for any reason.
    pub rejected: u64,
}

/// Result of a run of `cargo chain`, printed as a table or as JSON.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct ChainReport {
    /// Planning method, as on the command line.
    pub method: String,
    /// Number of relays in the mission of the run, lost relays included.
    pub uavs: u16,
    /// Version of the mission that the chain flies at the end; 0 for the mission loaded before the start.
    ///
    /// Absent if no mission was uploaded. All SIRs of the report refer to this mission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Error message, if the run failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Linear SIR of the best possible placement, if it is 0: no placement gives every hop an SIR above 0.
    ///
    /// Absent in all other cases.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_sir: Option<f64>,
    /// Linear SIR of the chain's worst hop; absent unless every relay of the chain has a position.
    ///
    /// If the mission requires an SIR only from Tx to Rx, these hops count. If it also requires an SIR from Rx to Tx,
    /// the hops in that direction count, too; their SIRs are first divided by `reverse`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// SIR of the worst hop, dB: `sir` as decibels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_db: Option<f64>,
    /// Worst hop from Rx to Tx; absent if the mission requires no SIR in that direction.
    #[serde(flatten)]
    pub back: Option<WorstBack>,
    /// Target SIR that the relays agreed on, linear; absent without an agreement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
    /// True if `target` is proven optimal, false if a chain with a higher SIR may exist.
    ///
    /// Proven means: by the leader's upper bound on the SIR, no chain of relays with equal powers and altitudes exceeds
    /// `target` by more than the tolerance. Absent unless there is a random field and such a bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promised: Option<bool>,
    /// Linear SIR of the chain before Algorithm 2, and after each of its rounds. In a round each relay in turn improves
    /// its position.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    /// Relays that are in the chain at the end, in order from Tx; empty unless each of them has a position.
    pub relays: Vec<RelayReport>,
    /// Linear SIR of the hop from the last relay to Rx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir: Option<f64>,
    /// SIR of the hop from the last relay to Rx, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir_db: Option<f64>,
    /// Time slots of all hops that the relays have agreed on; empty unless the mission has fitted slots.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hop_slots: Vec<HopSlots>,
    /// Number of passes (messages forwarded along the whole chain) and view proposals in the run.
    pub sweeps: u32,
    /// Number of frames sent on all links.
    pub messages: u64,
    /// Number of bytes sent on all links.
    pub bytes: u64,
    /// Virtual duration of the run, s.
    pub virtual_s: f64,
    /// Counts of link faults and of rejected frames.
    pub faults: FaultReport,
    /// Failed relays, each with a neighbour that detected the failure.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub silences: Vec<SilenceReport>,
    /// `shared` if all relays share one radio channel; absent for separate links between neighbours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<&'static str>,
    /// Range of the radios: number of relays on each side that receive a relay's frames. The sides are toward Tx and
    /// toward Rx. Absent for separate links.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reach: Option<usize>,
    /// Counters of the shared radio channel; absent for separate links and for an ideal channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub air: Option<AirReport>,
    /// Availability of the chain, and further statistics. The availability is the fraction of the time in which the
    /// relays are at the positions of a run without faults.
    #[serde(flatten)]
    pub watched: AvailabilityReport,
    /// Replacement of drones whose batteries run low; absent without `--fleet`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationReport>,
    /// Estimate of the interferer and its quality; absent unless the relays locate it by measurements.
    #[serde(flatten)]
    pub listened: Option<SensingReport>,
    /// SIR of the worst hop with all interferers of the scenario.
    ///
    /// Absent unless the scenario has several interferers. In their computations, the relays replace them by a single
    /// interferer.
    #[serde(flatten)]
    pub against_all: Option<AllInterferersReport>,
    /// Number of relays in the chain at the end. Absent if the log, `timeline`, is empty.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left: Option<u16>,
    /// Relays that are not in the chain at the end, with their last positions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<LostReport>,
    /// Final positions of drones with simulated autopilots; empty if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drones: Vec<DroneReport>,
    /// Log of the run. It is empty if relays only accepted positions, or reported that no positions exist.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub timeline: Vec<MomentReport>,
    /// Times from a failure to the recovery of the chain, one entry for each view that was formed. A view is an agreed
    /// set of the chain's members.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recovery: Vec<RecoveryReport>,
    /// Result of the attack; absent without an attacker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attack: Option<AttackReport>,
    /// Data traffic; absent if it was not requested, or if the relays never agreed on positions.
    #[serde(flatten)]
    pub traffic: Option<TrafficReport>,
    /// Seed of all random draws of the run.
    pub seed: u64,
    /// True if relays may leave the line from Tx to Rx: the table of relays then has a y column.
    #[serde(skip)]
    pub room: bool,
}

impl ChainReport {
    /// Creates the report of a run. `mission` is the mission that the chain flies at the end.
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
        let slots: Option<Vec<_>> = chain.iter().map(|(_, relay)| relay.slot_shares).collect();
        let flown = u16::try_from(chain.len()).unwrap_or(u16::MAX);
        let rx_sir = sirs.last().copied();
        let injected = outcome.injected;
        let target = chain.first().and_then(|(_, head)| head.target);
        // True if no chain can exceed the target by more than the tolerance.
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
            hop_slots: slots.map_or_else(Vec::new, |slots| HopSlots::agreed(&slots)),
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

    /// Creates the report of a run that could not be started, with the reason `why`.
    pub fn refused(method: &str, uavs: u16, seed: u64, why: &str) -> Self {
        Self {
            method: method.to_owned(),
            uavs,
            error: Some(why.to_owned()),
            seed,
            ..Self::default()
        }
    }

    /// Formats the report as text: the table of relays, the worst SIR, the messages and bytes, and the log.
    pub fn table(&self) -> String {
        if let Some(rotation) = &self.rotation {
            return rotation.table();
        }
        let rx = (self.rx_sir, self.back.map(|back| back.rx_sir_back));
        let mut text = hops::hops_table(&self.relays, &self.lost, rx, self.room);
        text += &HopSlots::table(&self.hop_slots);
        if let (Some(sir), Some(sir_db)) = (self.sir, self.sir_db) {
            _ = writeln!(
                text,
                "worst hop: SIR {sir:.6} ({sir_db:.3} dB) with {}, method `{}`",
                self.relays_left(),
                self.method
            );
        }
        if let Some(back) = self.back {
            _ = writeln!(
                text,
                "way back: worst hop SIR {:.6} ({:.3} dB); required: {:?} times the SIR toward Rx (link.reverse); limiting direction: {}",
                back.worst_back,
                back.worst_back_db,
                back.reverse,
                hops::direction_words(back.worst_direction)
            );
        }
        text += &self.flown_text();
        if let Some(reach) = self.reach {
            let relays = if reach == 1 { "relay" } else { "relays" };
            _ = writeln!(
                text,
                "one radio channel for all relays; a frame reaches {reach} {relays} on each side of its sender"
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
                "Algorithm 2 of the paper: {} rounds, from SIR {first:.6} to {last:.6}",
                self.rounds.len() - 1
            );
        }
        // A run that could not be started has no cost.
        if self.sweeps > 0 || self.messages > 0 {
            _ = writeln!(
                text,
                "cost: {} along the chain, {} messages, {} bytes, {:.3} s of virtual time",
                timeline::sweeps_text(self.sweeps),
                self.messages,
                self.bytes,
                self.virtual_s
            );
        }
        let faults = self.faults;
        if faults.lost + faults.corrupted + faults.duplicated + faults.reordered > 0 {
            _ = writeln!(
                text,
                "injected faults: {} frames lost, {} corrupted, {} duplicated, {} reordered (seed {})",
                faults.lost, faults.corrupted, faults.duplicated, faults.reordered, self.seed
            );
        }
        if faults.rejected > 0 {
            _ = writeln!(
                text,
                "frames that relays rejected, for example as outdated or damaged: {}",
                faults.rejected
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

    /// Returns a line of text about the mission that the chain flies at the end; empty without an upload.
    fn flown_text(&self) -> String {
        match self.version {
            None => String::new(),
            Some(0) if self.timeline.iter().any(|moment| moment.what == "adopted") => {
                "the relays adopted the uploaded mission, but no remaining relay uses it\n"
                    .to_owned()
            }
            Some(0) => "the chain uses the mission that it started with: no upload was adopted\n"
                .to_owned(),
            Some(version) => format!("the chain uses the uploaded mission, version {version}\n"),
        }
    }

    /// Formats the number of relays in the chain: "8", or "6 of 8" if some are lost.
    fn relays_left(&self) -> String {
        match self.left {
            Some(left) if left < self.uavs => format!("{left} of {}", counted(self.uavs.into())),
            _ => counted(self.uavs.into()),
        }
    }
}

/// Returns the relays in the chain at the end of a run, in order from Tx, with their numbers from 1.
///
/// The chain is the largest view (agreed set of members) that all its relays have accepted. Without such a view, it is
/// all relays that are switched on. After a failure on separate links, all relays are returned; without a quorum, none.
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

/// Returns true if `part` is a complete view: all its relays, sorted by their indices in the view.
fn is_counted(part: &[(u16, &RelayEnd)]) -> bool {
    (1..)
        .zip(part)
        .all(|(place, (_, relay))| relay.index == place && usize::from(relay.relays) == part.len())
}

/// Returns a report about each relay that is not in the chain at the end. `left` lists the relays that are still in the
/// chain.
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

/// Returns the mission that the chain flies at the end of a run. It is the mission of `setup`, or an uploaded
/// mission.
pub fn flown(setup: &Setup, outcome: &Outcome) -> Mission {
    let version = version(outcome);
    let mut uploads = setup.uploads.iter().map(|spec| spec.upload);
    uploads
        .find(|upload| upload.version() == version)
        .and_then(|upload| Mission::try_new(*upload.config()).ok())
        .unwrap_or(setup.mission)
}

/// Returns the version of the mission that the chain flies at the end. If the relays' versions differ, the newest of
/// them is returned.
pub(super) fn version(outcome: &Outcome) -> u16 {
    let chain = left(outcome);
    let versions = chain.iter().map(|(_, relay)| relay.version);
    versions.max().unwrap_or(0)
}

/// Returns the error line of a failed run; `None` after success. If no relay has adopted the newest uploaded mission,
/// the line states this, too.
pub(super) fn error(method: &str, outcome: &Outcome) -> Option<String> {
    let error = ended(method, outcome)?;
    // A mission counts as adopted even if its relays are lost.
    let known = version(outcome).max(adopted(outcome));
    let missing = outcome.offered().filter(|newest| *newest > known);
    Some(match missing {
        Some(version) => format!("{error}; mission version {version} was not adopted"),
        None => error,
    })
}

/// Returns the version of the newest mission that any relay adopted; 0 if there is none.
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
            "no target SIR of the fixed-step schedule can be met; a smaller --epsilon may find one"
                .to_owned(),
        ),
        Ending::Infeasible => Some("no placement gives every hop an SIR above 0".to_owned()),
        Ending::Broken => {
            let silent: Vec<u16> = (1..)
                .zip(&outcome.relays)
                .filter(|(_, relay)| relay.killed.is_some())
                .map(|(index, _)| index)
                .collect();
            Some(format!(
                "the chain is broken: {} went silent",
                uav_relay_screen::named(&silent)
            ))
        }
        Ending::NoQuorum => Some("no quorum: too few relays receive each other".to_owned()),
        Ending::OutOfTime => Some(format!(
            "the relays had not agreed on final positions after {:.0} s",
            seconds(outcome.ended)
        )),
    }
}

/// Parameters and counters of a radio channel that all relays share.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct AirReport {
    /// Access method of the channel: `csma` or `aloha`.
    pub access: &'static str,
    /// Data rate of the channel, bit/s.
    pub baud: u32,
    /// Counters of frames and collisions on the channel.
    #[serde(flatten)]
    pub counts: AirCounts,
}

impl AirReport {
    /// Returns the report of the shared channel of a run; `None` for separate links and an ideal channel.
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

    /// Formats the channel's report as a line of text. The load of the channel follows from `virtual_s`, the duration
    /// of the run, s.
    pub(super) fn text(&self, virtual_s: f64) -> String {
        let counts = self.counts;
        let load = counts.air_time_us as f64 / 1e6 / virtual_s.max(1e-6);
        let mut text = String::new();
        _ = writeln!(
            text,
            "radio channel ({}, {} bit/s): load {load:.3} (air time of all frames / duration of the run), {} frames sent, {} dropped by full queues; receptions lost: {} in collisions, {} while the receiver was sending",
            self.access, self.baud, counts.sent, counts.dropped, counts.collided, counts.unheard
        );
        text
    }
}

/// Availability of the chain over a whole run. All fields are absent if the run has no such statistics.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct AvailabilityReport {
    /// Time when all relays of the chain first had agreed positions, s of virtual time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_agreement_s: Option<f64>,
    /// Fraction of the time since the first agreement in which the chain was available.
    ///
    /// The chain is available while the longest chain that living relays can form is at the positions that this chain
    /// reaches in a run without faults.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub availability: Option<f64>,
    /// Longest outage since the first agreement, s: a time in which the chain was not available. See `availability`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_outage_s: Option<f64>,
    /// Largest number of groups of relays that flew at the same time, each on an agreement of its own. More than 1
    /// means that the chain was split.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_flying: Option<usize>,
    /// Smallest distance of two relays during the run, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_separation_m: Option<f64>,
}

impl AvailabilityReport {
    /// Creates the report of the availability from the statistics `watched` of a run.
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
                    "availability: {availability:.6} (share of the time since the first agreement, at {first:.3} s, in which the longest possible chain is at its best positions); longest outage {outage:.3} s"
                ),
                None => writeln!(
                    text,
                    "availability: {availability:.6}, because the relays never agreed on positions"
                ),
            };
        }
        if let Some(most) = self.most_flying {
            _ = writeln!(
                text,
                "largest number of separate chains at the same time: {most} (above 1, the chain was split)"
            );
        }
        if let Some(least) = self.least_separation_m {
            _ = writeln!(text, "smallest distance between two relays: {least:.3} m");
        }
        text
    }
}

/// State of a simulated drone at the end of a run.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct DroneReport {
    /// Number of the drone's relay in the mission, from 1.
    pub index: u16,
    /// True distance of the drone from Tx along the line to Rx, m.
    pub x_m: f64,
    /// True lateral offset of the drone, m; positive to the right as seen from Tx toward Rx.
    pub y_m: f64,
    /// True height of the drone above the ground, m.
    pub h_m: f64,
    /// True if the relay, not the pilot, controls the drone.
    pub flown: bool,
    /// Distance of the drone from its relay's setpoint, m; absent if the relay has no setpoint.
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

/// Failure of a relay, and the neighbour that detected it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct SilenceReport {
    /// Number of the failed relay, from 1.
    pub silent: u16,
    /// Number of the neighbour that detected the failure, from 1.
    pub noticed_by: u16,
    /// Time of the detection, s of virtual time.
    pub at_s: f64,
}

/// Reports the neighbours that detected failed relays. Failures that a neighbour wrongly detected over a bad link are
/// left out.
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

/// SIR with all interferers of the scenario. In their computations, the relays replace all of them by a single
/// interferer.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AllInterferersReport {
    /// Linear SIR of the worst hop with all interferers of the scenario.
    pub all_sir: f64,
    /// SIR of the worst hop with all interferers of the scenario, dB.
    pub all_sir_db: f64,
    /// Relative loss of SIR because the relays assume a single interferer.
    ///
    /// It is 1 - `all_sir` / SIR with the single interferer. It is negative if the SIR with all interferers is
    /// higher.
    pub all_loss: f64,
}

impl AllInterferersReport {
    /// Computes the SIR of `relays` with all interferers. `sir` is the SIR with the single interferer that the relays
    /// assume.
    ///
    /// `None` if the scenario has a single interferer or a random field.
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

    /// Formats the SIR with all interferers as a line of text.
    pub fn text(&self) -> String {
        let Self {
            all_sir,
            all_sir_db,
            all_loss,
        } = self;
        let part = 100.0 * all_loss.abs();
        let side = if *all_loss < 0.0 { "above" } else { "below" };
        format!(
            "against all interferers: SIR {all_sir:.6} ({all_sir_db:.3} dB), {part:.1} % {side} the SIR that the relays expect; `cargo plan` finds \
             the best positions against all\n"
        )
    }
}
