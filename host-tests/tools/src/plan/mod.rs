//! Planner: number of relays for a target SIR, or positions of a given number of relays.
//!
//! | interference | file |
//! | --- | --- |
//! | one interferer | `source`: Theorems 1 to 3 for one relay, Algorithm 1 and eq. (Opt) for more |
//! | one interferer, both directions | `one_both_ways`: closed forms for one relay; `source`: Algorithm 1, with a `bound` that proves it |
//! | one interferer, data rates | `carried`: positions of the largest rate, if they are not those of the largest SIR, by a shortest `path`; for fitted slots and rate `steps` by a search over exact positions |
//! | a field | `source`: Algorithm 3 for one relay; Algorithm 4 and Problem 1, exact for equal relays, for more |
//! | a field, both directions | `source`: Algorithm 4 |
//! | several interferers | `multi_interferer`: the hypothetical interferer, or the true sum if the former is not good enough |
//! | an interferer anywhere in an area, no-fly areas | `area`; `area_map`: the SIR for each position of the interferer; `locating`: its location by relays that measure it |
//! | terrain | `terrain`: its files and the picture of the profile; `over_terrain`: positions with the smallest loss by diffraction; `terrain_flight`: altitudes for relays that choose x by themselves |
//! | several interferers, both directions | the same; a shortest `path` for the true sum, with a `bound` that proves it |
//!
//! The planner sends no messages. It uses the crate's on-board code wherever there is a method. [`Plan::proven`] is
//! true if the result is proven optimal.

mod altitude;
pub mod area;
pub mod area_map;
pub mod bound;
pub mod carried;
pub mod flown;
pub mod locating;
pub mod map;
mod multi_interferer;
pub mod one_both_ways;
pub mod over_terrain;
pub mod path;
pub mod rate;
pub mod report;
mod source;
mod steps;
pub mod terrain;
pub mod terrain_flight;

use uav_relay::{Mission, Placement, Profile};
use uav_relay_scenario::hypothetical::Hypothetical;
use uav_relay_scenario::link::Radio;
use uav_relay_scenario::mission::Refusal;
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Scenario, mission};
use uav_relay_sim::report::{WorstBack, counted, hop_sirs, hop_sirs_back};

pub use altitude::solved;

/// Finds the relay positions that `ask` requests for `scenario`, and their SIRs.
///
/// It takes some milliseconds; with free altitudes up to some seconds for fifty relays or more.
///
/// # Errors
/// [`NoPlan`]: the request is invalid, or cannot be met. If the request cannot be met, the error gives the best SIR.
pub fn plan(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    check(scenario, ask)?;
    if !scenario.areas.is_empty() || !scenario.no_fly.is_empty() {
        return area::plan(scenario, ask, area::Criterion::default());
    }
    match &scenario.interference {
        Interference::Field(_) => source::plan_in_field(scenario, ask),
        Interference::Sources(sources) if sources.len() > 1 => {
            multi_interferer::plan(scenario, ask)
        }
        Interference::Sources(_) => with_one_interferer(scenario, ask),
    }
}

/// Returns the plan of `ask` for a scenario with one interferer.
fn with_one_interferer(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    match ask.number {
        Number::Of(1)
            if ask.free_altitude
                && ask.x_m.is_none()
                && (scenario.has_fitted_slots() || scenario.reverse > 0.0) =>
        {
            altitude::best(scenario, 1, ask.tolerance)
        }
        Number::Of(1) if scenario.reverse > 0.0 => source::alone_both_ways(scenario, ask.tolerance),
        Number::Of(1) => source::alone(scenario, ask),
        Number::Of(relays) if ask.free_altitude => altitude::best(scenario, relays, ask.tolerance),
        Number::Of(relays) if scenario.reverse > 0.0 => {
            source::best_both_ways(scenario, relays, ask.tolerance)
        }
        Number::Of(relays) => source::best(scenario, relays, ask.tolerance),
        Number::Meeting(target) if ask.free_altitude => {
            altitude::fewest(scenario, target, ask.tolerance)
        }
        Number::Meeting(target) => source::level(scenario, target, ask.tolerance),
    }
}

