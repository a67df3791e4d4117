//! Random schedules of uploads, faults, losses and reboots for eight relays.

use chacha20::ChaCha8Rng;
use host_tests::ledger::{lose_relays, number, run_all};
use rand::RngExt;
use uav_relay_oracle::random::seed;

use super::*;

/// Draws a mission with the interferer elsewhere, and sometimes with another altitude and separation.
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

/// Draws one to three uploads, up to three lost relays, and frame loss of up to 50 %. Some relays lose the upload
/// when they reboot.
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
    lose_relays(&mut setup, rng, !shared, |setup, rng| {
        // Loss during an upload, or at any time.
        if rng.random() {
            let spec = setup.uploads[rng.random_range(0..setup.uploads.len())];
            spec.at.as_micros() / 1_000 + rng.random_range(0..3_000)
        } else {
            rng.random_range(0..60_000)
        }
    });
    setup
}

#[test]
fn every_schedule_ends_with_the_newest_mission_flown_by_all() {
    let usual = if cfg!(debug_assertions) { 600 } else { 10_000 };
    run_all(
        seed(1),
        number("COUNT", usual),
        schedule,
        |setup, outcome| {
            let last = setup.uploads.last().unwrap().upload;
            judge(setup, outcome, last.version(), *last.config())
        },
    );
}
