//! Relays that leave the line because their part of the chain has no quorum.

use rand::SeedableRng;
use uav_relay::WithoutQuorum;
use uav_relay_sim::simulator::chain::run;

use super::*;

const LEAVES: WithoutQuorum = WithoutQuorum::Leave {
    y_m: -30.0,
    up_m: 25.0,
};

/// Returns the relays' lateral offsets and altitudes, m, during a cut of the chain and long after it.
///
/// The cut is downstream of relay 3. Relays without a quorum leave the line, sideways and upward. If `room` is true,
/// the motion guard permits the positions to which they leave.
fn across(room: bool) -> [Vec<[f32; 2]>; 2] {
    [seconds(110), seconds(300)].map(|end| {
        let mut setup = eight(&mut ChaCha8Rng::seed_from_u64(1));
        setup.settings.without_quorum = LEAVES;
        if room {
            let guard = setup.settings.guard;
            setup.settings.guard = guard.map(|guard| guard.with_room_for(LEAVES));
        }
        setup.partitions.push(Partition {
            after: 3,
            from: seconds(60),
            until: Some(seconds(120)),
        });
        end_at(&mut setup, end);
        let outcome = run(setup).unwrap();
        assert!(outcome.nearest_m() >= floor_m(1), "{:?}", outcome.nearest);
        assert_eq!(outcome.unsafe_setpoints, 0);
        let places = outcome.relays.iter().map(|relay| relay.setpoint.unwrap());
        places.map(|place| [place.y_m, place.altitude_m]).collect()
    })
}

#[test]
fn relays_outside_the_chain_step_aside_if_room_was_requested() {
    let on_line = [[0.0, 20.0]; 8];
    let mut beside = on_line;
    beside[..3].fill([-30.0, 45.0]);
    assert_eq!(across(true), [beside, on_line]);
    // Without room the drones stay within their box, which has altitudes but no lateral range.
    let [cut, back] = across(false);
    assert_eq!((cut[0][0], &back[..]), (0.0, &on_line[..]));
    assert_ne!(cut[..3], beside[..3]);
}
