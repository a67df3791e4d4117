//! Chains on a simulated radio channel.

use host_tests::fixtures::mission;
use uav_relay::Side;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::OneWayFailure;
use uav_relay_sim::simulator::outcome::{Ending, TimelineEvent};
use uav_relay_sim::simulator::setup::Setup;

use super::*;

#[test]
fn a_chain_agrees_on_the_same_positions_on_any_channel() {
    let ideal = run(Setup::on_shared_channel(mission(8))).unwrap();
    assert_eq!(ideal.air, AirCounts::default());
    for access in [Access::Aloha, Access::Csma] {
        for seed in 0..20 {
            let mut setup = Setup::on_air(mission(8), access);
            setup.seed = seed;
            let outcome = run(setup.clone()).unwrap();
            assert_eq!(outcome.ending, Ending::Settled, "{access:?}, seed {seed}");
            assert_eq!(outcome.bits(), ideal.bits(), "{access:?}, seed {seed}");
            // Some frames are still queued at the end.
            let waiting = outcome.messages - outcome.air.sent;
            assert!(waiting <= 8, "{access:?}, seed {seed}: {waiting}");
            let again = run(setup).unwrap();
            assert_eq!((again.ended, again.air), (outcome.ended, outcome.air));
        }
    }
}

#[test]
fn a_deaf_relay_receives_nothing_until_the_failure_ends() {
    for access in [Access::Ideal, Access::Aloha, Access::Csma] {
        let mut setup = Setup::on_air(mission(2), access);
        setup.deaf = vec![OneWayFailure {
            by: 2,
            of: 1,
            from: at(0),
            until: None,
        }];
        let outcome = run(setup.clone().soaked(seconds(60))).unwrap();
        let received = [0, 1].map(|at| outcome.relays[at].stats.received);
        assert!(
            received[0] > 0 && received[1] == 0,
            "{access:?}: {received:?}"
        );
        assert_eq!(outcome.relays[1].setpoint, None, "{access:?}");
        setup.deaf[0].until = Some(seconds(30));
        let outcome = run(setup.soaked(seconds(120))).unwrap();
        assert!(outcome.relays[1].setpoint.is_some(), "{access:?}");
        let told: Vec<_> = outcome
            .moments
            .iter()
            .filter(|moment| matches!(moment.what, TimelineEvent::Deaf | TimelineEvent::Hears))
            .map(|moment| (moment.at, moment.relay, moment.other))
            .collect();
        assert_eq!(told, [(at(0), 2, Some(1)), (seconds(30), 2, Some(1))]);
    }
}

#[test]
fn a_wire_can_fail_in_one_direction() {
    let mut setup = Setup::new(mission(3));
    setup.deaf = vec![OneWayFailure {
        by: 3,
        of: 2,
        from: seconds(20),
        until: None,
    }];
    let outcome = run(setup.soaked(seconds(120))).unwrap();
    assert!(outcome.noticed.contains_key(&(3, Side::Upstream)));
    assert!(!outcome.noticed.contains_key(&(2, Side::Upstream)));
}

#[test]
fn the_setup_determines_the_channel_parameters() {
    let mut setup = Setup::on_air(mission(20), Access::Csma);
    setup.link.baud = 4_800;
    let channel = setup.channel();
    assert_eq!(
        (channel.baud, channel.in_range, channel.overhead),
        (4_800, 9, 12)
    );
    let channel = Setup::on_shared_channel(mission(3)).channel();
    assert_eq!(
        (channel.baud, channel.in_range, channel.overhead),
        (115_200, 3, 0)
    );
    assert_eq!(Setup::new(mission(3)).channel().in_range, 1);
}
