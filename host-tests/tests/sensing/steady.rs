//! Stability. No activity in a static world, equal estimates at all relays, and no use of a broken sensor.

use rayon::prelude::*;
use uav_relay::{Duration, Instant, Interference};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::true_interference::{BrokenReading, BrokenReceiver};

use uav_relay_tools::listening::{RandomScene, quantile};

use crate::count;
use crate::wrong::{named, share};

/// Checks that a fixed interferer leads to at most five new agreements in an hour of measurements.
#[test]
fn with_a_fixed_interferer_estimates_stop_changing() {
    let seeds: Vec<u64> = (0..count(12)).collect();
    let found: Vec<u32> = seeds
        .into_par_iter()
        .map(|seed| {
            let relays = [3, 5, 8, 20][seed as usize % 4];
            let wild = RandomScene::new(seed, relays, 1);
            let mut setup = wild.setup(Interference::Unknown).unwrap();
            let true_interference = setup.true_interference.as_mut().unwrap();
            true_interference.period = Duration::from_millis(1_000);
            true_interference.until = Instant::from_millis(3_600_000);
            setup.deadline = Instant::from_millis(3_700_000);
            let outcome = run(setup).unwrap();
            // The first agreement is made without an estimate.
            let found = outcome.snapshots.last().unwrap().agreements - 1;
            let last = outcome
                .snapshots
                .iter()
                .position(|stand| stand.agreements == found + 1);
            let at = outcome.snapshots[last.unwrap()].at.as_micros() / 1_000_000;
            println!("seed {seed}: {relays} relays, {found} agreements, the last after {at} s");
            found
        })
        .collect();
    assert!(found.iter().all(|found| *found <= 5), "{found:?}");
}

#[test]
fn under_faults_all_estimates_are_equal_to_the_bit() {
    let seeds: Vec<u64> = (0..count(20)).collect();
    let mut shares: Vec<f64> = seeds
        .into_par_iter()
        .map(|seed| {
            let wild = RandomScene::new(seed, 8, 1);
            let mut setup = wild.setup(Interference::Unknown).unwrap();
            setup.faults = Faults::BAD_DAY;
            let outcome = run(setup).unwrap();
            assert!(outcome.injected.lost > 0 && outcome.injected.corrupted > 0);
            let told: Vec<_> = outcome.relays.iter().map(|relay| relay.believed).collect();
            assert!(told.iter().all(|one| one.number > 0));
            // The last estimate may still be in transit to some relays, but estimates with one number are equal.
            let bits = |one: &uav_relay::sensing::estimate::NumberedEstimate| format!("{one:?}");
            let alike = told.iter().all(|one| {
                let same = |other: &&_| bits(one) == bits(other);
                let numbered = told.iter().filter(|other| other.number == one.number);
                numbered.clone().filter(same).count() == numbered.count()
            });
            assert!(alike, "{seed}: {told:?}");
            share(&wild, &outcome)
        })
        .collect();
    assert!(quantile(&mut shares, 0.5) >= 0.98, "{shares:?}");
}

/// Checks that a chain of eight detects one wrong sensor and ignores it. The sensor is wrong from the start or from
/// 40 s on.
#[test]
fn a_broken_sensor_is_reported_and_excluded() {
    for (off_db, since_s) in [
        (10.0, 0),
        (-10.0, 0),
        (20.0, 0),
        (-20.0, 0),
        (30.0, 0),
        (-30.0, 0),
        (60.0, 0),
        (-60.0, 0),
        (100.0, 0),
        (60.0, 40),
        (-60.0, 40),
    ] {
        let seeds: Vec<u64> = (0..count(20)).collect();
        let outcomes: Vec<(bool, bool, f64)> = seeds
            .into_par_iter()
            .map(|seed| {
                let wild = RandomScene::new(seed, 8, 1);
                let broken = 1 + (seed % 8) as u16;
                let mut setup = wild.setup(Interference::Unknown).unwrap();
                setup.true_interference.as_mut().unwrap().broken = vec![BrokenReceiver {
                    node: broken,
                    reading: BrokenReading::Times(10_f64.powf(off_db / 10.0)),
                    since: Instant::from_millis(since_s * 1_000),
                }];
                let outcome = run(setup).unwrap();
                let named = named(&outcome);
                let wrong = named.iter().any(|node| *node != broken);
                (named.contains(&broken), wrong, share(&wild, &outcome))
            })
            .collect();
        let named = outcomes.iter().filter(|it| it.0).count();
        let mut shares: Vec<f64> = outcomes.iter().map(|it| it.2).collect();
        let [least, tenth, median] = [0.0, 0.1, 0.5].map(|part| quantile(&mut shares, part));
        let wrong = outcomes.iter().filter(|it| it.1).count();
        println!(
            "{off_db} dB since {since_s} s: named {named} of {}, another one {wrong} times, share median {median:.4}, 10 % {tenth:.4}, least {least:.4}",
            outcomes.len()
        );
        assert!(named == outcomes.len(), "{off_db}");
        assert!(20 * wrong <= outcomes.len(), "{off_db}");
        assert!(median >= 0.95 && least >= 0.9, "{off_db}");
    }
}