/// Checks that the options of `ask` are compatible with each other and with the scenario.
fn check(scenario: &Scenario, ask: &PlanRequest) -> Result<(), NoPlan> {
    if ask.x_m.is_some() {
        only_one_way(scenario, "--x-m")?;
    }
    let Some(x_m) = ask.x_m else { return Ok(()) };
    let d = scenario.distance_m;
    let wrong = if !(0.0..=d).contains(&x_m) {
        format!("--x-m {x_m:?}: must be within 0.0 to {d:?} (geometry.distance_m)")
    } else if ask.number != Number::Of(1) {
        "--x-m is for one relay: it needs --uavs 1".to_owned()
    } else if matches!(scenario.interference, Interference::Field(_)) {
        "--x-m finds the best altitude at that place, so it needs an [[interferer]]: the interference of a [field] is the same at every altitude"
            .to_owned()
    } else {
        return Ok(());
    };
    Err(NoPlan::Wrong(wrong))
}

/// Returns an error that names the option `what` if the scenario has data in both directions.
fn only_one_way(scenario: &Scenario, what: &str) -> Result<(), NoPlan> {
    if scenario.reverse > 0.0 {
        return Err(NoPlan::Wrong(format!(
            "{what}: cannot be used with link.reverse = {:?}, because it is for one direction only; allowed: link.reverse = 0.0 or no {what}",
            scenario.reverse
        )));
    }
    Ok(())
}

/// Number of relays of a plan: given, or to be found for a target SIR.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// Number of relays, 1 to 1000. The plan has their best positions.
    Of(u16),
    /// Smallest number of relays that gives every hop this SIR, linear, above 0.
    Meeting(f64),
}

/// Request to the planner.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlanRequest {
    /// Number of relays, given or to be found for a target SIR.
    pub number: Number,
    /// True if the planner may choose altitudes between the scenario's lowest and highest altitude.
    pub free_altitude: bool,
    /// Required x of the only relay, m, 0 to the distance Tx-Rx. The planner then chooses its altitude.
    pub x_m: Option<f64>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
}

impl PlanRequest {
    /// Creates a request for `relays` relays at the best x.
    pub const fn of(relays: u16, free_altitude: bool, tolerance: f64) -> Self {
        Self {
            number: Number::Of(relays),
            free_altitude,
            x_m: None,
            tolerance,
        }
    }
}

/// Largest accepted loss of SIR or data rate, as a fraction of its value at the best positions.
pub const LOSS: f64 = 0.01;

/// Theorem, and its case, that gave the position of a single relay.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Theorem {
    /// Number of the theorem in the paper, 1 to 3; 4 and 5 are not in the paper.
    ///
    /// 4 is one relay with a lateral offset, and 5 one relay for data in both directions.
    pub number: u8,
    /// Number of the theorem's case in the paper; 0 for a case that the paper omits.
    pub case: u8,
    /// Explanation of the theorem's case for the user: why the relay goes to its position.
    pub words: String,
}

/// Result of planning with one hypothetical interferer in place of several.
#[derive(Clone, PartialEq, Debug)]
pub struct Fitted {
    /// Hypothetical interferer: its power, position and error.
    ///
    /// The error is the difference between its interference and that of all real interferers.
    pub hypothetical: Hypothetical,
    /// SIR against all interferers at the best positions for the hypothetical interferer, linear.
    ///
    /// `None` if no such positions were found.
    pub sir: Option<f64>,
    /// True if the plan has the positions for the hypothetical interferer.
    ///
    /// False if it has the best positions found against all interferers.
    pub kept: bool,
    /// Loss at the positions for the hypothetical interferer, as a fraction of the plan's SIR, 0 to 1.
    ///
    /// With fitted time slots it is the loss of data rate. `None` if no such positions were found.
    pub loss: Option<f64>,
    /// True if the data rate decides which positions are better.
    ///
    /// This is so with fitted time slots, each as long as its hop needs.
    pub by_rate: bool,
}

