//! Plans against one interferer: one relay by a theorem, several at their own altitudes.

use uav_relay::optimiser::plan as silent;
use uav_relay::planning::fleet::{Fewest, Most};
use uav_relay::planning::single::{Found, aside, theorems};
use uav_relay::{Band, Mission, MissionConfig, Placement, Profile, Schedule};

use super::cases::{along_x, anywhere_above, sideways, upward};
use super::found::{NoPlan, Plan, Theorem, Why};
use super::profiles::{ProfiledMission, is_free};
use super::request::PlanRequest;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::number::narrow;

/// Returns the fewest relays at their own altitudes, by eq. (Opt).
pub(super) fn level(scenario: &Scenario, target: f64, tolerance: f64) -> Result<Plan, NoPlan> {
    let plan = fewest(scenario, target, tolerance, "eq. (Opt)")?;
    let most = best(scenario, plan.mission.relays(), tolerance);
    Ok(Plan {
        most: most.ok().map(|best| best.sir()),
        ..plan
    })
}

/// Returns the best position of one relay, by a theorem or beside the line. With a fixed altitude it stays above the line.
pub(super) fn alone(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    let briefed = ProfiledMission::new(scenario, 1, ask.tolerance)?;
    let profile = briefed.profile(1);
    let mission = if briefed.held.is_empty() {
        briefed.mission
    } else {
        at_one_altitude(&briefed.mission, profile)
    };
    let (found, theorem) = if let Some(x_m) = ask.x_m {
        second(&mission, narrow(x_m), profile.power_w)
    } else if ask.free_altitude && briefed.held.is_empty() && !mission.config().lateral.is_single()
    {
        beside(&mission, profile.power_w)
    } else if ask.free_altitude {
        third(&mission, profile.power_w)
    } else {
        first(&mission, profile)
    }
    .ok_or_else(|| NoPlan::Wrong("the place is not between Tx and Rx".to_owned()))?;
    if !(found.sir > 0.0) {
        return Err(nothing());
    }
    let how = ["Theorem 1", "Theorem 2", "Theorem 3", "one relay aside"]
        .get(usize::from(theorem.number) - 1)
        .copied()
        .unwrap_or("a theorem");
    let plan = briefed.plan(&[found.place], how, true);
    Ok(Plan {
        theorem: Some(theorem),
        ..plan
    })
}

/// Returns the mission with the relay's own altitude as its band.
fn at_one_altitude(mission: &Mission, profile: Profile) -> Mission {
    let config = MissionConfig {
        band: Band::at(profile.altitude_m),
        common: profile,
        ..*mission.config()
    };
    Mission::try_new(config).unwrap_or(*mission)
}

pub(super) fn nothing() -> NoPlan {
    let why = "no placement gives every hop an SIR above 0";
    NoPlan::Unmet(Why::Plain(why.to_owned()), Some(0.0))
}

fn first(mission: &Mission, profile: Profile) -> Option<(Found, Theorem)> {
    let (found, case) = theorems::best_at_altitude(mission, profile)?;
    Some((
        found,
        Theorem {
            number: 1,
            case: case.printed(),
            words: along_x(case).to_owned(),
        },
    ))
}

fn second(mission: &Mission, x_m: f32, power_w: f32) -> Option<(Found, Theorem)> {
    let (found, case) = theorems::best_at_x(mission, x_m, power_w)?;
    Some((
        found,
        Theorem {
            number: 2,
            case: case.printed(),
            words: upward(case).to_owned(),
        },
    ))
}

fn third(mission: &Mission, power_w: f32) -> Option<(Found, Theorem)> {
    let (found, case) = theorems::best_free(mission, power_w)?;
    let (number, words) = anywhere_above(case);
    Some((
        found,
        Theorem {
            number: 3,
            case: number,
            words,
        },
    ))
}

fn beside(mission: &Mission, power_w: f32) -> Option<(Found, Theorem)> {
    let (found, case) = aside::best_place(mission, power_w)?;
    Some((
        found,
        Theorem {
            number: 4,
            case: case.number(),
            words: sideways(case).to_owned(),
        },
    ))
}

/// Returns the best positions of relays at their own altitudes: Algorithm 1 without messages.
pub(super) fn best(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let briefed = ProfiledMission::new(scenario, relays, tolerance)?;
    let target = solved(&briefed)?;
    let places = placed(&briefed, target).ok_or_else(nothing)?;
    let proven = briefed.level()
        && is_free(scenario, |free| {
            let most = solved(&ProfiledMission::new(free, relays, tolerance).ok()?).ok()?;
            Some(f64::from(most) <= f64::from(target) * (1.0 + 2.0 * tolerance))
        });
    Ok(briefed.plan(&places, "Algorithm 1", proven))
}

/// Returns the target that the relays would agree on.
pub(super) fn solved(briefed: &ProfiledMission) -> Result<f32, NoPlan> {
    silent::solve(&briefed.mission, Schedule::Bracketed, |index| {
        briefed.profile(index)
    })
    .map(|agreed| agreed.target)
    .map_err(|_| nothing())
}

/// Returns the relays' positions for a target.
pub(super) fn placed(briefed: &ProfiledMission, target: f32) -> Option<Vec<Placement>> {
    let mut places = vec![Placement::default(); usize::from(briefed.mission.relays())];
    let profile_of = |index| briefed.profile(index);
    briefed
        .mission
        .places_for(target, profile_of, &mut places)
        .then_some(places)
}

/// Returns the fewest relays at their own altitudes, and their positions for the target.
pub(super) fn fewest(
    scenario: &Scenario,
    target: f64,
    tolerance: f64,
    how: &'static str,
) -> Result<Plan, NoPlan> {
    let (briefed, proven) = enough(scenario, target, tolerance)?;
    let places = placed(&briefed, narrow(target)).ok_or_else(nothing)?;
    Ok(briefed.plan(&places, how, proven))
}

/// Returns the mission of the fewest relays that meet `target`, and true if that is proven. Relays are at their own altitudes.
pub(super) fn enough(
    scenario: &Scenario,
    target: f64,
    tolerance: f64,
) -> Result<(ProfiledMission, bool), NoPlan> {
    // The number is not known yet: profiles of relays beyond it are ignored later.
    let alone = ProfiledMission::new(scenario, 1, tolerance)?;
    let own = ProfiledMission {
        own: own_profiles(scenario, &alone.mission),
        ..alone
    };
    let profile_of = |index| own.profile(index);
    if let Some(found) = Fewest::of(&own.mission, narrow(target), profile_of) {
        let briefed = ProfiledMission::new(scenario, found.relays, tolerance)?;
        return Ok((briefed, found.proven));
    }
    let most = Most::of(&own.mission, profile_of).ok_or_else(nothing)?;
    let best = f64::from(most.target);
    let why = Why::Short {
        target,
        most: best,
        relays: Some(most.relays),
    };
    Err(NoPlan::Unmet(why, Some(best)))
}

/// Returns the profiles of all relays that the scenario lists, whatever their number.
fn own_profiles(scenario: &Scenario, mission: &Mission) -> Vec<(u16, Profile)> {
    let common = mission.config().common;
    scenario
        .relays
        .iter()
        .map(|(&index, own)| {
            let profile = Profile {
                altitude_m: own.altitude_m.map_or(common.altitude_m, narrow),
                power_w: own.power_w.map_or(common.power_w, narrow),
            };
            (index, profile)
        })
        .collect()
}
