//! Plans with free altitudes, for data in both directions.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::link::{Access, Link, Radio, RateModel};
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Noise, PlannedMethod, Scenario, Source};
use uav_relay_tools::plan::flown::flown;
use uav_relay_tools::plan::rate::Rates;
use uav_relay_tools::plan::{Number, PlanRequest, plan};

use super::{BANDWIDTH_HZ, TOLERANCE, number};

/// Draws a scenario with a range of altitudes and of lateral offsets.
fn drawn(rng: &mut ChaCha8Rng) -> Scenario {
    let aside_m = rng.random_range(20.0..400.0);
    let mut log = |low: f64, high: f64| rng.random_range(low.ln()..high.ln()).exp();
    Scenario {
        tx_w: log(0.1, 100.0),
        rx_w: log(0.1, 100.0),
        reverse: log(0.02, 1.0),
        min_separation_m: 0.0,
        altitude_min_m: 20.0,
        altitude_m: 20.0,
        altitude_max_m: log(30.0, 200.0),
        lateral_min_m: -aside_m,
        lateral_max_m: aside_m,
        interference: Interference::Sources(vec![Source {
            power_w: log(0.3, 100.0),
            x_m: log(1.0, 1000.0),
            y_m: log(50.0, 500.0),
        }]),
        ..Scenario::default()
    }
}

fn request(relays: u16, free_altitude: bool) -> PlanRequest {
    PlanRequest {
        number: Number::Of(relays),
        free_altitude,
        x_m: None,
        tolerance: TOLERANCE,
    }
}

/// Returns the largest worst SIR of one relay on a grid of x, y and altitude, refined three times.
fn scanned(scenario: &Scenario) -> f64 {
    let scene = Scene::new(scenario, 1).unwrap();
    let bounds = [
        (0.0, scenario.distance_m),
        (scenario.lateral_min_m, scenario.lateral_max_m),
        (scenario.altitude_min_m, scenario.altitude_max_m),
    ];
    let (mut best, mut middle) = (0.0_f64, [0.0; 3]);
    for round in 0..4 {
        let spans = bounds.map(|(low, high)| (high - low) * 0.1_f64.powi(round));
        let centre = middle;
        let at = |axis: usize, step: i32| {
            let (low, high) = bounds[axis];
            let from = if round == 0 {
                f64::midpoint(low, high)
            } else {
                centre[axis]
            };
            (from + spans[axis] * (f64::from(step) / 40.0 - 0.5)).clamp(low, high)
        };
        for (i, j, k) in
            (0..=40).flat_map(|i| (0..=40).flat_map(move |j| (0..=40).map(move |k| (i, j, k))))
        {
            let place = [at(0, i), at(1, j), at(2, k)];
            let worst = worst_at(&scene, scenario.reverse, place);
            if worst > best {
                (best, middle) = (worst, place);
            }
        }
    }
    best
}

fn worst_at(scene: &Scene, reverse: f64, [x, y, altitude]: [f64; 3]) -> f64 {
    let source = &scene.sources[0];
    let relay = &scene.relays[0];
    let squared = |dx: f64, dy: f64| dx * dx + dy * dy + altitude * altitude;
    let l1 = squared(x, y);
    let l2 = squared(scene.distance_m - x, y);
    let noise_w = scene.noise_w;
    let heard_w = source.power_w / (scene.eta * squared(x - source.x_m, y - source.y_m)) + noise_w;
    let there = (scene.tx_w / (scene.eta * l1) / heard_w)
        .min(relay.power_w / (scene.eta * l2) / (scene.interference_rx_w() + noise_w));
    let back = (scene.rx_w / (scene.eta * l2) / heard_w)
        .min(relay.power_w / (scene.eta * l1) / (scene.interference_on_ground_w(0.0) + noise_w));
    there.min(back / reverse)
}

/// Checks that a plan of one relay for both directions uses its lateral range and altitudes.
#[test]
fn one_relay_with_free_altitude_both_ways() {
    let mut rng = ChaCha8Rng::seed_from_u64(3361);
    let mut worst = f64::INFINITY;
    for round in 0..number("COUNT", 8) {
        let mut scenario = drawn(&mut rng);
        if round % 2 == 1 {
            // The lateral range is on the side of the interferer, and leads beyond it.
            scenario.lateral_min_m = 0.0;
            scenario.lateral_max_m = 400.0;
            if let Interference::Sources(sources) = &mut scenario.interference {
                sources[0].y_m = rng.random_range(20.0..200.0);
            }
        }
        let found = plan(&scenario, &request(1, true)).unwrap().sir();
        let share = found / scanned(&scenario);
        worst = worst.min(share);
        assert!(share > 0.999, "round {round}: {share} in {scenario:?}");
    }
    println!("one relay, free altitude: worst {worst:.6}");
}

/// Scene whose largest SIR was found by an independent optimiser: SLSQP in f64 from many start chains.
struct Recorded {
    relays: u16,
    lateral_m: [f64; 2],
    altitude_max_m: f64,
    /// Powers of Tx and Rx.
    ends_w: [f64; 2],
    reverse: f64,
    /// Power, x and y of the interferer.
    source: [f64; 3],
    sir: f64,
}

