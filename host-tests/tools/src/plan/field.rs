//! Plans in a field of interference.
//!
//! The field does not depend on the altitude, and the outer hops are best at the lowest one, so free altitudes reduce to that.

use uav_relay::planning::fleet;
use uav_relay::planning::single::without_interferer;

use super::found::{NoPlan, Plan};
use super::profiles::{ProfiledMission, is_free};
use super::request::{Number, PlanRequest};
use super::source::{fewest, nothing, placed, solved};
use uav_relay_scenario::Scenario;

pub(super) fn plan(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    let scenario = if ask.free_altitude {
        &Scenario {
            altitude_m: scenario.altitude_min_m,
            ..scenario.clone()
        }
    } else {
        scenario
    };
    match ask.number {
        Number::Of(relays) => best(scenario, relays, ask.tolerance),
        Number::Meeting(target) => {
            let plan = fewest(scenario, target, ask.tolerance, "Problem 1")?;
            let most = best(scenario, plan.mission.relays(), ask.tolerance);
            Ok(Plan {
                most: most.ok().map(|best| best.sir()),
                ..plan
            })
        }
    }
}

/// Returns the best positions of `relays` relays.
fn best(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let briefed = ProfiledMission::new(scenario, relays, tolerance)?;
    let profile = briefed.profile(1);
    if relays == 1 {
        let found =
            without_interferer::best_in_field(&briefed.mission, profile).ok_or_else(nothing)?;
        return Ok(briefed.plan(&[found.place], "Algorithm 3", true));
    }
    if !briefed.own.is_empty() {
        // Different powers or altitudes: the positions that the relays agree on by themselves.
        let target = solved(&briefed)?;
        let places = placed(&briefed, target).ok_or_else(nothing)?;
        return Ok(briefed.plan(&places, "Algorithm 4", false));
    }
    let target = fleet::best_of_equals(&briefed.mission, profile).ok_or_else(nothing)?;
    let places = placed(&briefed, target).ok_or_else(nothing)?;
    let proven = is_free(scenario, |free| {
        let free = ProfiledMission::new(free, relays, tolerance).ok()?;
        let most = fleet::best_of_equals(&free.mission, profile)?;
        Some(f64::from(most) <= f64::from(target) * (1.0 + tolerance))
    });
    Ok(briefed.plan(&places, "ranges that can be continued to Rx", proven))
}