/// Result of the planner: positions of the relays and SIRs of the hops.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// Mission of the planned relays.
    pub mission: Mission,
    /// Positions and profiles (power, altitude) of the relays; relay 1, next to Tx, is first.
    pub places: Vec<(Placement, Profile)>,
    /// SIR, linear, of each hop from Tx to Rx, N + 1 in all.
    pub sirs: Vec<f64>,
    /// Worst hop in the direction from Rx to Tx; `None` in a plan for data toward Rx only.
    pub back: Option<WorstBack>,
    /// Name of the algorithm that found the positions.
    pub how: &'static str,
    /// True if the plan is proven optimal: no positions are better, or no fewer relays suffice.
    pub proven: bool,
    /// Theorem that gave the position of a single relay; `None` if no theorem was used.
    pub theorem: Option<Theorem>,
    /// Best SIR that the plan's number of relays can have, linear.
    ///
    /// `None` if it is unknown, or if the request has no target SIR.
    pub most: Option<f64>,
    /// Result of planning with one hypothetical interferer; `None` unless there are several interferers.
    pub fitted: Option<Fitted>,
}

/// Reason why a valid request cannot be met.
#[derive(Clone, PartialEq, Debug)]
pub enum Why {
    /// Explanation for the user, one line.
    Plain(String),
    /// No number of relays gives every hop the target SIR.
    Short {
        /// Requested SIR of every hop, linear.
        target: f64,
        /// Best SIR found for the worst hop, linear.
        most: f64,
        /// Number of relays that reaches the SIR `most`; `None` if an untried number might do better.
        relays: Option<u16>,
    },
}

impl Why {
    /// Returns the reason as one line of text, with SIRs in `unit`.
    pub fn say(&self, unit: Unit) -> String {
        match self {
            Self::Plain(line) => line.clone(),
            Self::Short {
                target,
                most,
                relays,
            } => {
                let limit = Mission::MAX_RELAYS;
                let (target, most) = (unit.asked(*target), unit.say(*most));
                match relays {
                    Some(relays) => format!(
                        "no number of relays, up to {limit}, gives every hop an SIR of {target}: the highest SIR is {most}, with {}",
                        counted(usize::from(*relays))
                    ),
                    None => format!(
                        "none of the tried numbers of relays, up to {limit}, gives every hop an SIR of {target}: the highest SIR found is {most}"
                    ),
                }
            }
        }
    }
}

impl Default for Why {
    fn default() -> Self {
        Self::Plain(String::new())
    }
}

/// Error of the planner: there is no plan for the request.
#[derive(Clone, PartialEq, Debug)]
pub enum NoPlan {
    /// The scenario is not a valid mission, or the request does not fit it, for this reason.
    Wrong(String),
    /// The request cannot be met, for this reason. The number is the best SIR found, linear; `None` if unknown.
    Unmet(Why, Option<f64>),
}

impl From<Refusal> for NoPlan {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::NoRoom { .. } => Self::Unmet(Why::Plain(refusal.to_string()), None),
            other => Self::Wrong(other.to_string()),
        }
    }
}

impl Plan {
    /// Returns the SIR of the worst hop, linear.
    ///
    /// In a plan for both directions of data, an SIR toward Tx is first divided by `reverse`. This is the required SIR
    /// toward Tx as a fraction of the SIR toward Rx.
    pub fn sir(&self) -> f64 {
        let there = self.sirs.iter().copied().reduce(f64::min).unwrap_or(0.0);
        self.back.map_or(there, |back| back.worst_both)
    }

    /// Returns the positions of the relays, in order from Tx.
    pub fn chain(&self) -> Vec<Placement> {
        self.places.iter().map(|(place, _)| *place).collect()
    }

