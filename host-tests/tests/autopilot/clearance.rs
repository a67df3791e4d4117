//! An operator's command to clear a lost relay, through the autopilot of its neighbour.

use mavlink::dialects::common::{COMMAND_LONG_DATA, MavCmd, MavMessage};
use uav_relay::flight::autopilot::{AutopilotEvent, Kind};
use uav_relay::flight::mavlink::frame::Address;
use uav_relay::{Event, Side};

use crate::signed::{OTHER, OURS, keyed};
use crate::vehicle::{LinkMessage, SYSTEM, Vehicle};

/// MAVLink system and component number of QGroundControl.
const STATION: [u8; 2] = [255, 190];

const FROM: Address = Address {
    system: 255,
    component: 190,
};

fn command(to: [u8; 2], relays: [f32; 2], confirmation: u8) -> MavMessage {
    MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        param1: relays[0],
        param2: relays[1],
        command: MavCmd::MAV_CMD_USER_1,
        target_system: to[0],
        target_component: to[1],
        confirmation,
        ..COMMAND_LONG_DATA::DEFAULT
    })
}

/// Returns the result and the recipient of each of the companion's answers to `MAV_CMD_USER_1`.
///
/// With this command an operator reports that the drones of lost relays have landed.
fn answers(vehicle: &Vehicle) -> Vec<(u32, [u8; 2])> {
    let said = vehicle.received.iter();
    said.filter_map(|(_, said)| match said {
        LinkMessage::Ack {
            command: 31_010,
            result,
            to,
        } => Some((*result, *to)),
        _ => None,
    })
    .collect()
}

#[test]
fn an_operator_clears_a_lost_relay_by_a_command() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = Vehicle::flying(kind);
        let side = Side::Downstream;
        vehicle
            .link
            .handle_event(Event::NeighbourLost { side, node: 3 });
        let own = [SYSTEM, 191];
        // Commands to the autopilot, another system or a broadcast address are not for this companion.
        for to in [[SYSTEM, 1], [SYSTEM + 1, 191], [0, 0], [SYSTEM, 0]] {
            vehicle.send_from(STATION, &command(to, [3.0, 0.0], 0));
        }
        vehicle.run(1_000);
        assert_eq!(answers(&vehicle), []);
        assert_eq!(vehicle.link.poll_cleared(), None);

        vehicle.send_from(STATION, &command(own, [4.0, 0.0], 0));
        vehicle.run(1_000);
        assert_eq!(answers(&vehicle), [(2, STATION)], "denied");
        assert_eq!(vehicle.link.poll_cleared(), None);
        let relays = [4, 0, 0, 0, 0, 0, 0];
        let refused = AutopilotEvent::ClearRefused { relays, from: FROM };
        assert!(vehicle.events.contains(&refused), "{:?}", vehicle.events);

        vehicle.send_from(STATION, &command(own, [3.0, 0.0], 0));
        vehicle.run(1_000);
        assert_eq!(answers(&vehicle)[1..], [(0, STATION)], "accepted");
        assert_eq!(vehicle.link.poll_cleared(), Some(side));
        assert_eq!(vehicle.link.poll_cleared(), None, "once");
        let relays = [3, 0, 0, 0, 0, 0, 0];
        let cleared = AutopilotEvent::LostCleared {
            side,
            relays,
            from: FROM,
        };
        assert!(vehicle.events.contains(&cleared), "{:?}", vehicle.events);

        // The operator's station repeats the command because the answer was lost.
        vehicle.events.clear();
        vehicle.send_from(STATION, &command(own, [3.0, 0.0], 1));
        vehicle.run(1_000);
        assert_eq!(answers(&vehicle)[2..], [(0, STATION)], "accepted again");
        assert_eq!(vehicle.link.poll_cleared(), None);
        assert_eq!(vehicle.events, []);
        for line in [
            "relay: denied: name all lost relays toward Tx/Rx",
            "relay: lost drones reported as gone",
        ] {
            let text = LinkMessage::Text(line.to_owned());
            let has_said = vehicle.received.iter().any(|(_, said)| *said == text);
            assert!(has_said, "{line}");
        }
    }
}

