//! Plans against one interferer or a field: one relay by a theorem, several at their own altitudes.

use uav_relay::optimiser::plan as silent;
use uav_relay::{Band, Mission, MissionConfig, Placement, Profile, Schedule};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;

use crate::fewest::{self, Fewest, Most, best_of_equals};
use crate::single::{Found, aside, theorems, without_interferer};

use super::bound::{Targets, excludes};
use super::{
    NoPlan, Number, Plan, PlanRequest, ProfiledMission, Theorem, Why, fewest_of, is_free,
    one_both_ways,
};

/// Returns the plan with the fewest relays that meet the SIR `target`; the altitudes are fixed.
pub(super) fn level(scenario: &Scenario, target: f64, tolerance: f64) -> Result<Plan, NoPlan> {
    let how = if scenario.reverse > 0.0 {
        "the paper's optimisation problem (Opt), for both directions"
    } else {
        "the paper's optimisation problem (Opt)"
    };
    let plan = fewest(scenario, target, tolerance, how)?;
    let relays = plan.mission.relays();
    let most = best(scenario, relays, tolerance);
    // With different powers fewer relays may do better, so each smaller number is excluded.
    let proven = plan.proven
        || scenario.reverse > 0.0
            && (1..relays)
                .rev()
                .all(|fewer| is_excluded(scenario, fewer, target));
    Ok(Plan {
        most: most.ok().map(|best| best.sir().max(plan.sir())),
        proven,
        ..plan
    })
}

/// Returns the best x of one relay for data in both directions. The relay keeps its altitude, and has y = 0.
pub(super) fn alone_both_ways(scenario: &Scenario, tolerance: f64) -> Result<Plan, NoPlan> {
    let briefed = ProfiledMission::new(scenario, 1, tolerance)?;
    let altitude_m = briefed.profile(1).altitude_m;
    let scene = Scene::new(scenario, 1).ok_or_else(nothing)?;
    let best = one_both_ways::best(&scene, scenario.reverse).ok_or_else(nothing)?;
    let place = Placement::on_line(narrow(best.x_m), altitude_m);
    let plan = briefed.plan(
        &[place],
        "the optimum of one relay for both directions",
        true,
    );
    Ok(Plan {
        theorem: Some(Theorem {
            number: 5,
            case: best.case,
            words: best.words,
        }),
        ..plan
    })
}

/// Returns true if it is proven that no positions of `relays` relays meet `target` toward Rx and Tx.
///
/// The proof shares no code with Algorithm 1, whose result it confirms.
pub(super) fn is_excluded(scenario: &Scenario, relays: u16, target: f64) -> bool {
    let targets = Targets {
        there: target,
        back: scenario.reverse * target,
    };
    Scene::new(scenario, relays).is_some_and(|scene| excludes(&scene, targets))
}

/// Returns the best positions of Algorithm 1 for data in both directions.
///
/// `proven` is set if it is proven that no positions are better.
pub(super) fn best_both_ways(
    scenario: &Scenario,
    relays: u16,
    tolerance: f64,
) -> Result<Plan, NoPlan> {
    let plan = best(scenario, relays, tolerance)?;
    let more = plan.sir() * (1.0 + 2.0 * tolerance);
    let proven = is_excluded(scenario, relays, more);
    Ok(Plan { proven, ..plan })
}

/// Returns the best position of a single relay by a closed solution, such as Theorem 1.
///
/// If the relay has a fixed altitude, its lateral offset is 0.
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
    .ok_or_else(|| NoPlan::Wrong("the relay's position is not between Tx and Rx".to_owned()))?;
    if !(found.sir > 0.0) {
        return Err(nothing());
    }
    let how = [
        "Theorem 1",
        "Theorem 2",
        "Theorem 3",
        "the optimum of one relay with a lateral offset",
    ]
    .get(usize::from(theorem.number) - 1)
    .copied()
    .unwrap_or("a theorem");
    let plan = briefed.plan(&[found.place], how, true);
    Ok(Plan {
        theorem: Some(theorem),
        ..plan
    })
}

/// Returns `mission` with the relay's altitude as the only permitted altitude.
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

