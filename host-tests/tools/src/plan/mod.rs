//! The planner: how many relays a target needs, or where a given number goes, worked out without a message.
//!
//! | interference | file |
//! | --- | --- |
//! | one interferer | `source`: Theorems 1 to 3 for one relay, Algorithm 1 and eq. (Opt) for more |
//! | a field | `field`: Algorithm 3 for one relay, Algorithm 4 and Problem 1, exact for equals, for more |
//! | several interferers | `several`: the hypothetical MSI, and the true sum where that is not good enough |
//!
//! Places are found by the crate's own maths, the same that flies, wherever the crate has it. [`Plan::proven`] says whether what
//! was found is known to be the best there is.

mod altitude;
mod field;
pub mod report;
mod several;
mod source;

use uav_relay::{Mission, Placement, Profile};

use uav_relay_sim::hypothetical::Hypothetical;
use uav_relay_sim::mission::{self, Refusal};
use uav_relay_sim::report::hop_sirs;
use uav_relay_sim::scenario::{Interference, Scenario};

/// How many relays.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// So many, 1 to 1000: the best places are asked for.
    Of(u16),
    /// The fewest that give every hop this SIR, linear, above 0.
    Meeting(f64),
}

/// What a plan is asked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ask {
    /// How many relays.
    pub number: Number,
    /// Whether altitudes may be chosen from the scenario's band.
    pub free_altitude: bool,
    /// Where the only relay has to stand along x, m, 0 to D; its altitude is then chosen from the band.
    pub x_m: Option<f64>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
}

/// Which of the paper's theorems, or what stands in for one, placed the only relay, and by which of its cases.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Theorem {
    /// 1 to 3; 4 for one relay aside, which is not in the paper.
    pub number: u8,
    /// The number of the case there; 0 for one that the paper leaves out.
    pub case: u8,
    /// The case in words.
    pub words: String,
}

/// What became of several interferers.
#[derive(Clone, PartialEq, Debug)]
pub struct Fitted {
    /// The one interferer that stands for all.
    pub hypothetical: Hypothetical,
    /// SIR (linear) against all of them of the places that are best against that one; `None` where there are none.
    pub sir: Option<f64>,
    /// Whether those places were good enough to keep; if not, the plan's are the best against all interferers.
    pub kept: bool,
}

/// Where the relays go.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// The relays' mission.
    pub mission: Mission,
    /// Their places and what they hold, relay 1 first.
    pub places: Vec<(Placement, Profile)>,
    /// SIR (linear) of hops 1 to N + 1.
    pub sirs: Vec<f64>,
    /// How they were found.
    pub how: &'static str,
    /// Whether it is certain that no places are better, or that no fewer relays do.
    pub proven: bool,
    /// Where one of the theorems placed the only relay.
    pub theorem: Option<Theorem>,
    /// For a target: the most that so many relays can have, linear SIR, where that is known.
    pub most: Option<f64>,
    /// Where there are several interferers.
    pub fitted: Option<Fitted>,
}

/// Why there is no plan.
#[derive(Clone, PartialEq, Debug)]
pub enum NoPlan {
    /// The scenario is no mission, or what is asked for does not go with it.
    Wrong(String),
    /// No placement meets what was asked, and the most that was found (linear SIR).
    Unmet(String, Option<f64>),
}

impl From<Refusal> for NoPlan {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::NoRoom => Self::Unmet(refusal.to_string(), None),
            other => Self::Wrong(other.to_string()),
        }
    }
}

/// A mission, and what each relay of it holds.
struct Briefed {
    mission: Mission,
    own: Vec<(u16, Profile)>,
    held: Vec<u16>,
}

impl Briefed {
    fn new(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Self, NoPlan> {
        let (mission, own) = mission::mission(scenario, relays, tolerance)?;
        Ok(Self {
            mission,
            own,
            held: mission::held(scenario, relays),
        })
    }

    fn profile(&self, index: u16) -> Profile {
        self.own
            .iter()
            .find(|(at, _)| *at == index)
            .map_or(self.mission.config().common, |(_, profile)| *profile)
    }

    /// Whether all relays have the same altitude.
    fn level(&self) -> bool {
        let common = self.mission.config().common;
        self.own
            .iter()
            .all(|(_, own)| !((own.altitude_m - common.altitude_m).abs() > 0.0))
    }

    /// The plan of these places, which the crate's own formulas judge.
    fn plan(self, places: &[Placement], how: &'static str, proven: bool) -> Plan {
        let held: Vec<(Placement, Profile)> = (1..)
            .zip(places)
            .map(|(index, place)| {
                let profile = Profile {
                    altitude_m: place.altitude_m,
                    ..self.profile(index)
                };
                (*place, profile)
            })
            .collect();
        Plan {
            mission: self.mission,
            sirs: hop_sirs(&self.mission, &held),
            places: held,
            how,
            proven,
            theorem: None,
            most: None,
            fitted: None,
        }
    }
}

impl Plan {
    /// SIR (linear) of the worst hop.
    pub fn sir(&self) -> f64 {
        self.sirs.iter().copied().reduce(f64::min).unwrap_or(0.0)
    }

    /// The places alone.
    fn chain(&self) -> Vec<Placement> {
        self.places.iter().map(|(place, _)| *place).collect()
    }
}

/// Most relays that a scenario may ask to be told apart while their number is not yet known.
const MOST_RELAYS: u16 = uav_relay::mission::MAX_RELAYS;

/// Plans `ask` in `scenario`.
///
/// Work: some milliseconds; with free altitudes up to some seconds for fifty relays or more.
///
/// # Errors
/// [`NoPlan`]: what is wrong, or what the most is.
pub fn plan(scenario: &Scenario, ask: &Ask) -> Result<Plan, NoPlan> {
    check(scenario, ask)?;
    match &scenario.interference {
        Interference::Field(_) => field::plan(scenario, ask),
        Interference::Sources(sources) if sources.len() > 1 => several::plan(scenario, ask),
        Interference::Sources(_) => source::plan(scenario, ask),
    }
}

/// Whether a least separation costs nothing, as `is_as_good` finds of the scenario without it.
fn is_free(scenario: &Scenario, is_as_good: impl Fn(&Scenario) -> Option<bool>) -> bool {
    let free = Scenario {
        min_separation_m: 0.0,
        ..scenario.clone()
    };
    !(scenario.min_separation_m > 0.0) || is_as_good(&free) == Some(true)
}

/// Whether what is asked for goes together.
fn check(scenario: &Scenario, ask: &Ask) -> Result<(), NoPlan> {
    let Some(x_m) = ask.x_m else { return Ok(()) };
    let d = scenario.distance_m;
    let wrong = if !(0.0..=d).contains(&x_m) {
        format!("--x-m {x_m:?}: must be within 0.0 to {d:?} (geometry.distance_m)")
    } else if ask.number != Number::Of(1) {
        "--x-m is for one relay: it needs --uavs 1".to_owned()
    } else if matches!(scenario.interference, Interference::Field(_)) {
        "--x-m needs an [[interferer]]: in a [field] the altitude does not change what is heard"
            .to_owned()
    } else {
        return Ok(());
    };
    Err(NoPlan::Wrong(wrong))
}
