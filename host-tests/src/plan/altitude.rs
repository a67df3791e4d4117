//! Plans that choose altitudes too, against one interferer: a chain of relays is run in the planner, with the messages and
//! all, and ends where it would end in the air.

use uav_relay::{Method, Placement};

use super::{Briefed, NoPlan, Plan, source};
use crate::scenario::Scenario;
use crate::sim::chain::Chain;
use crate::sim::outcome::Ending;
use crate::sim::setup::Setup;

/// The best places and altitudes of so many relays.
pub(super) fn best(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let briefed = Briefed::new(scenario, relays, tolerance)?;
    let mut setup = Setup::new(briefed.mission);
    setup.settings.method = Method::Joint;
    setup.profiles.clone_from(&briefed.own);
    setup.held.clone_from(&briefed.held);
    let mut chain = Chain::new(setup).map_err(|error| NoPlan::Wrong(error.to_string()))?;
    while !chain.step(100_000) {}
    let outcome = chain.finish();
    let places: Option<Vec<Placement>> =
        outcome.relays.iter().map(|relay| relay.setpoint).collect();
    let Some(places) = places.filter(|_| outcome.ending == Ending::Settled) else {
        return Err(source::nothing());
    };
    Ok(briefed.plan(&places, "joint altitude and distance", false))
}

/// The altitudes of the band at which a common one is tried: what many relays can do, few cannot do worse when each may choose.
const LEVELS: u8 = 9;

/// The fewest relays that meet `target` when they may choose their altitudes.
pub(super) fn fewest(scenario: &Scenario, target: f64, tolerance: f64) -> Result<Plan, NoPlan> {
    fewest_of(
        scenario,
        target,
        |level| source::level(level, target, tolerance),
        |relays| best(scenario, relays, tolerance),
    )
}

/// The fewest relays that meet `target`: between one and the fewest that do `at_level`, at one of the band's altitudes, by
/// halving on what so many reach when `free` to choose. More relays are taken to do no worse.
pub(super) fn fewest_of(
    scenario: &Scenario,
    target: f64,
    at_level: impl Fn(&Scenario) -> Result<Plan, NoPlan>,
    free: impl Fn(u16) -> Result<Plan, NoPlan>,
) -> Result<Plan, NoPlan> {
    let mut found: Option<Plan> = None;
    let mut most: Option<(String, Option<f64>)> = None;
    for step in 0..LEVELS {
        let share = f64::from(step) / f64::from(LEVELS - 1);
        let span = scenario.altitude_max_m - scenario.altitude_min_m;
        let level = Scenario {
            altitude_m: scenario.altitude_min_m + share * span,
            ..scenario.clone()
        };
        match at_level(&level) {
            Ok(plan) => {
                let fewer = |best: &Plan| plan.places.len() < best.places.len();
                if found.as_ref().is_none_or(fewer) {
                    found = Some(plan);
                }
            }
            Err(NoPlan::Unmet(why, best)) => {
                if most.as_ref().is_none_or(|(_, most)| best > *most) {
                    most = Some((why, best));
                }
            }
            Err(wrong) => return Err(wrong),
        }
        if span <= 0.0 {
            break;
        }
    }
    let Some(mut found) = found else {
        let (why, best) = most.unwrap_or_default();
        return Err(NoPlan::Unmet(why, best));
    };
    let (mut too_few, mut enough) = (0, found.mission.relays());
    while enough - too_few > 1 {
        let middle = too_few + (enough - too_few) / 2;
        match free(middle) {
            Ok(plan) if plan.sir() >= target => (enough, found) = (middle, plan),
            Ok(_) | Err(NoPlan::Unmet(..)) => too_few = middle,
            Err(wrong) => return Err(wrong),
        }
    }
    Ok(Plan {
        most: found.most.or_else(|| Some(found.sir())),
        proven: false,
        ..found
    })
}
