//! Algorithm 4 with a way back, compared with the judge.

use host_tests::flights::settle;
use host_tests::placing::generator;
use rand::RngExt;
use uav_relay::Mission;
use uav_relay_oracle::random::count;
use uav_relay_sim::simulator::setup::Setup;

use super::placed::reached;
use super::scenes::{ENDS, in_field, log_uniform, mission};
use super::shares::Shares;

const KINDS: [&str; 3] = ["even", "random points", "interferers"];

/// Checks that agreed positions in random interference fields are as good as a reference search's.
///
/// At least 99.5 % of the SIRs must be within 1e-4 of the reference search's SIR, and all within 1 %.
#[test]
fn the_best_places_in_a_field_are_found() {
    let mut rng = generator(3321);
    for (kind, name) in KINDS.iter().enumerate() {
        for noisy in [false, true] {
            let mut shares = Shares::default();
            for round in 0..count(40) {
                let reverse = [1.0, log_uniform(&mut rng, 0.01, 1.0)][round % 2];
                let mut chain = in_field(&mut rng, ENDS[round / 2 % 3], reverse, kind);
                if noisy {
                    let [_, upsilon] = chain.field[0];
                    let noise_w = log_uniform(&mut rng, 1e-3, 1e2) / upsilon;
                    chain.noise_w = f64::from(noise_w as f32);
                }
                let (ours, x) = reached(&chain);
                assert!(!x.is_empty(), "{chain:?}");
                let (mut best, mut places) = chain.best();
                let (from_ours, refined) = chain.refined(&x);
                if from_ours > best {
                    (best, places) = (from_ours, refined);
                }
                let share = ours / best;
                if share < 1.0 - 1e-4 {
                    println!("{share:.6}: {x:?} instead of {places:?} in {chain:?}");
                }
                shares.push(share);
            }
            shares.report(&format!("{name}, noise {noisy}"));
            assert!(shares.worst() > 0.99 && shares.percentile(0.5) > 1.0 - 1e-4);
        }
    }
}

/// Checks that a chain in a field of interference agrees on the positions computed without messages.
///
/// The positions must be equal to the bit.
#[test]
fn a_chain_in_a_field_agrees_on_its_silent_places() {
    let mut rng = generator(3322);
    let mut once = 0;
    for round in 0..60 {
        let reverse = rng.random_range(0.05..=1.0);
        let chain = in_field(&mut rng, ENDS[round % 3], reverse, round % 3);
        let mission: Mission = mission(&chain);
        let outcome = settle(Setup::new(mission));
        for (index, relay) in (1..).zip(&outcome.relays) {
            assert_eq!(
                mission.silent_place(index),
                relay.setpoint,
                "{index} of {chain:?}"
            );
        }
        once += u32::from(outcome.messages == 2 * (u64::from(mission.relays()) - 1));
    }
    println!("{once} of 60 in one round trip");
    assert!(once >= 55, "{once}");
}
