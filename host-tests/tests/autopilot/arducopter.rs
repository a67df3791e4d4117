//! ArduCopter: a target holds until the next, and redundant ones make the drone wobble.

use super::vehicle::Mode;
use super::*;

#[test]
fn the_drone_is_led_to_its_position_and_released() {
    let mut vehicle = Vehicle::engaged(Kind::ArduCopter, 180.0);
    vehicle.run(30_000);
    assert!((vehicle.place.x_m - 180.0).abs() < 0.05);
    let last = vehicle.targets().last().unwrap().1;
    assert_eq!(last.type_mask, 0x0DF8);
    let from = vehicle.now;
    vehicle.run(30_000);
    assert_eq!(
        vehicle.targets_since(from),
        [],
        "it has said where it flies to"
    );
    assert!(!vehicle.events.contains(&AutopilotEvent::Refused));
}

#[test]
fn an_ignored_target_is_repeated_and_then_reported() {
    let mut vehicle = Vehicle::flying(Kind::ArduCopter);
    vehicle.takes_targets = false;
    vehicle.setpoint = Some(place(100.0));
    vehicle.engage();
    vehicle.place = place(90.0);
    let from = vehicle.now;
    vehicle.run(4_000);
    assert!(
        (3..=5).contains(&vehicle.targets_since(from).len()),
        "once a second"
    );
    assert!(!vehicle.events.contains(&AutopilotEvent::Refused));
    vehicle.run(4_000);
    assert!(vehicle.events.contains(&AutopilotEvent::Refused));
}

/// Checks that an autopilot that stops reporting its target is not reported as refusing targets.
#[test]
fn stopped_streams_do_not_count_as_a_refused_target() {
    let mut vehicle = Vehicle::flying(Kind::ArduCopter);
    vehicle.says_targets = false;
    vehicle.setpoint = Some(place(130.0));
    vehicle.engage();
    vehicle.run(60_000);
    assert!((vehicle.place.x_m - 130.0).abs() < 0.05);
    assert!(!vehicle.events.contains(&AutopilotEvent::Refused));
    let from = vehicle.now;
    vehicle.run(30_000);
    assert_eq!(vehicle.targets_since(from), [], "told often enough");
}

#[test]
fn an_ignored_moving_target_is_reported() {
    let mut vehicle = Vehicle::engaged(Kind::ArduCopter, 500.0);
    vehicle.run(10_000);
    assert!(!vehicle.events.contains(&AutopilotEvent::Refused));
    vehicle.takes_targets = false;
    vehicle.run(12_000);
    assert!(vehicle.events.contains(&AutopilotEvent::Refused));
    let last = vehicle.targets().last().unwrap().1;
    assert!(last.has_velocity(), "it still moves");
}

#[test]
fn the_target_is_sent_again_after_a_mode_change() {
    let mut vehicle = Vehicle::engaged(Kind::ArduCopter, 120.0);
    vehicle.run(20_000);
    vehicle.mode = Mode::Position;
    vehicle.run(3_000);
    vehicle.place = place(110.0);
    let from = vehicle.now;
    vehicle.engage();
    vehicle.run(20_000);
    assert!(
        !vehicle.targets_since(from).is_empty(),
        "it does not resume the one of before"
    );
    assert!((vehicle.place.x_m - 120.0).abs() < 0.05);
}

/// Checks that the last target of a flight has no velocity, whenever the autopilot confirms the target.
///
/// The time of the confirmation differs between the 100 flights.
#[test]
fn a_late_confirmation_of_the_last_target_counts() {
    for late in 0..100_u16 {
        let mut vehicle = Vehicle::flying(Kind::ArduCopter);
        vehicle.engage();
        vehicle.run(20 * u64::from(late % 25));
        vehicle.setpoint = Some(place(110.0 + f32::from(late) * 0.013));
        vehicle.run(20_000);
        let last = vehicle.targets().last().unwrap().1;
        assert!(!last.has_velocity(), "{late}: {last:?}");
    }
}
