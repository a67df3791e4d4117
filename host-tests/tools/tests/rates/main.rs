//! Plans for both directions and for data rates.
//!
//! `COUNT` and `SEED` in the environment set the number of scenes and the first seed.
#![cfg(test)]
#![allow(clippy::float_cmp)]

mod command;
mod free;
mod judge;
mod one;
mod target;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::link::{Access, Link, Radio, RateModel, RateStep};
use uav_relay_scenario::{Interference, Noise, RelayOverride, Scenario, Source};
use uav_relay_tools::plan::carried::Carried;
use uav_relay_tools::plan::rate::{Rate, Rates};
use uav_relay_tools::plan::{Number, PlanRequest, plan};

use judge::{Chain, Model};

/// Relative tolerance of the SIR in requests to the planner.
const TOLERANCE: f64 = 1e-5;

const BANDWIDTH_HZ: f64 = 1e6;

/// Largest number of relays that the independent computation tries.
const MOST: usize = 24;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// Draws a random chain and data link, for the planner and for the independent model `Chain`.
fn drawn(seed: u64, access: Access, has_steps: bool) -> (Scenario, Radio, Chain) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let relays = rng.random_range(1..=16_u16);
    let [tx_w, rx_w] = [[80.0, 80.0], [1.0, 1.0], [80.0, 1.0]][rng.random_range(0..3)];
    let side = if rng.random() { 1.0 } else { -1.0 };
    let source = Source {
        power_w: 10_f64.powf(rng.random_range(0.0..2.0)),
        x_m: rng.random_range(-200.0..1200.0),
        y_m: side * rng.random_range(50.0..800.0),
    };
    let reverse = [0.0, 1.0, rng.random_range(0.02..1.0)][rng.random_range(0..3)];
    let mut scenario = Scenario {
        tx_w,
        rx_w,
        reverse,
        min_separation_m: if rng.random() { 4.0 } else { 0.0 },
        interference: Interference::Sources(vec![source.clone()]),
        ..Scenario::default()
    };
    if rng.random() {
        scenario.noise = Noise {
            power_dbm: Some(rng.random_range(-120.0..-60.0)),
            ..Noise::default()
        };
    }
    let mut powers_w = vec![tx_w];
    powers_w.extend([1.0; MOST]);
    powers_w.push(rx_w);
    if rng.random_bool(0.3) {
        let index = rng.random_range(1..=relays);
        let power_w = rng.random_range(0.2..3.0);
        let own = RelayOverride {
            altitude_m: None,
            power_w: Some(power_w),
        };
        scenario.relays.insert(index, own);
        powers_w[usize::from(index)] = power_w;
    }
    let (model, own) = if has_steps {
        let mut sinr_db: f64 = rng.random_range(-25.0..-5.0);
        let mut bits_per_hz = 0.1;
        let mut steps = Vec::new();
        for _ in 0..10 {
            steps.push(RateStep {
                sinr_db,
                bits_per_hz,
            });
            sinr_db += rng.random_range(1.0..6.0);
            bits_per_hz += rng.random_range(0.1..1.0);
        }
        let own = steps.iter();
        let own = own.map(|step| (10_f64.powf(step.sinr_db / 10.0), step.bits_per_hz));
        (RateModel::Steps(steps.clone()), Model::Steps(own.collect()))
    } else {
        let gap_db = rng.random_range(0.0..6.0);
        (
            RateModel::Shannon { gap_db },
            Model::Gap(10_f64.powf(gap_db / 10.0)),
        )
    };
    let metres = (4.0 * std::f64::consts::PI * 2e9 / 299_792_458.0).powi(2);
    let chain = Chain {
        distance_m: 1000.0,
        altitude_m: 20.0,
        apart_m: scenario.min_separation_m,
        powers_w,
        interferer: [source.power_w, source.x_m, source.y_m],
        loss: [metres * 10_f64.powf(0.01), metres * 10_f64.powf(2.1)],
        noise_w: scenario
            .noise
            .power_dbm
            .map_or(0.0, |dbm| 10_f64.powf((dbm - 30.0) / 10.0)),
        reverse,
        fitted: access == Access::Fitted,
        model: own,
    };
    let radio = Radio {
        link: Link {
            access,
            bandwidth_hz: None,
            model,
        },
        bandwidth_hz: BANDWIDTH_HZ,
    };
    (scenario, radio, chain.with(relays.into()))
}

