//! Guarded flights with an upload.

use chacha20::ChaCha8Rng;
use host_tests::flights::{APART_M, SEPARATION_M, guard};
use rand::{RngExt, SeedableRng};

use super::*;

/// Returns the setup of eight drones that take off close together, and a mission to upload. The upload comes in
/// flight or at hover.
fn flight(seed: u64) -> (Setup, MissionConfig) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let base = eight_apart(SEPARATION_M);
    let mut setup = signed(base, true);
    guard(&mut setup, &mut rng);
    setup.seed = rng.random();
    setup.faults.loss = rng.random_range(0.0..0.4);
    let config = moved(
        &base,
        rng.random_range(-100.0..1_100.0),
        rng.random_range(50.0..500.0),
    );
    let at = Instant::from_millis(rng.random_range(1_000..120_000));
    let end = if rng.random() {
        Side::Upstream
    } else {
        Side::Downstream
    };
    setup.uploads = vec![upload(&base, end, at, 1, config)];
    setup.deadline = seconds(2_000);
    (setup, config)
}

#[test]
fn drones_keep_apart_between_two_missions() {
    for seed in 1..=40 {
        let (setup, config) = flight(seed);
        let outcome = run(setup.clone()).unwrap();
        assert!(
            outcome.nearest_m() >= APART_M,
            "SEED={seed}: {}",
            outcome.nearest_m()
        );
        let mut ends = setup.clone();
        // Final setpoints equal those without a guard.
        ends.settings.guard = None;
        judge(&ends, &outcome, 1, config).unwrap_or_else(|what| panic!("SEED={seed}: {what}"));
    }
    // Without a guard some drones come too close, so the test is able to fail.
    let close = (1..=40).any(|seed| {
        let (mut setup, _) = flight(seed);
        setup.settings.guard = None;
        run(setup).unwrap().nearest_m() < APART_M
    });
    assert!(close);
}
