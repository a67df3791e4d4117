//! Plans with free altitudes in fitted slots against several interferers.
//!
//! Relays replace the interferers by a hypothetical one.

use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::Placement;
use uav_relay_scenario::link::Access;
use uav_relay_scenario::{Interference, PlannedMethod};
use uav_relay_tools::plan::flown::flown;
use uav_relay_tools::plan::{Plan, PlanRequest, plan};

use super::check_limits;
use super::scenes::{Case, TOLERANCE, number};

/// Draws a chain of 1 to 8 relays with free altitudes and two to four interferers.
fn draw(seed: u64) -> Case {
    let mut case = Case::draw(seed);
    let mut rng = chacha20::ChaCha8Rng::seed_from_u64(seed ^ 0x5e7e_0000);
    case.relays = rng.random_range(1..=8);
    case.scenario.relays.clear();
    case.scenario.altitude_max_m = 300.0;
    if seed.is_multiple_of(3) {
        (case.scenario.lateral_min_m, case.scenario.lateral_max_m) = (-200.0, 200.0);
    }
    let sources = (0..rng.random_range(2..=4)).map(|_| {
        make::source(
            10_f64.powf(rng.random_range(0.0..2.0)),
            rng.random_range(-200.0..1200.0),
            rng.random_range(20.0..800.0),
        )
    });
    case.scenario.interference = Interference::Sources(sources.collect());
    case
}

/// Checks that plans against several interferers are compared by their true rates, not by SIRs.
///
/// A plan has at least 0.99 of the rate at the positions for the hypothetical interferer (one that stands for all), and
/// at those of the best SIR. `plan --out` accepts the relays' positions if they have 0.99 of the plan's rate.
#[test]
fn plans_against_several_interferers_are_compared_by_their_rates() {
    let (first, all) = (number("SEED", 1), number("COUNT", 12));
    let (mut kept, mut accepted, mut gains) = (0, 0, Vec::new());
    for seed in first..first + all {
        let case = draw(seed);
        let what = format!("SEED={seed}: {case:?}");
        let ask = PlanRequest::of(case.relays, true, TOLERANCE);
        let places = |plan: &Plan| {
            plan.places
                .iter()
                .map(|(at, _)| *at)
                .collect::<Vec<Placement>>()
        };
        let rate = |plan: &Plan| 1.0 / case.time(&places(plan));
        let planned = plan(&case.scenario, &ask).unwrap();
        check_limits(&planned.mission, &places(&planned));
        let mut by_sir = case.scenario.clone();
        by_sir.link.as_mut().unwrap().access = Access::Slots;
        let by_sir = rate(&plan(&by_sir, &ask).unwrap());
        let relays = flown(&case.scenario, case.relays, PlannedMethod::Joint, TOLERANCE).unwrap();
        let [own, best] = relays.rates.unwrap();
        assert!((own / rate(&relays.plan) - 1.0).abs() < 1e-9, "{what}");
        assert!(
            best >= own && best >= rate(&planned) * (1.0 - 1e-9),
            "{what}"
        );
        let fitted = planned.fitted.clone().unwrap();
        let loss = fitted.loss.unwrap();
        assert!(fitted.by_rate && (0.0..1.0).contains(&loss), "{what}");
        assert_eq!(fitted.kept, own >= 0.99 * best, "{what}: {own} {best}");
        assert!((own / rate(&planned) - (1.0 - loss)).abs() < 1e-6, "{what}");
        assert_eq!(relays.is_poor(), own < 0.99 * best, "{what}: {own} {best}");
        let text = relays.describe();
        assert!(text.contains(&format!("{own:.4} bit/s/Hz")), "{text}");
        assert!(
            rate(&planned) >= 0.99 * by_sir,
            "{what}: {} {by_sir}",
            rate(&planned)
        );
        kept += usize::from(fitted.kept);
        accepted += usize::from(!relays.is_poor());
        gains.push(1.0 / (1.0 - loss));
    }
    gains.sort_by(f64::total_cmp);
    println!("{kept} of {all} kept, {accepted} accepted, gains {gains:.3?}");
    assert!(0 < accepted && accepted < all as usize);
}