/// Returns the plan of Algorithm 1 for relays at fixed altitudes.
///
/// The plan is computed directly, without a simulation of the relays' messages.
pub(super) fn best(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let briefed = ProfiledMission::new(scenario, relays, tolerance)?;
    let target = solved(&briefed)?;
    let places = placed(&briefed, target).ok_or_else(nothing)?;
    let is_one_way = !(scenario.reverse > 0.0);
    let proven = is_one_way
        && briefed.level()
        && is_free(scenario, |free| {
            let most = solved(&ProfiledMission::new(free, relays, tolerance).ok()?).ok()?;
            Some(f64::from(most) <= f64::from(target) * (1.0 + 2.0 * tolerance))
        });
    let how = if is_one_way {
        "Algorithm 1"
    } else {
        "Algorithm 1 for both directions"
    };
    Ok(briefed.plan(&places, how, proven))
}

/// Returns the target SIR, linear, that the relays of `briefed` would agree on in flight.
pub(super) fn solved(briefed: &ProfiledMission) -> Result<f32, NoPlan> {
    silent::solve(&briefed.mission, Schedule::Bracketed, |index| {
        briefed.profile(index)
    })
    .map(|agreed| agreed.target)
    .map_err(|_| nothing())
}

/// Returns the relays' positions for the target SIR `target`; `None` if the chain cannot meet it.
pub(super) fn placed(briefed: &ProfiledMission, target: f32) -> Option<Vec<Placement>> {
    fewest::places(&briefed.mission, target, |index| briefed.profile(index))
}

/// Largest number of relays that are added if rounding errors make the fewest relays miss the target.
const ADDED: u16 = 2;

/// Returns the plan with the fewest relays that give every hop the SIR `target`.
///
/// The relays keep their altitudes. `how` names the method. The SIRs of the plan, in f64, are at least `target`.
pub(super) fn fewest(
    scenario: &Scenario,
    target: f64,
    tolerance: f64,
    how: &'static str,
) -> Result<Plan, NoPlan> {
    let (briefed, proven) = enough(scenario, target, tolerance)?;
    let relays = briefed.mission.relays();
    for number in relays..=relays.saturating_add(ADDED).min(Mission::MAX_RELAYS) {
        if let Some(plan) = meeting(scenario, number, target, tolerance)? {
            let proven = if number == relays {
                proven
            } else {
                (1..number)
                    .rev()
                    .all(|fewer| is_excluded(scenario, fewer, target))
            };
            return Ok(Plan {
                how,
                proven,
                ..plan
            });
        }
    }
    let most = best(scenario, relays, tolerance)?.sir();
    let why = Why::Short {
        target,
        most,
        relays: None,
    };
    Err(NoPlan::Unmet(why, Some(most)))
}

/// Largest number of trials with a raised target in [`meeting`].
const TRIALS: u8 = 8;

/// Returns a plan of `relays` relays whose SIRs in f64 are at least `target`; `None` if there is none.
///
/// The positions are computed in f32, so their SIRs are up to some 1e-6 below the SIR that they are computed for. This
/// SIR is therefore raised a little.
fn meeting(
    scenario: &Scenario,
    relays: u16,
    target: f64,
    tolerance: f64,
) -> Result<Option<Plan>, NoPlan> {
    let mut aim = target;
    for _ in 0..TRIALS {
        let briefed = ProfiledMission::new(scenario, relays, tolerance)?;
        let Some(places) = placed(&briefed, narrow(aim)) else {
            break;
        };
        let plan = briefed.plan(&places, "", false);
        if plan.sir() >= target {
            return Ok(Some(plan));
        }
        aim *= (target / plan.sir()).max(1.0 + f64::from(f32::EPSILON));
    }
    let best = best(scenario, relays, LEAST_TOLERANCE)?;
    Ok((best.sir() >= target).then_some(best))
}

/// Smallest relative tolerance on the SIR in requests to the planner.
const LEAST_TOLERANCE: f64 = 1e-6;

