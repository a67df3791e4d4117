//! Reboot of a relay or the leader while the others continue.

use uav_relay::{Method, Phase, Settings};

use crate::hand::{Chain, LOW, WIDE};
use host_tests::bench::Bench;

/// Checks that a rebooted leader agrees with its neighbour within a second, at a `hop_time` of 30 ms.
///
/// The random seed determines the number of the rebooted leader's first pass (a round of messages along the chain).
/// With some seeds this number is close to the number of the last pass before the reboot.
#[test]
fn a_rebooted_leader_is_answered_for_any_seed() {
    // Without prediction a chain needs several passes, so a new number may be just below the last one.
    for predict in [true, false] {
        let settings = Settings {
            predict,
            ..Settings::default()
        };
        let mut longest = (0, 0);
        let mut insisted = 0;
        for seed in 0..2_000 {
            let mut chain = Chain::new(2, 20.0, LOW, settings);
            chain.until(5_000, Bench::holds).unwrap();
            let before = chain.bench.relays[1].setpoint();
            chain.reboot(0, seed);
            let took = chain.until(1_000, Bench::holds);
            let took = took.unwrap_or_else(|| panic!("seed {seed} is never answered"));
            longest = longest.max((took, seed));
            insisted += u32::from(chain.bench.relays[1].stats().stale >= 4);
            assert_eq!(chain.bench.relays[1].setpoint(), before, "seed {seed}");
        }
        println!("predict {predict}: at most {longest:?} (ms, seed); {insisted} insisted");
        assert!(predict || insisted > 0, "no number was just behind");
    }
}

/// Checks that a relay that reboots during the leader's second round of messages gets a position.
///
/// It gets the position by a new view, which is a new agreement on the members of the chain.
#[test]
fn a_relay_rebooted_in_a_pass_gets_a_position_in_a_new_view() {
    let settings = Settings {
        predict: false,
        ..Settings::default()
    };
    for rebooted in 1..3 {
        let mut chain = Chain::new(3, 20.0, LOW, settings);
        let second = |chain: &Bench| chain.relays[0].stats().passes_begun == 2;
        chain.until(1_000, second).unwrap();
        assert!(!chain.bench.holds());
        chain.bench.flying.clear();
        chain.reboot(rebooted, 77);
        let took = chain.until(5_000, Bench::holds);
        println!("relay {}: {took:?} ms", rebooted + 1);
        assert!(took.is_some(), "relay {}", rebooted + 1);
        for (relay, index) in chain.bench.relays.iter().zip(1..) {
            assert_eq!((relay.view().number(), relay.index()), (1, index));
            assert_eq!(relay.mission().relays(), 3);
        }
        assert!(chain.margin().0 >= -2e-4);
    }
}

/// Checks that a relay that reboots in a settled chain gets a position by a new membership view. The relay requests the view when it
/// receives an unknown lease renewal. Without such a renewal it requests the view after a timeout.
#[test]
fn a_relay_rebooted_later_gets_a_position_in_a_new_view() {
    for rebooted in 1..4 {
        let mut chain = Chain::new(4, 20.0, LOW, Settings::default());
        chain.until(5_000, Bench::holds).unwrap();
        chain.reboot(rebooted, 5);
        // The limit is `quiet`, and two hops for each relay.
        let took = chain.until(5_000 + 2 * 4 * 30 + 500, Bench::holds);
        println!("relay {}: {took:?} ms", rebooted + 1);
        assert!(took.is_some(), "{took:?}");
        assert!(
            chain
                .bench
                .relays
                .iter()
                .all(|relay| relay.view().number() == 1)
        );
        assert!(chain.margin().0 >= -2e-4);
    }
}

#[test]
fn a_relay_rebooted_in_a_joint_agreement_meets_the_target() {
    let settings = Settings {
        method: Method::Joint,
        ..Settings::default()
    };
    let mut longest = 0;
    for altitude_m in [20.0, 22.0, 30.0, 60.0, 220.0] {
        for relays in 3..=6 {
            for rebooted in 1..relays - 1 {
                let name = format!("{relays} relays at {altitude_m} m, {}", rebooted + 1);
                let mut chain = Chain::new(relays, altitude_m, WIDE, settings);
                let tail = |chain: &Bench| chain.relays[relays - 1].phase() == Phase::Holding;
                // Each relay knows its position by then, and one sweep confirms it.
                chain.until(60_000, tail).unwrap();
                chain.bench.flying.clear();
                chain.reboot(rebooted, 99);
                let took = chain.until(60_000, Bench::holds);
                longest = longest.max(took.unwrap_or_else(|| panic!("{name}: stuck")));
                let (above, apart_m) = chain.margin();
                assert!(above >= -2e-4, "{name}: {above}");
                assert!(apart_m >= 4.0 * (1.0 - 1e-5), "{name}: {apart_m} m");
            }
        }
    }
    println!("at most {longest} ms");
}