    /// Returns the SIR of each hop in the direction from Rx to Tx, linear; empty if it is unknown.
    pub fn sirs_back(&self, scenario: &Scenario) -> Vec<f64> {
        let relays = u16::try_from(self.places.len()).unwrap_or(u16::MAX);
        match Scene::new(scenario, relays) {
            Some(scene) => scene.hop_sirs_back(&self.chain()),
            None => hop_sirs_back(&self.mission, &self.places),
        }
    }

    /// Returns the plan with the SIRs of its positions against all interferers of `scene`.
    fn against(self, scene: &Scene) -> Self {
        let chain = self.chain();
        // Relays at the same position have an infinite SIR.
        let [sirs, back] = [scene.hop_sirs(&chain), scene.hop_sirs_back(&chain)].map(|sirs| {
            let limited = sirs.into_iter().map(|sir| sir.min(f64::from(f32::MAX)));
            limited.collect::<Vec<f64>>()
        });
        Self {
            back: WorstBack::of(&self.mission, &sirs, &back),
            sirs,
            ..self
        }
    }
}

/// Returns the data link, for a bandwidth of 1 Hz, if the relays maximise the data rate.
///
/// Their time slots are then fitted: as long as each hop needs. `None` if the relays maximise the SIR.
fn fitted_radio(scenario: &Scenario, free_altitude: bool) -> Option<Radio> {
    let fits = free_altitude && scenario.has_fitted_slots();
    let link = scenario.link.clone().filter(|_| fits)?;
    Some(Radio {
        link,
        bandwidth_hz: 1.0,
    })
}

/// Returns the value that relays maximise in `scene`: the SIR of the worst hop, linear.
///
/// With a `radio` it is the data rate to Rx in fitted slots, bit/s.
fn merit(radio: Option<&Radio>, scene: &Scene, places: &[impl Copy + Into<Place>]) -> f64 {
    let Some(radio) = radio else {
        return scene.chain_sir(places);
    };
    let there = scene.hop_sirs(places);
    if scene.reverse > 0.0 {
        let [rate_bps, _] = radio.both_bps(&there, &scene.hop_sirs_back(places), scene.reverse);
        return rate_bps;
    }
    radio.chain_bps(&there)
}

/// Returns the plan with the fewest relays whose SIR is at least `target`.
///
/// `plan` plans a number of relays, and `sir` returns the SIR of a plan. The search assumes that more relays never have
/// a lower SIR.
fn fewest_of<T>(
    target: f64,
    mut plan: impl FnMut(u16) -> Result<T, NoPlan>,
    sir: impl Fn(&T) -> f64,
) -> Result<T, NoPlan> {
    let mut most: f64 = 0.0;
    let mut meets = |relays: u16| -> Result<Option<T>, NoPlan> {
        match plan(relays) {
            Ok(found) => {
                most = most.max(sir(&found));
                Ok((sir(&found) >= target).then_some(found))
            }
            Err(NoPlan::Unmet(..)) => Ok(None),
            Err(wrong) => Err(wrong),
        }
    };
    let (mut too_few, mut enough) = (0, 1);
    let mut found = loop {
        if let Some(found) = meets(enough)? {
            break found;
        }
        if enough >= MOST_RELAYS {
            let why = Why::Short {
                target,
                most,
                relays: None,
            };
            return Err(NoPlan::Unmet(why, Some(most)));
        }
        (too_few, enough) = (enough, (enough * 2).min(MOST_RELAYS));
    };
    while enough - too_few > 1 {
        let middle = too_few + (enough - too_few) / 2;
        match meets(middle)? {
            Some(better) => (enough, found) = (middle, better),
            None => too_few = middle,
        }
    }
    Ok(found)
}

/// Largest number of relays that the planner tries for a target.
const MOST_RELAYS: u16 = Mission::MAX_RELAYS;

/// Mission, the relays' profiles (power, altitude), and the indices of relays with fixed altitudes.
struct ProfiledMission {
    mission: Mission,
    own: Vec<(u16, Profile)>,
    held: Vec<u16>,
    /// x of Rx, m, rounded down: relays are never beyond Rx.
    end_m: f32,
}

