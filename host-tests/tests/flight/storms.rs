//! Random faults of a chain in flight.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | losses | 0 to 60 %, in bursts of up to 20 frames in 50 %; up to 10 % corrupted, 10 % duplicated, 10 % late |
//! | cuts | up to 4 in 180 s, 2 s to 100 s long |
//! | one-way links | up to 4, 2 s to 100 s long |
//! | relays switched off | up to 3, half of them on again within 60 s |
//! | without a quorum | hold in 50 %, else leave |

use rand::SeedableRng;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::WithoutQuorum;
use uav_relay_oracle::random::seed;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::{Bursts, Faults, OneWayFailure};

use super::*;

const STORM_S: u64 = 180;

/// Draws the begin and the end of a fault. The end is never `None`.
///
/// The fault begins in the storm, which is the phase of random faults.
fn span(rng: &mut ChaCha8Rng) -> (Instant, Option<Instant>) {
    let from = rng.random_range(0..STORM_S * 1_000);
    let until = from + rng.random_range(2_000..100_000);
    let at = Instant::from_millis;
    (at(from), Some(at(until)))
}

fn storm(seed: u64) -> Setup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rng = &mut rng;
    let mut setup = eight(rng);
    let loss = rng.random_range(0.0..0.6);
    setup.faults = Faults {
        loss,
        corrupt: rng.random_range(0.0..0.1),
        duplicate: rng.random_range(0.0..0.1),
        reorder: rng.random_range(0.0..0.1),
    };
    if rng.random() {
        setup.burst = rng.random_range(Bursts::shortest(loss)..20.0);
    }
    for _ in 0..rng.random_range(0..=4) {
        let (from, until) = span(rng);
        let after = rng.random_range(1..8);
        setup.partitions.push(Partition { after, from, until });
    }
    for _ in 0..rng.random_range(0..=4) {
        let (from, until) = span(rng);
        let by = rng.random_range(1..=8);
        let of = (by + rng.random_range(0..7)) % 8 + 1;
        setup.deaf.push(OneWayFailure {
            by,
            of,
            from,
            until,
        });
    }
    let mut relays: Vec<u16> = (1..=8).collect();
    for _ in 0..rng.random_range(0..=3) {
        let relay = relays.swap_remove(rng.random_range(0..relays.len()));
        let at = rng.random_range(0..STORM_S * 1_000);
        setup.kills.push((relay, Instant::from_millis(at)));
        if rng.random() {
            let back = at + rng.random_range(100..60_000);
            setup.boots.push((relay, Instant::from_millis(back)));
        }
    }
    if rng.random() {
        let leaves = WithoutQuorum::Leave {
            y_m: rng.random_range(-40.0..40.0),
            up_m: rng.random_range(0.0..30.0),
        };
        setup.settings.without_quorum = leaves;
        let guard = setup.settings.guard;
        setup.settings.guard = guard.map(|guard| guard.with_room_for(leaves));
    }
    end_at(&mut setup, seconds(STORM_S + 60));
    setup
}

#[test]
fn drones_keep_apart_in_storms_of_relay_faults() {
    let first = seed(1);
    let count = number("COUNT", 300);
    let storms = (first..first + count).into_par_iter().map(|seed| {
        let setup = storm(seed);
        let starts = if setup.boots.is_empty() { 1 } else { 2 };
        (seed, starts, run(setup).unwrap())
    });
    let mut least_m = f64::INFINITY;
    let mut failed = Vec::new();
    for (seed, starts, outcome) in storms.collect::<Vec<_>>() {
        let margin = outcome.nearest_m() - floor_m(starts);
        least_m = least_m.min(margin);
        let most_flying = outcome.watched.unwrap().most_flying;
        if margin < 0.0 || most_flying > 1 || outcome.unsafe_setpoints > 0 {
            failed.push((seed, outcome.nearest, most_flying, outcome.unsafe_setpoints));
        }
    }
    println!("{count} storms: never nearer than {least_m:.2} m above the bound");
    assert!(failed.is_empty(), "{} failed: {failed:?}", failed.len());
}
