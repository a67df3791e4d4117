//! Relays that return between others, and relays in a wrong order.

use rand::SeedableRng;
use uav_relay_sim::simulator::chain::run;

use super::*;

/// Returns the x of the relays' final setpoints, m.
fn ends(outcome: &Outcome) -> Vec<f32> {
    let places = outcome.relays.iter().map(|relay| relay.setpoint.unwrap());
    places.map(|place| place.x_m).collect()
}

/// Returns the final setpoints, x in m, of the chain of `setup` in a run without faults.
fn undisturbed(setup: &Setup) -> Vec<f32> {
    let mut clean = Setup::new(setup.mission);
    clean.seed = 1;
    ends(&run(clean).unwrap())
}

/// Checks that a relay that was switched off for a while gets its former position back.
///
/// While the relay is silent its drone still hovers. The neighbours move closer, but keep clear of the drone.
#[test]
fn a_relay_returning_between_two_others_gets_its_position() {
    for silent in 1..=8 {
        for off in [17, 60, 200] {
            let seed = u64::from(silent) * 1_000 + off;
            let mut setup = eight(&mut ChaCha8Rng::seed_from_u64(seed));
            let expected = undisturbed(&setup);
            setup.kills.push((silent, seconds(150)));
            setup.boots.push((silent, seconds(150 + off)));
            end_at(&mut setup, seconds(150 + off + 240));
            let outcome = run(setup).unwrap();
            let nearest = outcome.nearest;
            assert!(
                outcome.nearest_m() >= floor_m(2),
                "relay {silent} for {off} s: {nearest:?}"
            );
            let ends = ends(&outcome);
            for (is, expected) in ends.iter().zip(&expected) {
                assert!(
                    (is - expected).abs() < 1e-3,
                    "relay {silent} for {off} s: {ends:?}, not {expected:?}"
                );
            }
        }
    }
}

/// Checks that no drone moves if two neighbouring drones start in each other's position.
///
/// The other drones do not know of the swap.
#[test]
fn while_two_drones_are_in_the_wrong_order_all_stay() {
    for first in 0..7 {
        let mut setup = eight(&mut ChaCha8Rng::seed_from_u64(first as u64));
        let flight = setup.flight.as_mut().unwrap();
        flight.start.swap(first, first + 1);
        let before: Vec<f64> = flight.start.iter().map(|at| at[0]).collect();
        end_at(&mut setup, seconds(400));
        let outcome = run(setup).unwrap();
        assert!(outcome.nearest_m() >= floor_m(1), "{:?}", outcome.nearest);
        let ends = ends(&outcome);
        for (is, was) in ends.iter().zip(&before) {
            let off = (f64::from(*is) - was).abs();
            assert!(off <= BIAS_M + NOISE_M, "{ends:?}, not {before:?}");
        }
    }
}