/// Returns the mission of the fewest relays that give every hop the SIR `target`.
///
/// The relays keep their altitudes. The `bool` is true if it is proven that fewer relays do not suffice.
pub(super) fn enough(
    scenario: &Scenario,
    target: f64,
    tolerance: f64,
) -> Result<(ProfiledMission, bool), NoPlan> {
    // The number of relays is not known yet. Profiles of relays beyond it are ignored later.
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

/// Returns the index and profile of every relay in the scenario, even if the plan has fewer relays.
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

// Plans in a field of interference.
//
// The field does not depend on the altitude, and the first and last hop are best at the lowest one. Free altitudes are
// therefore the lowest altitude.

pub(super) fn plan_in_field(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    let scenario = if ask.free_altitude {
        &Scenario {
            altitude_m: scenario.altitude_min_m,
            ..scenario.clone()
        }
    } else {
        scenario
    };
    match ask.number {
        Number::Of(relays) => best_in_field(scenario, relays, ask.tolerance),
        Number::Meeting(target) if scenario.reverse > 0.0 => {
            let plan = |relays| best_in_field(scenario, relays, ask.tolerance);
            let plan = fewest_of(target, plan, Plan::sir)?;
            Ok(Plan {
                most: Some(plan.sir()),
                ..plan
            })
        }
        Number::Meeting(target) => {
            let plan = fewest(scenario, target, ask.tolerance, "Problem 1")?;
            let most = best_in_field(scenario, plan.mission.relays(), ask.tolerance);
            Ok(Plan {
                most: most.ok().map(|best| best.sir().max(plan.sir())),
                ..plan
            })
        }
    }
}

/// Returns the plan with the best positions if the interference is known only along the line Tx-Rx.
fn best_in_field(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let briefed = ProfiledMission::new(scenario, relays, tolerance)?;
    let profile = briefed.profile(1);
    if scenario.reverse > 0.0 {
        let places = placed(&briefed, solved(&briefed)?).ok_or_else(nothing)?;
        return Ok(briefed.plan(&places, "Algorithm 4 for both directions", false));
    }
    if relays == 1 {
        let found =
            without_interferer::best_in_field(&briefed.mission, profile).ok_or_else(nothing)?;
        return Ok(briefed.plan(&[found.place], "Algorithm 3", true));
    }
    if !briefed.own.is_empty() {
        // With different powers or altitudes: the positions that the relays agree on in flight.
        let target = solved(&briefed)?;
        let places = placed(&briefed, target).ok_or_else(nothing)?;
        return Ok(briefed.plan(&places, "Algorithm 4", false));
    }
    let target = best_of_equals(&briefed.mission, profile).ok_or_else(nothing)?;
    let places = placed(&briefed, target).ok_or_else(nothing)?;
    let proven = is_free(scenario, |free| {
        let free = ProfiledMission::new(free, relays, tolerance).ok()?;
        let most = best_of_equals(&free.mission, profile)?;
        Some(f64::from(most) <= f64::from(target) * (1.0 + tolerance))
    });
    Ok(briefed.plan(
        &places,
        "a search over the ranges of x from which the next relays reach Rx",
        proven,
    ))
}

/// Explanation for the user: position of a single relay if the interferer is at Rx.
const DROWNED: &str =
    "the interferer is at Rx, so the SIR of the second hop is 0 wherever the drone is";

/// Explanation for the user: position of a single relay if the interferer is at Tx.
const LEVEL: &str = "the drone goes directly above Rx: the interferer is at Tx, so the first hop has the same SIR everywhere, and the second is best there";

/// Explains to the user why a relay with a fixed altitude goes to its x: a case of Theorem 1.
pub(super) fn along_x(case: theorems::PlaceCase) -> &'static str {
    use theorems::PlaceCase;
    match case {
        PlaceCase::AboveTx => {
            "the drone stays directly above Tx: even there its first hop is weaker than the second, and anywhere else the first hop is even weaker"
        }
        PlaceCase::Crossing => {
            "the drone goes to where both hops are equally good: nearer to Tx the second would be worse, nearer to Rx the first"
        }
        PlaceCase::AboveRx => {
            "the drone goes directly above Rx: even there its first hop is better than the second, so only the second has to improve"
        }
        PlaceCase::BeforeValley => {
            "the drone goes to the better of two places: where both hops are equally good, before the point of the strongest interference; or directly above Rx"
        }
        PlaceCase::OverValley => {
            "the drone goes directly above Rx: its first hop is better than the second even at the point of the strongest interference"
        }
        PlaceCase::Hilltop => {
            "the drone goes to where its first hop is best, because even there the first hop is weaker than the second"
        }
        PlaceCase::BeyondHill => {
            "the drone goes past the position that is best for its first hop, to where both hops are equally good"
        }
        PlaceCase::HillAboveRx => {
            "the drone goes directly above Rx: the interferer is behind Tx, and the first hop is better than the second at every position"
        }
        PlaceCase::Level => LEVEL,
        PlaceCase::SecondHill => {
            "the drone goes past the point of the strongest interference, to where its first hop is best on that side, or to where both hops are equally good"
        }
        PlaceCase::Drowned => DROWNED,
    }
}

