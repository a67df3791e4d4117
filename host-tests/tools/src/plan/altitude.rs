//! Plans with free altitudes and lateral positions against one interferer, by the joint method.
//!
//! [`in_flight`] has the positions that the relays agree on in flight. [`best`] has better ones in some scenes.

use core::task::Poll;

use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::joint::{Seat, Solver};
use uav_relay::optimiser::pass::{Behind, Link};
use uav_relay::optimiser::spacing::RequiredPosition;
use uav_relay::place::Station;
use uav_relay::{Mission, Placement};

use super::{LOSS, NoPlan, Plan, ProfiledMission, Why, source};
use uav_relay_scenario::link::Radio;
use uav_relay_scenario::{Scenario, mission};

const MOST: usize = Mission::MAX_RELAYS as usize;

type Chain = Solver<MOST, { MOST / 10 }>;

/// Returns the plan of the joint method, which chooses x, lateral position and altitude of each relay.
///
/// With fitted slots (as long as each hop needs) the positions have the largest data rate. If the method finds no
/// positions, the relays keep the altitudes of the scenario.
///
/// # Errors
/// [`NoPlan`] if the scenario is not a valid mission, or for fitted slots with a table of rate steps.
pub(super) fn in_flight(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let mut briefed = ProfiledMission::new(scenario, relays, tolerance)?;
    briefed.mission = mission::with_access(scenario, &briefed.mission)?;
    match joint(&briefed) {
        Some(places) => {
            let how = if briefed.mission.fitted_gap() > 0.0 {
                "the joint method for time slots fitted to the hops"
            } else if scenario.reverse > 0.0 {
                "the joint method for both directions"
            } else {
                "the joint method"
            };
            Ok(briefed.plan(&places, how, false))
        }
        // Relays in flight also keep their own altitudes then.
        None => source::best(scenario, relays, tolerance),
    }
}

/// Name of the method that found positions for one direction with the solver for both directions.
pub(super) const BY_BOTH: &str =
    "the joint method with the solver for both directions (link.reverse = 1e-6)";

/// Ratio `reverse` with which the solver for both directions finds positions for one direction.
const HARDLY: f64 = 1e-6;

