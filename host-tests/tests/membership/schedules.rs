//! Random schedules of faults for eight relays.

use chacha20::ChaCha8Rng;
use host_tests::flights::{bad_day, own_profiles};
use host_tests::ledger::{lose_relays, run_all};
use rand::RngExt;
use uav_relay_oracle::random::seed;

use super::*;

/// Draws faults for eight relays: up to 50 % of frames lost, 20 % corrupted, up to three lost relays.
fn schedule(rng: &mut ChaCha8Rng) -> Setup {
    let mut setup = paper(8);
    setup.profiles = own_profiles(rng);
    setup.faults = bad_day(rng);
    setup.settings.predict = rng.random_bool(0.7);
    setup.auth = rng.random_bool(0.3);
    setup.seed = rng.random();
    lose_relays(&mut setup, rng, false, |_, rng| {
        // Loss during the first agreement, or later.
        let early = rng.random_bool(0.3);
        rng.random_range(0..if early { 500 } else { 60_000 })
    });
    setup
}

#[test]
fn every_schedule_ends_in_the_remaining_relays_optimum() {
    let usual = if cfg!(debug_assertions) {
        2_000
    } else {
        10_000
    };
    run_all(
        seed(1),
        number("COUNT", usual),
        schedule,
        |setup, outcome| {
            if outcome.ending != Ending::Settled {
                return Err(format!("{:?}", outcome.ending));
            }
            judge(setup, outcome, &left(outcome))
        },
    );
}