/// Explains to the user why a relay with a fixed x flies at its altitude: a case of Theorem 2.
pub(super) fn upward(case: theorems::AltitudeCase) -> &'static str {
    use theorems::AltitudeCase;
    match case {
        AltitudeCase::BothFall => {
            "the drone flies at the lowest permitted altitude: both hops get worse with the altitude"
        }
        AltitudeCase::Crossing => {
            "the drone climbs until both hops are equally good: at a lower altitude the interference weakens the first hop, at a higher one the distance to Rx weakens the second"
        }
        AltitudeCase::End => {
            "the drone flies at the lowest or highest permitted altitude, whichever is better: at no altitude between them are both hops equally good"
        }
        AltitudeCase::Drowned => DROWNED,
    }
}

/// Explains to the user why a relay goes to its x and altitude. Also returns the case of Theorem 3.
pub(super) fn anywhere_above(case: theorems::FreeCase) -> (u8, String) {
    match case {
        theorems::FreeCase::Lowest(case) => (1, format!("at the lowest permitted altitude, {}", along_x(case))),
        theorems::FreeCase::Highest(case) => (2, format!("at the highest permitted altitude, {}", along_x(case))),
        theorems::FreeCase::AboveRx(case) => (3, format!("directly above Rx, {}", upward(case))),
        theorems::FreeCase::Touching => (
            4,
            "the drone goes to an altitude between the lowest and the highest, to the point where no step improves one hop without making the other worse"
                .to_owned(),
        ),
    }
}

/// Explains to the user why a single relay goes to its position with a lateral offset.
pub(super) fn sideways(case: aside::AsideCase) -> &'static str {
    use aside::{AsideCase, EdgeCoordinate};
    match case {
        AsideCase::Touching => {
            "the drone flies low and moves sideways, away from the interferer, to the point where no step improves one hop without making the other worse"
        }
        AsideCase::Hilltop => {
            "the drone flies low and goes to where its first hop is best, because even there the first hop is weaker than the second"
        }
        AsideCase::AboveRx => {
            "the drone goes directly above Rx, at the lowest permitted altitude: even there its first hop is better than the second"
        }
        AsideCase::Edge(EdgeCoordinate::Along) => {
            "the drone goes to a limit of the lateral range and of the altitudes, and along the line to where the worse of the two hops is best"
        }
        AsideCase::Edge(EdgeCoordinate::Across) => {
            "the drone stays at the x of Tx or Rx, at the highest or lowest permitted altitude, and moves sideways to where the worse of the two hops is best"
        }
        AsideCase::Edge(EdgeCoordinate::Upward) => {
            "the drone stays at the x of Tx or Rx, at a limit of the lateral range, and climbs to where the worse of the two hops is best"
        }
        AsideCase::Level => LEVEL,
        AsideCase::Inside => {
            "the drone goes to the best position within its permitted space that a search finds, at the lowest or the highest altitude"
        }
        AsideCase::Wall => {
            "the drone goes to a face of its permitted space, to the point where no step along this face improves one hop without making the other worse"
        }
        AsideCase::Drowned => DROWNED,
    }
}