fn as_good_as_the_judge(access: Access, has_steps: bool) {
    let first = number("SEED", 1);
    let count = number("COUNT", 15);
    let (mut worst, mut short, mut worst_number) = (1.0_f64, 0, 1.0_f64);
    let (mut missed, mut least_of_judge) = (0, 1.0_f64);
    for seed in first..first + count {
        let (scenario, radio, chain) = drawn(seed, access, has_steps);
        let relays = u16::try_from(chain.relays()).unwrap();
        let ask = PlanRequest {
            number: Number::Of(relays),
            free_altitude: false,
            x_m: None,
            tolerance: TOLERANCE,
        };
        let ours = match Carried::new(&scenario, &ask, &radio, relays) {
            Some(carried) => carried.plan(relays).unwrap(),
            None => plan(&scenario, &ask).unwrap(),
        };
        let x: Vec<f64> = ours.places.iter().map(|(at, _)| at.x_m.into()).collect();
        let rate = Rate::of(&ours, &scenario, &radio).worse(scenario.reverse) / BANDWIDTH_HZ;
        let own = chain.rate(&x);
        // With rate steps the rate may depend on the last digit of a position.
        assert!(
            has_steps || (rate / own - 1.0).abs() < 1e-6,
            "SEED={seed}: {rate} {own}"
        );
        let [alone, best] = chain.best(&x);
        if best > 0.0 {
            let share = rate / best;
            worst = worst.min(share);
            // Alone, the independent search can miss positions that the planner finds.
            least_of_judge = least_of_judge.min(alone / best);
            missed += u32::from(alone < 0.999 * best);
            if alone < 0.999 * best {
                println!(
                    "SEED={seed} judge alone {:.6}, {relays} relays r {} at {x:.2?}",
                    alone / best,
                    scenario.reverse
                );
            }
            if share < 0.999 {
                short += 1;
                println!(
                    "SEED={seed} {access:?} steps {has_steps}: {share:.6}, {relays} relays at {x:.2?}"
                );
            }
        }
        // Also compares the best number of relays. The independent computation needs equal powers for this.
        if seed % 3 == 0 && scenario.relays.is_empty() {
            let mut all = chain.clone();
            let rx_w = all.powers_w.pop().unwrap();
            all.powers_w.resize(MOST + 1, 1.0);
            all.powers_w.push(rx_w);
            let rates = Rates::new(&scenario, &ask, &radio, None).unwrap();
            let (best, most) = all.best_number();
            if best > 0.0 {
                let share = rates.best.best_rate_bps / BANDWIDTH_HZ / best;
                worst_number = worst_number.min(share);
                if share < 0.999 {
                    println!(
                        "SEED={seed} {access:?} steps {has_steps}: {share:.6} with {} instead of {most}",
                        rates.best.best_uavs
                    );
                }
            }
        }
    }
    println!(
        "{access:?}, steps {has_steps}: worst {worst:.6}, number {worst_number:.6}, {short} of {count} below 0.999; \
        the judge alone {least_of_judge:.6}, {missed} below 0.999"
    );
    assert!(worst >= 0.999 && worst_number >= 0.999);
}

#[test]
fn equal_slots_by_shannon() {
    as_good_as_the_judge(Access::Slots, false);
}

#[test]
fn equal_slots_by_steps() {
    as_good_as_the_judge(Access::Slots, true);
}

#[test]
fn fitted_slots_by_shannon() {
    as_good_as_the_judge(Access::Fitted, false);
}

#[test]
fn fitted_slots_by_steps() {
    as_good_as_the_judge(Access::Fitted, true);
}