/// Checks that the second of two simultaneous operator commands is ignored until it is repeated.
///
/// A cable or a router can deliver two commands together.
#[test]
fn simultaneous_commands_are_obeyed_in_sequence() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    for (side, node) in [(Side::Upstream, 1), (Side::Downstream, 3)] {
        vehicle
            .link
            .handle_event(Event::NeighbourLost { side, node });
    }
    let own = [SYSTEM, 191];
    let cleared = |vehicle: &Vehicle| {
        let events = vehicle.events.iter();
        let sides = events.filter_map(|event| match event {
            AutopilotEvent::LostCleared { side, .. } => Some(*side),
            _ => None,
        });
        sides.collect::<Vec<_>>()
    };
    vehicle.send_from(STATION, &command(own, [1.0, 0.0], 0));
    vehicle.send_from(STATION, &command(own, [3.0, 0.0], 0));
    vehicle.run(1_000);
    assert_eq!(answers(&vehicle), [(0, STATION)]);
    assert_eq!(vehicle.link.poll_cleared(), Some(Side::Upstream));
    assert_eq!(cleared(&vehicle), [Side::Upstream]);
    vehicle.send_from(STATION, &command(own, [3.0, 0.0], 1));
    vehicle.run(1_000);
    assert_eq!(answers(&vehicle)[1..], [(0, STATION)]);
    assert_eq!(vehicle.link.poll_cleared(), Some(Side::Downstream));
    assert_eq!(cleared(&vehicle)[1..], [Side::Downstream]);

    // A wrong command right behind one that was accepted does not hide it from the log.
    let side = Side::Downstream;
    vehicle
        .link
        .handle_event(Event::NeighbourLost { side, node: 3 });
    vehicle.send_from(STATION, &command(own, [3.0, 0.0], 0));
    vehicle.send_from(STATION, &command(own, [4.0, 0.0], 0));
    vehicle.run(1_000);
    assert_eq!(cleared(&vehicle)[2..], [side]);
    assert_eq!(vehicle.link.poll_cleared(), Some(side));
}

/// Checks that a link with a key obeys an operator's command only if it is signed, and only once.
///
/// The command reports that the drone of a lost relay is gone.
#[test]
fn with_a_key_only_a_signed_command_clears_a_relay() {
    let side = Side::Downstream;
    let mut vehicle = keyed(Kind::ArduCopter, Some(OURS), Some(OURS));
    vehicle.fly_off();
    vehicle
        .link
        .handle_event(Event::NeighbourLost { side, node: 3 });
    let right = command([SYSTEM, 191], [3.0, 0.0], 0);
    let key = vehicle.key.take();
    for wrong in [None, Some(OTHER)] {
        vehicle.key = wrong.map(crate::signed::Key::new);
        let before = vehicle.link.refused();
        vehicle.send_from(STATION, &right);
        assert_eq!(vehicle.link.refused(), before + 1, "{wrong:?}");
        assert_eq!(vehicle.link.poll_cleared(), None);
    }
    vehicle.key = key;
    vehicle.run(1_000);
    assert_eq!(answers(&vehicle), [], "nobody is answered");
    vehicle.send_from(STATION, &right);
    vehicle.run(1_000);
    assert_eq!(answers(&vehicle), [(0, STATION)]);
    assert_eq!(vehicle.link.poll_cleared(), Some(side));
    let relays = [3, 0, 0, 0, 0, 0, 0];
    let cleared = AutopilotEvent::LostCleared {
        side,
        relays,
        from: FROM,
    };
    assert!(vehicle.events.contains(&cleared), "{:?}", vehicle.events);
}