impl ProfiledMission {
    fn new(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Self, NoPlan> {
        let (mission, own) = mission::mission(scenario, relays, tolerance)?;
        let distance_m = narrow(scenario.distance_m);
        let end_m = if f64::from(distance_m) > scenario.distance_m {
            distance_m.next_down()
        } else {
            distance_m
        };
        Ok(Self {
            mission,
            own,
            end_m,
            held: mission::fixed_altitude_relays(scenario, relays),
        })
    }

    fn profile(&self, index: u16) -> Profile {
        self.own
            .iter()
            .find(|(at, _)| *at == index)
            .map_or(self.mission.config().common, |(_, profile)| *profile)
    }

    fn level(&self) -> bool {
        let common = self.mission.config().common;
        self.own
            .iter()
            .all(|(_, own)| !((own.altitude_m - common.altitude_m).abs() > 0.0))
    }

    /// Returns the plan with the relays at `places`, and the SIRs that they have in the mission.
    fn plan(self, places: &[Placement], how: &'static str, proven: bool) -> Plan {
        let mut held: Vec<(Placement, Profile)> = (1..)
            .zip(places)
            .map(|(index, place)| {
                let profile = Profile {
                    altitude_m: place.altitude_m,
                    ..self.profile(index)
                };
                (*place, profile)
            })
            .collect();
        // Relays at Rx, or beyond it by a rounding error, stay in order along x.
        let mut limit_m = self.end_m;
        for (place, _) in held.iter_mut().rev() {
            place.x_m = place.x_m.min(limit_m);
            if place.x_m >= limit_m {
                limit_m = limit_m.next_down();
            }
        }
        let sirs = hop_sirs(&self.mission, &held);
        Plan {
            mission: self.mission,
            back: WorstBack::of(&self.mission, &sirs, &hop_sirs_back(&self.mission, &held)),
            sirs,
            places: held,
            how,
            proven,
            theorem: None,
            most: None,
            fitted: None,
        }
    }
}

/// Returns true if the relays have no minimum separation, or if it does not lower the best SIR.
///
/// `is_as_good` gets the scenario without a minimum separation. It returns `Some(true)` if the best SIR is not higher
/// without the separation, and `None` if it finds no chain.
fn is_free(scenario: &Scenario, is_as_good: impl Fn(&Scenario) -> Option<bool>) -> bool {
    let free = Scenario {
        min_separation_m: 0.0,
        ..scenario.clone()
    };
    !(scenario.min_separation_m > 0.0) || is_as_good(&free) == Some(true)
}

/// Unit of the SIRs that are shown to the user.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Unit {
    /// SIR as a ratio of powers.
    #[default]
    Linear,
    /// SIR in decibels.
    Decibels,
}

impl Unit {
    /// Formats an SIR, given as a linear ratio, in this unit, rounded for display.
    pub fn say(self, sir: f64) -> String {
        match self {
            Self::Linear => format!("{sir:.6}"),
            Self::Decibels => format!("{:.3} dB", 10.0 * sir.log10()),
        }
    }

    /// Formats a requested SIR, given as a linear ratio, in this unit, without rounding.
    pub fn asked(self, sir: f64) -> String {
        match self {
            Self::Linear => format!("{sir}"),
            // Rounds off the error of converting decibels to linear and back.
            Self::Decibels => format!("{} dB", (10.0 * sir.log10() * 1e9).round() / 1e9),
        }
    }

    /// Formats an SIR, given as a linear ratio, in both units; this unit comes first.
    pub fn both(self, sir: f64) -> String {
        let sir_db = 10.0 * sir.log10();
        match self {
            Self::Linear => format!("SIR {sir:.6} ({sir_db:.3} dB)"),
            Self::Decibels => format!("{sir_db:.3} dB (SIR {sir:.6})"),
        }
    }
}
