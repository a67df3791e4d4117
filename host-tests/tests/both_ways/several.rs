//! Two-way chains with several interferers. The relays plan for one hypothetical interferer that replaces them, the
//! judge for all of them.

use host_tests::placing::{generator, places, solve, xs};
use rand::{Rng, RngExt};
use uav_relay_oracle::random::count;
use uav_relay_scenario::mission::mission;
use uav_relay_scenario::{Interference, Scenario, Source};
use uav_relay_tools::plan::{Number, PlanRequest, plan};

use super::judge::Chain;
use super::scenes::{ENDS, log_uniform, narrow};
use super::shares::Shares;

/// Draws a random scene with several interferers.
///
/// Returns the scenario, the same chain for the reference search (the judge), and the number of relays.
fn draw(rng: &mut impl Rng, round: usize) -> (Scenario, Chain, u16) {
    let ends = ENDS[round % 3];
    let sources: Vec<[f64; 3]> = (0..rng.random_range(2..=4))
        .map(|_| {
            [
                narrow(log_uniform(rng, 1.0, 100.0)),
                narrow(rng.random_range(-200.0..=1200.0)),
                narrow(rng.random_range(50.0..=800.0)),
            ]
        })
        .collect();
    let relays = rng.random_range(1..=12);
    let scenario = Scenario {
        tx_w: ends[0],
        rx_w: ends[1],
        min_separation_m: 0.0,
        interference: Interference::Sources(
            sources
                .iter()
                .map(|[power_w, x_m, y_m]| Source {
                    power_w: *power_w,
                    x_m: *x_m,
                    y_m: *y_m,
                })
                .collect(),
        ),
        reverse: narrow([1.0, log_uniform(rng, 0.05, 1.0)][round % 2]),
        ..Scenario::default()
    };
    let mut powers_w = vec![scenario.uav_w; usize::from(relays) + 2];
    (powers_w[0], powers_w[usize::from(relays) + 1]) = (ends[0], ends[1]);
    let (stand_in, _) = mission(&scenario, relays, 1e-5).unwrap();
    let channel = stand_in.config().channel;
    assert!((channel.eta() / channel.mu_los() - 1.0).abs() < 1e-9);
    let chain = Chain {
        distance_m: scenario.distance_m,
        powers_w,
        altitude_m: scenario.altitude_m,
        altitudes_m: Vec::new(),
        apart_m: 0.0,
        interferer: sources[0],
        others: sources[1..].to_vec(),
        field: Vec::new(),
        loss: [channel.eta(), channel.mu_nlos()],
        noise_w: 0.0,
        reverse: scenario.reverse,
    };
    (scenario, chain, relays)
}

/// Checks two-way chains whose relays are placed for one interferer that stands for several.
///
/// With positions chosen for both directions, the median SIR must be higher than with positions chosen for one
/// direction.
#[test]
fn places_for_both_directions_beat_one_way_ones_against_several() {
    let mut rng = generator(3325);
    let [mut both_ways, mut one_way, mut ignored] = [(); 3].map(|()| Shares::default());
    for round in 0..count(20) {
        let (mut scenario, mut chain, relays) = draw(&mut rng, round);
        let placed = |scenario: &Scenario| {
            let (mission, own) = mission(scenario, relays, 1e-5).unwrap();
            let agreed = solve(&mission, &own).unwrap();
            xs(&places(&mission, &own, agreed.target))
        };
        let best = chain.best().0;
        both_ways.push(chain.value(&placed(&scenario)) / best);
        scenario.reverse = 0.0;
        let forward = placed(&scenario);
        ignored.push(chain.value(&forward) / best);
        chain.reverse = 1e-12;
        one_way.push(chain.value(&forward) / chain.best().0);
    }
    both_ways.report("several as one, both ways");
    one_way.report("several as one, one way");
    ignored.report("one-way places judged both ways");
    assert!(both_ways.percentile(50.0) > ignored.percentile(50.0));
}

/// Checks that the planner's positions for both directions are as good as the judge's.
///
/// The judge, an independent search, knows all interferers. SIRs must be within 1e-4 of the judge's. Where the planner
/// keeps the positions for the hypothetical interferer (one that stands for all), 1 % suffices.
#[test]
fn the_planner_places_relays_for_the_sum_of_several() {
    let mut rng = generator(3326);
    let [mut kept, mut by_sum] = [(); 2].map(|()| Shares::default());
    let (mut proven, all) = (0, count(30));
    for round in 0..all {
        let (scenario, chain, relays) = draw(&mut rng, round);
        let ask = PlanRequest {
            number: Number::Of(relays),
            free_altitude: false,
            x_m: None,
            tolerance: 1e-4,
        };
        let planned = plan(&scenario, &ask).unwrap();
        let x: Vec<f64> = planned.places.iter().map(|(at, _)| at.x_m.into()).collect();
        let value = chain.value(&x);
        assert!((planned.sir() / value - 1.0).abs() < 1e-6, "{chain:?}");
        let best = chain.best().0.max(chain.refined(&x).0);
        if planned.fitted.unwrap().kept {
            kept.push(value / best);
        } else {
            by_sum.push(value / best);
            proven += usize::from(planned.proven);
            let is_refuted = planned.proven && best > value * (1.0 + 2.1e-4);
            assert!(
                !is_refuted && value / best > 1.0 - 1e-4,
                "{value} {best} {chain:?}"
            );
        }
    }
    kept.report("positions for the hypothetical interferer");
    by_sum.report("positions for the sum");
    println!("{proven} proven");
    assert!(kept.worst() > 0.989 && proven * 4 > all);
}
