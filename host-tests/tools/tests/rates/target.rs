//! Plans with the fewest relays for a target SIR: SIRs in f64, and positions between Tx and Rx.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::{Interference, Scenario, Source};
use uav_relay_tools::plan::{NoPlan, Number, Plan, PlanRequest, plan};

fn request(number: Number, tolerance: f64) -> PlanRequest {
    PlanRequest {
        number,
        free_altitude: false,
        x_m: None,
        tolerance,
    }
}

fn assert_between(found: &Plan, scenario: &Scenario) {
    for (place, _) in &found.places {
        let x_m = f64::from(place.x_m);
        assert!(
            (0.0..=scenario.distance_m).contains(&x_m),
            "{x_m} in {scenario:?}"
        );
    }
}

/// Checks that a plan for a target SIR meets it in f64, and that no relay is beyond Rx.
///
/// The distances are no f32 numbers, and some targets are the largest SIR of a number of relays.
#[test]
fn a_target_is_met_in_f64() {
    let mut rng = ChaCha8Rng::seed_from_u64(3371);
    let (mut met, mut at_the_limit) = (0, 0);
    for round in 0..super::number("COUNT", 15) * 8 {
        let mut log = |low: f64, high: f64| rng.random_range(low.ln()..high.ln()).exp();
        let distance_m = log(500.0, 60_000.0);
        let scale = distance_m / 1000.0;
        let mut scenario = Scenario {
            distance_m,
            altitude_m: 20.0 * scale,
            altitude_min_m: 20.0 * scale,
            altitude_max_m: 20.0 * scale,
            tx_w: log(0.3, 100.0),
            rx_w: log(0.3, 100.0),
            interference: Interference::Sources(vec![Source {
                power_w: log(0.5, 100.0),
                x_m: distance_m * log(0.05, 1.2),
                y_m: log(20.0, 600.0) * scale,
            }]),
            ..Scenario::default()
        };
        if round % 3 == 0 {
            scenario.reverse = log(0.02, 1.0);
        }
        let relays = rng.random_range(1..=8);
        let most = plan(&scenario, &request(Number::Of(relays), 1e-6)).unwrap();
        assert_between(&most, &scenario);
        let is_limit = round % 4 == 0;
        let part = if is_limit {
            1.0
        } else {
            rng.random_range(0.3..1.2)
        };
        let target = part * most.sir();
        match plan(&scenario, &request(Number::Meeting(target), 1e-4)) {
            Ok(found) => {
                assert!(
                    found.sir() >= target,
                    "round {round}: {} in {scenario:?}",
                    found.sir() / target - 1.0
                );
                assert!(found.most.is_some_and(|most| most >= target));
                assert_between(&found, &scenario);
                met += 1;
                at_the_limit += u32::from(is_limit);
                // Rounding errors may cost one relay.
                let fewest = found.places.len();
                assert!(
                    part > 1.0 || fewest <= usize::from(relays) + 1,
                    "round {round}"
                );
            }
            Err(NoPlan::Unmet(..)) => assert!(part >= 1.0, "round {round}: {scenario:?}"),
            Err(wrong) => panic!("{wrong:?}"),
        }
    }
    println!("{met} targets met, {at_the_limit} of them the largest SIR of a number of relays");
    assert!(at_the_limit > 10);
}
