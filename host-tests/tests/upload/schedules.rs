//! Random schedules of uploads, faults, losses and reboots for eight relays.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::Duration;
use uav_relay_oracle::random::seed;

use super::*;

/// Time limit from the last upload, loss or start to a settled chain, while frames are lost.
const RECOVERY: Duration = Duration::from_millis(300_000);

/// Draws a mission with another interferer, sometimes also another altitude and separation.
fn drawn(base: &Mission, rng: &mut ChaCha8Rng) -> MissionConfig {
    let x_m = rng.random_range(-200.0..1_200.0);
    let y_m = rng.random_range(50.0..600.0);
    let mut config = moved(base, x_m, y_m);
    if rng.random_bool(0.3) {
        let altitude_m = rng.random_range(15.0..60.0);
        config.common.altitude_m = altitude_m;
        config.band = uav_relay::Band::at(altitude_m);
        config.min_separation_m = rng.random_range(0.0..20.0);
    }
    config
}

/// Draws one to three uploads, up to three losses, frame loss up to 50 %. Relays may forget the upload.
fn schedule(rng: &mut ChaCha8Rng) -> Setup {
    let shared = rng.random_bool(0.8);
    let base = mission(8);
    let mut setup = signed(base, shared);
    setup.profiles = own_profiles(rng);
    setup.faults = bad_day(rng);
    setup.settings.predict = rng.random_bool(0.7);
    let keeps = [0.0, 0.5, 1.0][rng.random_range(0..3)];
    setup.forgetful = (1..=8).filter(|_| !rng.random_bool(keeps)).collect();
    setup.seed = rng.random();
    let mut times: Vec<u64> = (0..rng.random_range(1..=3))
        .map(|_| rng.random_range(0..60_000))
        .collect();
    times.sort_unstable();
    for (version, ms) in (1..).zip(times) {
        let end = if rng.random() {
            Side::Upstream
        } else {
            Side::Downstream
        };
        let config = drawn(&base, rng);
        let at = Instant::from_millis(ms);
        setup.uploads.push(upload(&base, end, at, version, config));
    }
    let mut relays: Vec<u16> = (1..=8).collect();
    for _ in 0..rng.random_range(0..=3) {
        let relay = relays.swap_remove(rng.random_range(0..relays.len()));
        // Loss during an upload, or at any time.
        let at = if rng.random() {
            let spec = setup.uploads[rng.random_range(0..setup.uploads.len())];
            spec.at.as_micros() / 1_000 + rng.random_range(0..3_000)
        } else {
            rng.random_range(0..60_000)
        };
        setup.kills.push((relay, Instant::from_millis(at)));
        if !shared || rng.random_bool(0.5) {
            let soon = rng.random_bool(0.5);
            let off = rng.random_range(1..if soon { 2_000 } else { 60_000 });
            setup.boots.push((relay, Instant::from_millis(at + off)));
        }
    }
    let happenings = setup.kills.iter().chain(&setup.boots).map(|(_, at)| *at);
    let uploads = setup.uploads.iter().map(|spec| spec.at);
    let last = happenings.chain(uploads).max().unwrap();
    setup.deadline = last + RECOVERY;
    setup
}

#[test]
fn every_schedule_ends_with_the_newest_mission_flown_by_all_that_are_left() {
    let first = seed(1);
    let usual = if cfg!(debug_assertions) { 600 } else { 10_000 };
    let count = std::env::var("COUNT").map_or(usual, |text| text.parse().unwrap());
    let mut took = Vec::new();
    let mut failed = Vec::new();
    for seed in first..first + count {
        let setup = schedule(&mut ChaCha8Rng::seed_from_u64(seed));
        let outcome = run(setup.clone()).unwrap();
        let last = setup.uploads.last().unwrap().upload;
        if let Err(what) = judge(&setup, &outcome, last.version(), *last.config()) {
            let uploads: Vec<_> = setup
                .uploads
                .iter()
                .map(|spec| (spec.end, spec.at))
                .collect();
            println!(
                "SEED={seed}: {what}; {uploads:?} kills {:?} boots {:?} {:?}",
                setup.kills, setup.boots, setup.settings.wiring
            );
            for m in outcome.moments.iter().rev().take(60).rev() {
                println!("DBG {m:?}");
            }
            for r in &outcome.relays {
                println!("DBG {r:?}");
            }
            failed.push(seed);
        }
        let left = setup.deadline.since(outcome.ended).as_micros();
        took.push(((RECOVERY.as_micros() - left) / 1_000, seed));
    }
    took.sort_unstable();
    let at = |part: usize| took[(took.len() - 1) * part / 100];
    println!(
        "{count} schedules: half settled within {} ms of the last happening, 99 % within {} ms, the slowest (SEED={}) took {} ms",
        at(50).0,
        at(99).0,
        at(100).1,
        at(100).0
    );
    assert!(failed.is_empty(), "{failed:?}");
}