/// Scenes in which the relays' best positions are beyond the interferer, on its side of the line Tx-Rx.
const BEYOND: [Recorded; 6] = [
    Recorded {
        relays: 5,
        lateral_m: [0.0, 347.0],
        altitude_max_m: 20.0,
        ends_w: [59.5, 0.438],
        reverse: 0.137,
        source: [27.0, 786.0, 40.4],
        sir: 0.323_376,
    },
    Recorded {
        relays: 4,
        lateral_m: [0.0, 394.0],
        altitude_max_m: 58.9,
        ends_w: [7.7, 12.9],
        reverse: 0.557,
        source: [3.74, 254.0, 106.0],
        sir: 1.607_564,
    },
    Recorded {
        relays: 4,
        lateral_m: [0.0, 313.0],
        altitude_max_m: 43.1,
        ends_w: [2.84, 1.33],
        reverse: 0.949,
        source: [0.706, 578.0, 117.0],
        sir: 2.151_771,
    },
    Recorded {
        relays: 5,
        lateral_m: [0.0, 298.0],
        altitude_max_m: 20.0,
        ends_w: [2.07, 3.85],
        reverse: 0.91,
        source: [1.09, 806.0, 60.6],
        sir: 3.073_897,
    },
    Recorded {
        relays: 5,
        lateral_m: [-38.2, 226.0],
        altitude_max_m: 20.0,
        ends_w: [4.27, 0.594],
        reverse: 0.0682,
        source: [15.2, 608.0, 49.4],
        sir: 0.242_748,
    },
    Recorded {
        relays: 1,
        lateral_m: [-92.2, 349.0],
        altitude_max_m: 76.2,
        ends_w: [65.5, 48.8],
        reverse: 0.283,
        source: [58.8, 529.0, 43.7],
        sir: 0.729_205,
    },
];

/// Checks plans whose lateral range is narrow or missing on the side opposite the interferer.
#[test]
fn a_lateral_range_on_the_side_of_the_interferer() {
    for recorded in &BEYOND {
        let [tx_w, rx_w] = recorded.ends_w;
        let [lateral_min_m, lateral_max_m] = recorded.lateral_m;
        let [power_w, x_m, y_m] = recorded.source;
        for side in [1.0, -1.0] {
            let limits = [side * lateral_min_m, side * lateral_max_m];
            let scenario = Scenario {
                tx_w,
                rx_w,
                reverse: recorded.reverse,
                min_separation_m: 0.0,
                altitude_min_m: 20.0,
                altitude_m: 20.0,
                altitude_max_m: recorded.altitude_max_m,
                lateral_min_m: limits[0].min(limits[1]),
                lateral_max_m: limits[0].max(limits[1]),
                interference: Interference::Sources(vec![Source {
                    power_w,
                    x_m,
                    y_m: side * y_m,
                }]),
                ..Scenario::default()
            };
            let found = plan(&scenario, &request(recorded.relays, true)).unwrap();
            let share = found.sir() / recorded.sir;
            assert!(share > 0.999, "{share} in {scenario:?}");
        }
    }
}

/// Checks two scenes for one direction in which the solver for both directions finds the better chain.
///
/// The relays in flight use the solver for one direction, so their loss is reported, with a remedy that removes it.
#[test]
fn the_better_solver_for_one_direction() {
    let scenes = [
        (
            2,
            2_748.0,
            40.82,
            [0.0, 1_214.0],
            [29.97, 0.096_31],
            [25.6, 2_422.0, 40.01],
            -59.13,
        ),
        (
            9,
            1_443.0,
            28.86,
            [-850.3, 850.3],
            [9.625, 0.144_9],
            [0.8, 125.4, -6.796],
            -78.64,
        ),
    ];
    for (relays, distance_m, altitude_m, lateral_m, powers_w, [power_w, x_m, y_m], noise_dbm) in
        scenes
    {
        let [tx_w, uav_w] = powers_w;
        let scenario = Scenario {
            distance_m,
            tx_w,
            uav_w,
            min_separation_m: 0.0,
            altitude_min_m: altitude_m,
            altitude_m,
            altitude_max_m: altitude_m,
            lateral_min_m: lateral_m[0],
            lateral_max_m: lateral_m[1],
            interference: Interference::Sources(vec![Source { power_w, x_m, y_m }]),
            noise: Noise {
                power_dbm: Some(noise_dbm),
                ..Noise::default()
            },
            ..Scenario::default()
        };
        let both_ways = Scenario {
            reverse: 1e-6,
            ..scenario.clone()
        };
        let ask = request(relays, true);
        let [one, both] = [&scenario, &both_ways].map(|scenario| plan(scenario, &ask).unwrap());
        assert!(one.sir() > 0.9999 * both.sir(), "{scenario:?}");
        assert!(one.back.is_none() && !one.proven);
        let in_flight =
            |scenario| flown(scenario, relays, PlannedMethod::Joint, TOLERANCE).unwrap();
        let lost = in_flight(&scenario);
        assert!(lost.loss() > 0.1, "{} in {scenario:?}", lost.loss());
        assert!(lost.describe().contains("set link.reverse to 1e-6"));
        assert!(!in_flight(&both_ways).is_poor());
    }
}

