//! Flights with a guard. No two drones come nearer than the separation, whatever is lost, late or silent.

use chacha20::ChaCha8Rng;
use host_tests::flights::{APART_M, SEPARATION_M, eight_apart, end_at, guard};
use rand::{RngExt, SeedableRng};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::{Ending, Moment};

use super::*;

/// Returns the setup of a flight of eight drones with motion guards on one radio channel.
fn guarded(rng: &mut ChaCha8Rng) -> Setup {
    let mut setup = Setup::on_shared_channel(eight_apart(SEPARATION_M));
    guard(&mut setup, rng);
    setup.seed = rng.random();
    setup
}

#[test]
fn without_losses_all_drones_arrive_and_keep_apart() {
    for seed in 1..=40 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = guarded(&mut rng);
        setup.faults.loss = rng.random_range(0.0..0.5);
        setup.deadline = seconds(2_000);
        let outcome = run(setup.clone()).unwrap();
        let nearest = outcome.nearest_m();
        println!(
            "{seed}: {:?} after {} s, nearest {nearest} m",
            outcome.ending,
            outcome.ended.as_micros() / 1_000_000
        );
        assert_eq!(outcome.ending, Ending::Settled, "SEED={seed}");
        assert!(nearest >= APART_M, "SEED={seed}");
        assert_eq!(outcome.unsafe_setpoints, 0, "SEED={seed}");
    }
}

#[test]
fn drones_keep_away_from_a_silent_hovering_drone() {
    for seed in 1..=200 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = guarded(&mut rng);
        setup.faults = Faults {
            loss: rng.random_range(0.0..0.4),
            corrupt: rng.random_range(0.0..0.2),
            duplicate: rng.random_range(0.0..0.2),
            reorder: rng.random_range(0.0..0.2),
        };
        for _ in 0..rng.random_range(1..=3) {
            let relay = rng.random_range(1..=8);
            let at = rng.random_range(0..90_000);
            setup.kills.push((relay, Instant::from_millis(at)));
            if rng.random_bool(0.5) {
                let back = at + rng.random_range(100..90_000);
                setup.boots.push((relay, Instant::from_millis(back)));
            }
        }
        go_on_until(&mut setup, seconds(240));
        setup.deadline = seconds(241);
        let outcome = run(setup.clone()).unwrap();
        assert!(
            outcome.nearest_m() >= APART_M,
            "SEED={seed}: {} m, {:?} {:?}",
            outcome.nearest_m(),
            setup.kills,
            setup.boots
        );
        assert_eq!(outcome.unsafe_setpoints, 0, "SEED={seed}");
    }
}

/// Checks that no spare (a waiting relay) joins the chain where a lost drone may still hover.
#[test]
fn no_spare_is_called_beside_a_lost_drone() {
    for seed in 1..=10 {
        let mut setup = guarded(&mut ChaCha8Rng::seed_from_u64(seed));
        setup.spares = vec![5];
        setup.kills = vec![(4, seconds(60))];
        setup.leaves = vec![(2, seconds(120), None)];
        end_at(&mut setup, seconds(400));
        let outcome = run(setup.clone()).unwrap();
        let leased = |relay: usize| outcome.relays[relay - 1].observed.leased;
        let members: Vec<usize> = (1..=8)
            .filter(|relay| *relay != 4 && leased(*relay))
            .collect();
        assert_eq!(members, [1, 3, 6, 7, 8], "SEED={seed}");
    }
}

/// Checks that a spare that joins by `stay`, at any x, does not fly through a lost drone.
#[test]
fn a_spare_joins_at_any_x_and_keeps_away_from_a_lost_drone() {
    let mut joined = 0;
    for seed in 1..=60 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = guarded(&mut rng);
        let spare = rng.random_range(2..=7);
        let lost = if rng.random_bool(0.5) {
            spare - 1
        } else {
            spare + 1
        };
        setup.spares = vec![spare];
        let flight = setup.flight.as_mut().unwrap();
        let aside_m = rng.random_range(6.0..40.0_f64);
        flight.start[usize::from(spare) - 1] = [rng.random_range(0.0..1_000.0), aside_m, 20.0];
        setup.kills = vec![(lost, seconds(60))];
        setup.stays = vec![(spare, seconds(120))];
        end_at(&mut setup, seconds(400));
        let outcome = run(setup).unwrap();
        joined += usize::from(outcome.relays[usize::from(spare) - 1].observed.leased);
        assert!(
            outcome.nearest_m() >= APART_M,
            "SEED={seed}: spare {spare}, lost {lost}, {:?}",
            outcome.nearest
        );
        assert_eq!(outcome.unsafe_setpoints, 0, "SEED={seed}");
    }
    println!("{joined} of 60 spares are in the chain");
}

/// Checks that drones keep apart while a relay leaves. Its drone then hovers at its place.
#[test]
fn drones_keep_away_from_a_relay_that_leaves() {
    let mut free = 0;
    for seed in 1..=40 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = guarded(&mut rng);
        setup.faults.loss = rng.random_range(0.0..0.3);
        setup.settings.respacing = Duration::from_millis(rng.random_range(0..20_000));
        let leaver = rng.random_range(1..=8);
        setup.leaves = vec![(
            leaver,
            Instant::from_millis(rng.random_range(0..90_000)),
            None,
        )];
        end_at(&mut setup, seconds(400));
        let outcome = run(setup).unwrap();
        let is_free = |moment: &&Moment| moment.what == TimelineEvent::MayLeave;
        free += outcome.moments.iter().filter(is_free).count();
        assert!(
            outcome.nearest_m() >= APART_M,
            "SEED={seed}: relay {leaver}, {} m",
            outcome.nearest_m()
        );
        assert_eq!(outcome.unsafe_setpoints, 0, "SEED={seed}");
    }
    println!("{free} of 40 relays may leave");
    assert!(free >= 38, "{free}");
}

/// Checks that some drones come too close without a motion guard. Otherwise the tests with guards would prove nothing.
#[test]
fn without_a_guard_some_drones_come_too_close() {
    let close = (1..=40).any(|seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut setup = guarded(&mut rng);
        setup.settings.guard = None;
        setup.deadline = seconds(2_000);
        let outcome = run(setup).unwrap();
        outcome.nearest_m() < APART_M
    });
    assert!(close);
}