/// Returns the better one of two plans of the joint method for the data of `scenario`.
///
/// The first plan is [`in_flight`]. For one direction the second plan is that of the solver for both directions, with a
/// required SIR toward Tx that is almost 0. Both solvers find local optima, from different initial chains.
///
/// # Errors
/// [`NoPlan`] for the same reasons as [`in_flight`].
pub(super) fn best(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Plan, NoPlan> {
    let own = in_flight(scenario, relays, tolerance)?;
    if scenario.reverse > 0.0 || own.mission.fitted_gap() > 0.0 {
        return Ok(own);
    }
    let other = Scenario {
        reverse: HARDLY,
        ..scenario.clone()
    };
    let Some(places) = joint(&ProfiledMission::new(&other, relays, tolerance)?) else {
        return Ok(own);
    };
    let plan = ProfiledMission::new(scenario, relays, tolerance)?.plan(&places, BY_BOTH, false);
    let is_better = plan.sir() > own.sir() * (1.0 + LOSS);
    Ok(if is_better { plan } else { own })
}

/// Number of bisection steps that find the ratio of SIRs for the largest data rate.
const RATIO_STEPS: u8 = 8;

/// Returns the plan with free altitudes and the largest data rate over `radio`.
///
/// For data in both directions with r below 1, in equal slots or with a frequency for each hop. A rate R to Rx and r R back need the SINRs g(R) and
/// g(r R). Their ratio is not r, and depends on R. At the largest rate both directions carry what is needed, so the
/// joint method is repeated with ratios from g(r R) / g(R) to r, by bisection on the logarithm. R is the rate back
/// at the ratio r, divided by r: a smaller ratio lowers it. The best plan of all steps is returned; at least the plan
/// for the ratio r.
///
/// # Errors
/// [`NoPlan`] for the same reasons as [`in_flight`].
pub(super) fn best_for_rate(
    scenario: &Scenario,
    relays: u16,
    tolerance: f64,
    radio: &Radio,
) -> Result<Plan, NoPlan> {
    let reverse = scenario.reverse;
    let mut best = in_flight(scenario, relays, tolerance)?;
    // Rates to Rx, and back divided by r, while a hop transmits.
    let worst_bps = |sirs: &[f64]| {
        let worst = sirs.iter().copied().reduce(f64::min);
        radio.hop_bps(worst.unwrap_or(0.0))
    };
    let rates = |plan: &Plan| {
        [
            worst_bps(&plan.sirs),
            worst_bps(&plan.sirs_back(scenario)) / reverse,
        ]
    };
    let least = |[there_bps, back_bps]: [f64; 2]| there_bps.min(back_bps);
    let model = &radio.link.model;
    let ratio = |rate_bps: f64| {
        let there = model.sinr(rate_bps / radio.bandwidth_hz)?;
        let back = model.sinr(reverse * rate_bps / radio.bandwidth_hz)?;
        (there > 0.0 && back > 0.0).then(|| (back / there).min(1.0).ln())
    };
    let [there_bps, back_bps] = rates(&best);
    let bounds = ratio(back_bps).zip(ratio(there_bps));
    let Some((mut low, mut high)) = bounds.filter(|_| there_bps < back_bps) else {
        return Ok(best);
    };
    for _ in 0..RATIO_STEPS {
        let middle = f64::midpoint(low, high);
        let other = Scenario {
            reverse: middle.exp(),
            ..scenario.clone()
        };
        let Some(places) = joint(&ProfiledMission::new(&other, relays, tolerance)?) else {
            break;
        };
        let briefed = ProfiledMission::new(scenario, relays, tolerance)?;
        let plan = briefed.plan(
            &places,
            "the joint method for the data rates of both directions",
            false,
        );
        let [there_bps, back_bps] = rates(&plan);
        if there_bps < back_bps {
            high = middle;
        } else {
            low = middle;
        }
        if least([there_bps, back_bps]) > least(rates(&best)) {
            best = plan;
        }
    }
    Ok(best)
}

/// Returns the relays' positions and altitudes by the joint method; `None` if it finds none.
fn joint(briefed: &ProfiledMission) -> Option<Vec<Placement>> {
    let mission = &briefed.mission;
    solved(mission, |index| {
        let holds = briefed.held.contains(&index);
        Seat::of(mission, briefed.profile(index), holds)
    })
}

/// Returns the relays' positions and altitudes by the joint method; `None` if it finds none.
///
/// It computes without messages what the relays compute on board: first the solution for the whole chain, then each
/// relay's final x, which relays in flight find by messages along the chain. `seat_of` returns a relay's power, and the
/// altitudes and lateral positions that it may choose.
pub fn solved(mission: &Mission, seat_of: impl Fn(u16) -> Seat) -> Option<Vec<Placement>> {
    let mut solver = Box::new(Chain::new(mission)?);
    let target = loop {
        if let Poll::Ready(solved) = solver.step(mission, &seat_of) {
            break solved.ok()?;
        }
    };
    if mission.fitted_gap() > 0.0 {
        let place = |index| Some(solver.fitted(mission, &seat_of, index)?.0);
        return (1..=mission.relays()).map(place).collect();
    }
    let own_of = |index| {
        let seat = seat_of(index);
        Station {
            cross_section: solver.at(index, seat),
            power_w: seat.power_w,
        }
    };
    let link_of = |index: u16| Link {
        mission,
        behind: (index > 1).then(|| Behind {
            relay: own_of(index - 1),
            measured_per_w: None,
        }),
        index,
        own: own_of(index),
        measured_per_w: None,
        plain: !solver.holds_back(),
        end_m: Some(solver.end_m(mission, &seat_of, index)),
        fixed_m: None,
    };
    let mut places: Vec<Placement> = Vec::new();
    for index in 1..=mission.relays() {
        let from_m = places.last().map_or(0.0, |place| place.x_m);
        let mut reaches = PerTarget::new();
        link_of(index).extend(&[target], &[from_m], &mut reaches);
        let mut x_m = *reaches.first()?;
        if index == mission.relays() {
            // With data in both directions the last relay may stop before its reach.
            (_, x_m) = link_of(index).ending(target, from_m, x_m)?;
        }
        places.push(own_of(index).cross_section.at(x_m));
    }
    for index in (2..=mission.relays()).rev() {
        let before = usize::from(index) - 2;
        let [from, place] = places.get_mut(before..before + 2)? else {
            return None;
        };
        if let RequiredPosition::At(x_m) =
            link_of(index).required_position(target, from.x_m, place.x_m)?
        {
            from.x_m = x_m;
        }
    }
    Some(places)
}

/// Number of common altitudes at which the fewest relays are computed, to limit the search.
const LEVELS: u8 = 9;

/// Returns the plan with the fewest relays that give every hop the SIR `target`, with free altitudes.
pub(super) fn fewest(scenario: &Scenario, target: f64, tolerance: f64) -> Result<Plan, NoPlan> {
    fewest_of(
        scenario,
        target,
        |level| source::level(level, target, tolerance),
        |relays| best(scenario, relays, tolerance),
    )
}

/// Returns the plan with the fewest relays that give every hop the SIR `target`, by bisection.
///
/// The upper limit of the search is the fewest relays at one common altitude; `at_level` plans the fewest relays for
/// one altitude. `free` plans a given number of relays with free altitudes. The search assumes that more relays never
/// have a lower SIR.
pub(super) fn fewest_of(
    scenario: &Scenario,
    target: f64,
    at_level: impl Fn(&Scenario) -> Result<Plan, NoPlan>,
    free: impl Fn(u16) -> Result<Plan, NoPlan>,
) -> Result<Plan, NoPlan> {
    let mut found: Option<Plan> = None;
    let mut most: Option<(Why, Option<f64>)> = None;
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
