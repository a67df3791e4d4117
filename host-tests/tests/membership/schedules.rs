//! Random schedules of faults for eight relays.

use host_tests::flights::{bad_day, own_profiles};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::Duration;
use uav_relay_oracle::random::seed;
use uav_relay_sim::simulator::outcome::Ending;

use super::*;

/// Time limit to a settled chain, while frames are lost and corrupted: twenty times `dead_after`.
const RECOVERY: Duration = Duration::from_millis(300_000);

/// Draws a fault schedule for eight relays. Loss up to 50 %, corruption up to 20 %, up to three relays lost.
fn schedule(rng: &mut ChaCha8Rng) -> Setup {
    let mut setup = paper(8);
    setup.profiles = own_profiles(rng);
    setup.faults = bad_day(rng);
    setup.settings.predict = rng.random_bool(0.7);
    setup.auth = rng.random_bool(0.3);
    setup.seed = rng.random();
    let mut relays: Vec<u16> = (1..=8).collect();
    for _ in 0..rng.random_range(0..=3) {
        let relay = relays.swap_remove(rng.random_range(0..relays.len()));
        // Loss during the first agreement, or later.
        let early = rng.random_bool(0.3);
        let at = rng.random_range(0..if early { 500 } else { 60_000 });
        setup.kills.push((relay, Instant::from_millis(at)));
        if rng.random_bool(0.5) {
            // Return before the loss is noticed, or after.
            let soon = rng.random_bool(0.5);
            let off = rng.random_range(1..if soon { 2_000 } else { 60_000 });
            setup.boots.push((relay, Instant::from_millis(at + off)));
        }
    }
    let all = setup.kills.iter().chain(&setup.boots);
    let last = all.map(|(_, at)| *at).max().unwrap_or(Instant::ZERO);
    setup.deadline = last + RECOVERY;
    setup
}

#[test]
fn every_schedule_ends_in_the_optimum_of_the_relays_that_are_left() {
    let first = seed(1);
    let count = number(
        "COUNT",
        if cfg!(debug_assertions) {
            2_000
        } else {
            10_000
        },
    );
    let mut took = Vec::new();
    let mut failed = Vec::new();
    for seed in first..first + count {
        let setup = schedule(&mut ChaCha8Rng::seed_from_u64(seed));
        let outcome = run(setup.clone()).unwrap();
        let left = left(&outcome);
        let verdict = if outcome.ending == Ending::Settled {
            judge(&setup, &outcome, &left)
        } else {
            Err(format!("{:?}", outcome.ending))
        };
        if let Err(what) = verdict {
            println!("SEED={seed}: {what}; {:?} {:?}", setup.kills, setup.boots);
            failed.push(seed);
        }
        let recovery = RECOVERY.as_micros() - setup.deadline.since(outcome.ended).as_micros();
        took.push((recovery / 1_000, seed));
    }
    took.sort_unstable();
    let at = |part: f64| {
        let at = ((took.len() - 1) as f64 * part) as usize;
        took[at]
    };
    println!(
        "{count} schedules: half settled within {} ms, 99 % within {} ms, the slowest (SEED={}) took {} ms",
        at(0.5).0,
        at(0.99).0,
        at(1.0).1,
        at(1.0).0
    );
    assert!(failed.is_empty(), "{failed:?}");
}
