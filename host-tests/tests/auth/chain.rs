//! Authenticated chains: their positions equal those of plain chains, also with faults and reboots.

use host_tests::fixtures::{self, mission};
use host_tests::flights::settle;
use host_tests::make;
use uav_relay::{Adjust, Auth, Instant, Key, Method, Phase, Settings, Stats, Wiring};
use uav_relay_oracle::random::seed;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission::mission as of_scenario;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::setup::Setup;

use super::net::{KEY, Net, ScheduledEvent};

fn signed(mut setup: Setup) -> Setup {
    setup.settings.auth = Some(make::auth(KEY, 1));
    setup
}

#[test]
fn signing_adds_handshakes_and_changes_no_position() {
    for relays in [1, 2, 3, 8, 50, 200] {
        for setup in [
            Setup::new(mission(relays)),
            Setup::on_shared_channel(mission(relays)),
        ] {
            let plain = settle(setup.clone());
            let outcome = settle(signed(setup));
            assert_eq!(outcome.bits(), plain.bits());
            let sum = |of: fn(&Stats) -> u32| -> u64 {
                outcome
                    .relays
                    .iter()
                    .map(|relay| u64::from(of(&relay.stats)))
                    .sum()
            };
            let links = u64::from(relays - 1);
            // On each link: a sweep and its result, and perhaps two lease renewals with theirs. Plain chains add index
            // claims.
            let messages = sum(|stats| stats.received);
            assert!([2 * links, 6 * links].contains(&messages));
            assert!(plain.messages >= messages);
            assert_eq!(
                sum(|stats| stats.forged + stats.replayed + stats.unsigned),
                0
            );
            let handshakes = outcome.messages - messages;
            println!(
                "N = {relays}: {handshakes} handshakes, {} bytes after {}",
                outcome.bytes, plain.bytes
            );
            assert!(sum(|stats| stats.handshakes) <= handshakes);
            // A link needs three handshakes, or four if both ends begin at once. The leader's first messages may cause
            // three more.
            assert!((3 * links..=4 * links + 3).contains(&handshakes));
        }
    }
}

#[test]
fn faults_on_a_signed_chain_change_no_position() {
    let first = seed(1);
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut setup = Setup::new(mission(8));
        setup.settings.wiring = wiring;
        let expected = settle(setup.clone()).bits();
        setup.faults = Faults::BAD_DAY;
        let mut setup = signed(setup);
        for seed in first..first + 100 {
            setup.seed = seed;
            let outcome = settle(setup.clone());
            assert_eq!(outcome.bits(), expected, "seed {seed}");
            let unsigned: u32 = outcome
                .relays
                .iter()
                .map(|relay| relay.stats.unsigned)
                .sum();
            assert_eq!(unsigned, 0, "a damaged frame is none of the format");
        }
    }
}

#[test]
fn other_methods_give_the_same_positions_when_signed() {
    let scenario = Scenario {
        altitude_max_m: 300.0,
        ..Scenario::default()
    };
    let mut setup = Setup::new(of_scenario(&scenario, 5, 1e-4).unwrap().0);
    for method in [
        Method::Joint,
        Method::Adjust(Adjust {
            rounds: 20,
            ..Adjust::default()
        }),
    ] {
        setup.settings.method = method;
        assert_eq!(
            settle(signed(setup.clone())).bits(),
            settle(setup.clone()).bits()
        );
    }
}

/// Checks that a rebooted relay, for example the leader, rejoins the chain with its next epoch.
///
/// The epoch is the relay's number of starts.
#[test]
fn a_rebooted_relay_rejoins_by_new_handshakes() {
    let events = [
        (3_000, ScheduledEvent::Reboot(4)),
        (4_000, ScheduledEvent::Restart),
        (8_000, ScheduledEvent::Reboot(1)),
    ];
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut net = Net::new(8, wiring, &events);
        net.run(Instant::from_millis(2_999));
        let places = net.bits();
        assert!(places.iter().all(Option::is_some));
        net.run(Instant::from_millis(3_999));
        assert_eq!(net.bits()[3], None, "the relay begins anew");
        // The rebooted leader has forgotten its view. New positions are used only after the others' old lease has
        // expired.
        for end in [7_999, 40_000] {
            net.run(Instant::from_millis(end));
            assert_eq!(net.bits(), places);
            assert!(
                net.relays
                    .iter()
                    .all(|relay| relay.phase() == Phase::Holding)
            );
        }
        let mut setup = Setup::new(mission(8));
        setup.settings.wiring = wiring;
        let simulated = settle(setup).bits();
        let without_target = |place: &Option<([u32; 3], u32)>| place.map(|(at, _)| at);
        assert_eq!(
            places.iter().map(without_target).collect::<Vec<_>>(),
            simulated
        );
    }
}

/// Checks that frames of a neighbour with another key, or without a key, are refused and counted.
#[test]
fn a_relay_with_another_key_is_ignored() {
    let stranger = Key::new([1; 32]);
    for auth in [
        None,
        Some(Auth {
            key: stranger,
            epoch: 1,
        }),
    ] {
        let settings = Settings {
            auth,
            ..Settings::default()
        };
        let mut net = Net::new(2, Wiring::Pair, &[]);
        *net.relay(2) = fixtures::relay(mission(2), 2, settings);
        net.run(Instant::from_millis(14_000));
        let (head, tail) = (net.stats(1), net.stats(2));
        assert_eq!((head.received, tail.received), (0, 0));
        assert_eq!(net.bits(), [None, None]);
        if auth.is_none() {
            assert!(head.unsigned > 0 && tail.version > 0, "{head:?} {tail:?}");
        } else {
            assert!(head.forged > 0 && tail.forged > 0, "{head:?} {tail:?}");
        }
    }
}
