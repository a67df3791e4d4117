//! PX4: it leaves its mode unless targets are streamed.

use mavlink::dialects::common::MavLandedState;

use super::vehicle::Mode;
use super::*;

/// Returns the longest gap between targets that were sent after `from`, ms.
fn longest_gap(vehicle: &Vehicle, from: Instant) -> u64 {
    let times: Vec<Instant> = vehicle
        .targets_since(from)
        .iter()
        .map(|(at, _)| *at)
        .collect();
    let gaps = times.windows(2).map(|pair| pair[1].since(pair[0]));
    gaps.map(|gap| gap.as_micros() / 1_000).max().unwrap()
}

#[test]
fn no_target_is_sent_on_the_ground_or_during_take_off() {
    let mut vehicle = Vehicle::new(Kind::Px4);
    vehicle.setpoint = Some(place(500.0));
    vehicle.mode = Mode::Companion;
    vehicle.run(3_000);
    vehicle.armed = true;
    vehicle.run(3_000);
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_TAKEOFF;
    vehicle.run(3_000);
    assert!(vehicle.targets().is_empty());
}

#[test]
fn in_standby_the_drones_own_position_is_streamed() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    vehicle.setpoint = Some(place(500.0));
    let from = vehicle.now;
    vehicle.run(3_000);
    let targets = vehicle.targets_since(from);
    assert!(targets.len() >= 14, "5 Hz: {}", targets.len());
    for (_, target) in &targets {
        assert!((target.place().x_m - 100.0).abs() < 0.05);
        assert!(!target.has_velocity());
        assert_eq!(target.type_mask, 0x0DF8);
    }
    assert_eq!(vehicle.link.state(), State::Standby);
}

#[test]
fn the_drone_is_led_to_its_position_and_held_there() {
    let mut vehicle = Vehicle::engaged(Kind::Px4, 180.0);
    let from = vehicle.now;
    assert_eq!(vehicle.link.state(), State::Engaged);
    vehicle.run(40_000);
    assert!(
        (vehicle.place.x_m - 180.0).abs() < 0.05,
        "{:?}",
        vehicle.place
    );
    assert!(
        longest_gap(&vehicle, from) <= 220,
        "it leaves its mode after a second"
    );
    let targets = vehicle.targets_since(from);
    let moving: Vec<_> = targets
        .iter()
        .filter(|(_, target)| target.has_velocity())
        .collect();
    assert!(moving.len() > 100, "10 Hz while it moves");
    for pair in targets.windows(2) {
        let step = pair[1].1.place().x_m - pair[0].1.place().x_m;
        assert!(
            (-0.02..=0.55).contains(&step),
            "{step} m in a tenth of a second"
        );
    }
    let last = targets.last().unwrap().1;
    assert_eq!(last.type_mask, 0x0DF8, "a position alone to end with");
    assert!((last.place().x_m - 180.0).abs() < 0.02);
    // The velocity is that of the target, which moves 80 m to the north-east.
    let (_, quick) = moving[moving.len() / 2];
    let [north, east, _] = quick.velocity_m_s;
    assert!(north > 1.0 && east > 1.0 && north.hypot(east) <= 5.01);
}

#[test]
fn the_pilots_takeover_is_final() {
    let mut vehicle = Vehicle::engaged(Kind::Px4, 500.0);
    vehicle.run(5_000);
    vehicle.mode = Mode::Position;
    vehicle.run(1_100);
    assert_eq!(vehicle.link.state(), State::Standby);
    assert!(vehicle.has_text("relay: released, manual mode"));
    let from = vehicle.now;
    vehicle.place = place(140.0);
    vehicle.run(10_000);
    let targets = vehicle.targets_since(from);
    let late = &targets[2..];
    assert!(
        late.iter()
            .all(|(_, target)| (target.place().x_m - 140.0).abs() < 0.05),
        "where it is"
    );
    assert_eq!(vehicle.link.state(), State::Standby);
}

#[test]
fn the_link_does_not_end_a_failsafe() {
    let mut vehicle = Vehicle::engaged(Kind::Px4, 500.0);
    vehicle.run(3_000);
    // The cable breaks until after the autopilot has started its return.
    vehicle.mute = true;
    vehicle.run(5_000);
    (vehicle.mode, vehicle.status) = (Mode::Hold, 5);
    vehicle.mute = false;
    let from = vehicle.now;
    vehicle.run(10_000);
    assert_eq!(vehicle.targets_since(from), [], "a stream would end it");
    // The pilot takes control with the sticks, and gives it back.
    (vehicle.mode, vehicle.status) = (Mode::Position, 4);
    vehicle.run(2_000);
    assert!(vehicle.targets_since(from).len() > 4);
    vehicle.engage();
    vehicle.run(1_000);
    assert_eq!(vehicle.link.state(), State::Engaged);
}

#[test]
fn a_short_landed_report_does_not_end_the_flight() {
    let mut vehicle = Vehicle::engaged(Kind::Px4, 500.0);
    let from = vehicle.now;
    vehicle.run(2_000);
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_LANDING;
    vehicle.run(600);
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    vehicle.run(2_000);
    assert!(longest_gap(&vehicle, from) <= 220);
    assert_eq!(vehicle.link.state(), State::Engaged);
}

#[test]
fn after_a_landing_no_targets_are_sent_in_any_mode() {
    let mut vehicle = Vehicle::engaged(Kind::Px4, 500.0);
    vehicle.run(2_000);
    vehicle.mode = Mode::Hold;
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_LANDING;
    vehicle.run(3_000);
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
    vehicle.armed = false;
    vehicle.mode = Mode::Companion;
    vehicle.run(2_000);
    let from = vehicle.now;
    vehicle.run(5_000);
    vehicle.armed = true;
    vehicle.run(5_000);
    assert_eq!(
        vehicle.targets_since(from),
        [],
        "arming alone would take it up"
    );
}