/// Checks that free altitudes reach the SIR of each common altitude, against two interferers.
///
/// No plan claims a proof.
#[test]
fn free_altitudes_against_several_interferers_both_ways() {
    let mut rng = ChaCha8Rng::seed_from_u64(3363);
    let mut worst = f64::INFINITY;
    for round in 0..number("COUNT", 4) {
        let mut scenario = drawn(&mut rng);
        let second = Source {
            power_w: rng.random_range(0.5..50.0),
            x_m: rng.random_range(0.0..1000.0),
            y_m: -rng.random_range(50.0..500.0),
        };
        if let Interference::Sources(sources) = &mut scenario.interference {
            sources.push(second);
        }
        let relays = rng.random_range(1..=6);
        let free = plan(&scenario, &request(relays, true)).unwrap();
        assert!(!free.proven, "round {round}: {scenario:?}");
        for step in 0..=4 {
            let span = scenario.altitude_max_m - scenario.altitude_min_m;
            let altitude_m = scenario.altitude_min_m + span * f64::from(step) / 4.0;
            let level = Scenario {
                altitude_m,
                ..scenario.clone()
            };
            let kept = plan(&level, &request(relays, false)).unwrap();
            let share = free.sir() / kept.sir();
            worst = worst.min(share);
            // Relays keep positions for a hypothetical interferer that lose up to 1 %.
            assert!(
                share > 0.99,
                "round {round}, {relays} relays, {altitude_m} m: {share} in {scenario:?}"
            );
        }
    }
    println!("several interferers, free altitudes divided by common ones: worst {worst:.6}");
}

/// Checks plans against two interferers whose largest SIR was found by an independent optimiser.
///
/// The optimiser was SLSQP in f64 from many start chains. From the best chain on the line, each move of a single relay
/// or of a part of the chain lowers the SIR.
#[test]
fn free_positions_against_two_interferers_near_the_best_known() {
    let scenes = [
        (
            3,
            [6.112, 33.58],
            61.78,
            [2.366, 67.25],
            0.7576,
            [[1.261, 1020.0, -127.2], [6.265, 402.7, -292.7]],
            2.894_517,
        ),
        (
            5,
            [20.0, 107.1],
            85.28,
            [38.37, 79.78],
            0.7058,
            [[53.15, 1060.0, -117.7], [62.52, 748.9, 266.1]],
            0.378_645,
        ),
    ];
    for (relays, band_m, side_m, [tx_w, rx_w], reverse, sources, best_sir) in scenes {
        let scenario = Scenario {
            tx_w,
            rx_w,
            reverse,
            min_separation_m: 0.0,
            altitude_min_m: band_m[0],
            altitude_m: band_m[0],
            altitude_max_m: band_m[1],
            lateral_min_m: -side_m,
            lateral_max_m: side_m,
            interference: Interference::Sources(
                sources
                    .map(|[power_w, x_m, y_m]| Source { power_w, x_m, y_m })
                    .into(),
            ),
            ..Scenario::default()
        };
        let share = plan(&scenario, &request(relays, true)).unwrap().sir() / best_sir;
        println!("two interferers, {relays} relays: {share:.6}");
        // Relays keep positions for a hypothetical interferer that lose up to 1 %.
        assert!(share > 0.99, "{share} in {scenario:?}");
    }
}

/// Checks that free altitudes carry at least as much as the configured altitude.
///
/// With equal slots and with channels.
#[test]
fn free_altitudes_carry_no_less() {
    let mut rng = ChaCha8Rng::seed_from_u64(3362);
    let mut worst = f64::INFINITY;
    for round in 0..number("COUNT", 8) {
        let scenario = drawn(&mut rng);
        let access = [Access::Slots, Access::Channels][usize::from(round % 2 == 1)];
        let radio = Radio {
            link: Link {
                access,
                bandwidth_hz: None,
                model: RateModel::Shannon { gap_db: 0.0 },
            },
            bandwidth_hz: BANDWIDTH_HZ,
        };
        let [kept, free] = [false, true].map(|is_free| {
            let rates = Rates::new(&scenario, &request(1, is_free), &radio, None).unwrap();
            rates.all
        });
        for (kept, free) in kept.iter().zip(&free).take(8) {
            let [kept_bps, free_bps] = [kept, free].map(|of| of.rate_bps.worse(scenario.reverse));
            let share = free_bps / kept_bps;
            worst = worst.min(share);
            assert!(
                share > 0.999,
                "round {round}, {} relays, {access:?}: {free_bps} {kept_bps} in {scenario:?}",
                kept.uavs
            );
        }
    }
    println!("free altitudes divided by the configured one: worst {worst:.6}");
}
