//! Emulated drones with an autopilot at USART1. They fly to the agreed position while the pilot permits it.

use std::io::{ErrorKind, Read as _};

use host_tests::firmware::emulator::Life;
use host_tests::make;
use mavlink::dialects::common::MavLandedState;
use uav_relay::Placement;
use uav_relay::flight::autopilot::Kind;
use uav_relay::flight::axis::Axis;
use uav_relay_scenario::Scenario;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_tools::provision::block::Flight;

use crate::chain::{paper, simulated};
use crate::fleet::{Fleet, Image};
use crate::vehicle::{Vehicle, apart};

const SITES: &str = "[geometry]\naltitude_m = 20\n[power]\ntx_w = 80\nuav_w = 1\n\
    [[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n\
    [site]\ntx = { lat_deg = 47.40, lon_deg = 8.54, amsl_m = 420.0 }\n\
    rx = { lat_deg = 47.41, lon_deg = 8.55, amsl_m = 431.0 }\n";

pub(crate) fn scenario() -> Scenario {
    Scenario::parse("sites.toml", SITES).unwrap()
}

pub(crate) fn axis() -> Axis {
    scenario().line.unwrap().axis
}

fn flight() -> Flight {
    Flight::new(&scenario(), 1, 1e-4, 7).unwrap()
}

fn agreed() -> Placement {
    let [x_m, y_m, altitude_m] = simulated(&flight())[0].map(f32::from_bits);
    make::placement(x_m, y_m, altitude_m)
}

fn wait_for_line(fleet: &mut Fleet, text: &str) {
    fleet.wait(text, |lines| lines.iter().any(|line| line.text == text));
}

/// Checks that a drone flies to its position under setpoint control. When the pilot takes control, the relay must no longer move the drone.
fn flies_to_its_place(image: Image, kind: Kind) {
    let to = agreed();
    // A PX4's mode choice expires after 0.8 s of silence, and at ten times the speed this process may be delayed for as long.
    let (mut fleet, life) = match kind {
        Kind::Px4 => (Fleet::in_real_time(&flight()), Life::Real),
        Kind::ArduCopter => (
            Fleet::of(image, &flight(), Faults::default(), 1),
            Life::Fast,
        ),
    };
    fleet.wait("line to fly along", |lines| {
        lines
            .iter()
            .any(|line| line.text.starts_with("autopilot: 1343.79"))
    });
    let from = make::placement(to.x_m - 80.0, 0.4, 19.7);
    let socket = fleet.autopilots.remove(0);
    let mut vehicle = Vehicle::new(kind, socket, axis(), from, life);

    // On the ground the autopilot is found and its messages are requested; a PX4 does not report its target (87).
    let asked: &[u32] = match kind {
        Kind::Px4 => &[33, 245],
        Kind::ArduCopter => &[33, 87, 245],
    };
    vehicle.until("requests for messages", |vehicle| {
        vehicle.heartbeats > 1 && asked.iter().all(|id| vehicle.asked.contains(id))
    });
    let name = match kind {
        Kind::Px4 => "autopilot: found: PX4",
        Kind::ArduCopter => "autopilot: found: ArduCopter",
    };
    wait_for_line(&mut fleet, name);
    vehicle.run(2_000);
    vehicle.armed = true;
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_TAKEOFF;
    vehicle.run(3_000);
    assert_eq!(vehicle.told, [], "on the ground, and in its take-off");

    // In the air under the pilot's control a PX4 receives its own position, an ArduCopter no target.
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    vehicle.until("readiness", |vehicle| {
        let ready = |text: &String| text == "relay: ready, choose OFFBOARD or GUIDED";
        vehicle.texts.iter().any(ready)
    });
    vehicle.run(1_000);
    wait_for_line(
        &mut fleet,
        "autopilot: in the air, and not controlled by the relay",
    );
    assert_eq!(vehicle.told.is_empty(), kind == Kind::ArduCopter);
    for told in &vehicle.told {
        assert!(apart(told.place, from) < 0.1, "{told:?}");
    }

    // The pilot gives control to the relay.
    vehicle.granted = true;
    vehicle.until("flight to the agreed place", |vehicle| {
        let ends = vehicle
            .told
            .last()
            .is_some_and(|told| apart(told.place, to) < 0.05);
        ends && apart(vehicle.place, to) < 1.0
    });
    vehicle.run(2_000);
    assert!(apart(vehicle.place, to) < 1.0, "{:?}", vehicle.place);
    wait_for_line(&mut fleet, "autopilot: setpoint control engaged");
    for pair in vehicle.told.windows(2) {
        // At 5 m/s no step is longer than half a second.
        let step = apart(pair[0].place, pair[1].place);
        assert!(step <= 2.6, "{pair:?}");
    }
    let flies = |text: &String| text == "relay: engaged, flies to position";
    assert!(vehicle.texts.iter().any(flies), "{:?}", vehicle.texts);

    // The pilot takes control again.
    vehicle.granted = false;
    vehicle.until("release", |vehicle| {
        vehicle
            .texts
            .iter()
            .any(|text| text.starts_with("relay: released"))
    });
    vehicle.place.x_m -= 30.0;
    vehicle.run(1_000);
    let taken = vehicle.now();
    vehicle.run(3_000);
    match kind {
        Kind::ArduCopter => assert!(!vehicle.has_target_since(taken)),
        Kind::Px4 => {
            let all = vehicle.told.iter().filter(|told| told.at > taken);
            for told in all {
                assert!(apart(told.place, vehicle.place) < 0.1, "{told:?}");
            }
        }
    }
    assert!(apart(vehicle.place, to) > 29.0, "nobody moves it");
}

#[test]
fn a_px4_flies_to_the_agreed_place() {
    flies_to_its_place(Image::Wires, Kind::Px4);
}

#[test]
fn an_arducopter_flies_to_the_agreed_place() {
    flies_to_its_place(Image::Radio, Kind::ArduCopter);
}

/// Checks that a drone that is not configured with the positions of Tx and Rx sends no targets.
#[test]
fn a_drone_without_sites_sends_no_targets() {
    let mut fleet = Fleet::of(Image::Wires, &paper(1), Faults::default(), 1);
    wait_for_line(
        &mut fleet,
        "no sites (positions of Tx and Rx on earth): no autopilot is controlled, and drones are not kept apart while they move",
    );
    fleet.places();
    let mut port = &fleet.autopilots[0];
    port.set_nonblocking(true).unwrap();
    let error = port.read(&mut [0]).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::WouldBlock);
}

#[test]
fn the_smallest_image_refuses_sites() {
    let mut fleet = Fleet::of(Image::Smallest, &flight(), Faults::default(), 1);
    wait_for_line(
        &mut fleet,
        "configuration refused: it has sites (positions of Tx and Rx), but this image was built without the cargo feature flight",
    );
}
