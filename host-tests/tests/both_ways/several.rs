//! Two-way chains with several interferers, placed by the hypothetical one that replaces them. The judge places
//! relays for the sum.

use host_tests::placing::{generator, places, solve, xs};
use rand::RngExt;
use uav_relay_oracle::random::count;
use uav_relay_scenario::mission::mission;
use uav_relay_scenario::{Interference, Scenario, Source};

use super::judge::Chain;
use super::scenes::{ENDS, log_uniform, narrow};
use super::shares::Shares;

/// Checks two-way chains that are placed for one hypothetical interferer in place of the real ones.
///
/// Positions chosen for both directions must have a higher median SIR than positions chosen for one direction.
#[test]
fn places_for_both_directions_beat_one_way_ones_against_several() {
    let mut rng = generator(3325);
    let [mut both_ways, mut one_way, mut ignored] = [(); 3].map(|()| Shares::default());
    for round in 0..count(20) {
        let ends = ENDS[round % 3];
        let sources: Vec<[f64; 3]> = (0..rng.random_range(2..=4))
            .map(|_| {
                [
                    narrow(log_uniform(&mut rng, 1.0, 100.0)),
                    narrow(rng.random_range(-200.0..=1200.0)),
                    narrow(rng.random_range(50.0..=800.0)),
                ]
            })
            .collect();
        let relays = rng.random_range(1..=12);
        let mut scenario = Scenario {
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
            reverse: narrow([1.0, log_uniform(&mut rng, 0.05, 1.0)][round % 2]),
            ..Scenario::default()
        };
        let mut powers_w = vec![scenario.uav_w; usize::from(relays) + 2];
        (powers_w[0], powers_w[usize::from(relays) + 1]) = (ends[0], ends[1]);
        let (stand_in, _) = mission(&scenario, relays, 1e-5).unwrap();
        let channel = stand_in.config().channel;
        assert!((channel.eta() / channel.mu_los() - 1.0).abs() < 1e-9);
        let mut chain = Chain {
            distance_m: scenario.distance_m,
            powers_w,
            altitude_m: scenario.altitude_m,
            interferer: sources[0],
            others: sources[1..].to_vec(),
            field: Vec::new(),
            loss: [channel.eta(), channel.mu_nlos()],
            noise_w: 0.0,
            reverse: scenario.reverse,
        };
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
