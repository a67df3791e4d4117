//! Chains with a way back, by messages.

use host_tests::placing::generator;
use rand::RngExt;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

use super::scenes::{ENDS, adversarial, in_noise, mission, usual};

/// Checks that a two-way chain agrees by messages on exactly the positions computed without messages.
#[test]
fn a_chain_agrees_on_its_silent_places_in_one_round_trip() {
    let mut rng = generator(3306);
    let (mut parked, mut once) = (0, 0);
    for round in 0..60 {
        let ends = ENDS[round % 3];
        let reverse = rng.random_range(0.05..=1.0);
        let chain = if round % 2 == 0 {
            usual(&mut rng, ends, reverse)
        } else {
            adversarial(&mut rng, ends, reverse)
        };
        let chain = if round % 4 < 2 {
            chain
        } else {
            in_noise(&mut rng, chain)
        };
        let mission = mission(&chain);
        let outcome = run(Setup::new(mission)).unwrap();
        assert_eq!(outcome.ending, Ending::Settled, "{chain:?}");
        for (index, relay) in (1..).zip(&outcome.relays) {
            assert_eq!(
                mission.silent_place(index),
                relay.setpoint,
                "{index} of {chain:?}"
            );
        }
        let relays = u64::from(mission.relays());
        once += u32::from(outcome.messages == 2 * (relays - 1));
        let places = outcome
            .relays
            .iter()
            .map(|relay| relay.setpoint.unwrap().x_m);
        parked += u32::from(places.fold(0.0, f32::max) < 10.0);
    }
    println!("{once} of 60 in one round trip, {parked} parked at Tx");
    assert!(once >= 55, "{once}");
}

/// Checks that missions with different requirements for the return direction have different digests.
///
/// The requirements are `reverse` and the power of Rx. Relays with different mission digests form no chain.
#[test]
fn relays_with_other_ways_back_do_not_form_a_chain() {
    let mut rng = generator(3307);
    let chain = usual(&mut rng, ENDS[0], 1.0);
    let digest = |reverse: f64, rx_w: f64| {
        let mut other = chain.clone();
        other.reverse = reverse;
        *other.powers_w.last_mut().unwrap() = rx_w;
        mission(&other).digest()
    };
    let own = digest(1.0, 80.0);
    assert_eq!(own, digest(1.0, 80.0));
    assert_ne!(own, digest(0.5, 80.0));
    assert_ne!(own, digest(1.0, 40.0));
    assert_ne!(own, digest(0.0, 80.0));
    assert_eq!(digest(0.0, 40.0), digest(0.0, 80.0));
}
