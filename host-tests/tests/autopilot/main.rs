//! Link to a scripted autopilot that uses another MAVLink codec.

mod any;
mod arducopter;
mod battery;
mod clearance;
mod exchange;
mod flights;
mod motion;
mod px4;
mod radio;
mod real;
mod runner;
mod signed;
mod vehicle;

use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::autopilot::{AutopilotEvent, Kind};
use uav_relay::{Instant, Placement};
use vehicle::{LinkMessage, Mode, Vehicle, place};

#[test]
fn an_autopilot_is_found_and_its_messages_requested() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = Vehicle::new(kind);
        vehicle.run(2_000);
        assert_eq!(vehicle.events[0], AutopilotEvent::Found(kind));
        assert_eq!(vehicle.link.state(), State::Grounded);
        // A PX4 is not asked for messages that it does not send.
        let is_px4 = kind == Kind::Px4;
        for (id, times) in [
            (33, 1),
            (245, 1),
            (87, usize::from(!is_px4)),
            (162, usize::from(!is_px4)),
        ] {
            let asked = vehicle.received.iter().filter(
                |(_, said)| matches!(said, LinkMessage::Interval { id: of, .. } if *of == id),
            );
            assert_eq!(asked.count(), times, "{id}");
        }
        assert!(
            vehicle
                .received
                .iter()
                .any(|(_, said)| matches!(said, LinkMessage::Heartbeat))
        );
        assert!(
            vehicle
                .systems
                .iter()
                .skip(1)
                .all(|system| *system == vehicle::SYSTEM),
            "as a part of the vehicle"
        );
    }
}

/// Checks that polling at the last representable times yields only a few frames, so that a loop ends.
#[test]
fn poll_transmit_ends_at_the_latest_instant_too() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for before_us in [0, 1, 1_000_000] {
            let mut vehicle = Vehicle::new(kind);
            vehicle.run(2_000);
            let now = Instant::from_micros(u64::MAX - before_us);
            vehicle.link.handle_timeout(now);
            let sent = core::iter::from_fn(|| vehicle.link.poll_transmit(now));
            assert!(
                sent.take(100).count() < 10,
                "{kind:?}, {before_us} us before it"
            );
        }
    }
}

#[test]
fn infrequent_messages_are_requested_again() {
    let mut vehicle = Vehicle::new(Kind::Px4);
    vehicle.run(6_000);
    let before = vehicle.intervals(33);
    vehicle.position_every_ms = 1_000;
    vehicle.run(12_000);
    let after = vehicle.intervals(33);
    assert!(
        (2..=3).contains(&(after - before)),
        "once in four seconds: {before}, {after}"
    );
    assert_eq!(vehicle.intervals(245), 1, "what comes is not asked for");
}

#[test]
fn heartbeats_of_other_systems_do_not_set_the_mode() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    vehicle.engage();
    vehicle.run(3_000);
    assert_eq!(vehicle.link.state(), State::Engaged);
    // Heartbeats of a gimbal of the same vehicle, a ground station, and another vehicle.
    for (system, component, kind, autopilot) in [
        (vehicle::SYSTEM, 154, 26, 8),
        (255, 190, 6, 8),
        (9, 1, 2, 12),
    ] {
        vehicle.heartbeat_of(system, component, kind, autopilot, 0);
    }
    assert_eq!(vehicle.link.state(), State::Engaged);
}

#[test]
fn a_plane_is_not_taken_for_a_copter() {
    // Mode 4 of an ArduPlane is ACRO.
    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    vehicle.mute = true;
    for _ in 0..5 {
        vehicle.heartbeat_of(vehicle::SYSTEM, 1, 1, 3, 4);
        vehicle.run(1_000);
    }
    assert_eq!(vehicle.link.state(), State::Silent);
    assert!(vehicle.targets().is_empty());
}

#[test]
fn the_age_of_a_position_is_that_of_the_autopilots_clock() {
    let mut vehicle = Vehicle::new(Kind::Px4);
    vehicle.run(3_000);
    vehicle.late_ms = 130;
    vehicle.positions.clear();
    vehicle.run(2_000);
    assert!(vehicle.positions.len() >= 9);
    for (came, position) in &vehicle.positions {
        let age = came.since(position.at).as_micros() / 1_000;
        assert!((120..=140).contains(&age), "{age} ms");
        let off = position.place.x_m - vehicle.place.x_m;
        assert!(off.abs() < 0.02, "{off} m");
    }
}

#[test]
fn without_a_position_the_last_target_is_kept() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = Vehicle::engaged(kind, 500.0);
        vehicle.run(4_000);
        vehicle.position_every_ms = u64::MAX;
        vehicle.run(2_000);
        assert_eq!(vehicle.link.state(), State::Blind);
        assert!(!vehicle.link.is_flown());
        let frozen = vehicle.targets();
        let last = frozen.last().unwrap().1;
        vehicle.run(3_000);
        for (_, target) in vehicle.targets().iter().skip(frozen.len()) {
            assert_eq!((target.lat_e7, target.lon_e7), (last.lat_e7, last.lon_e7));
            assert!(!target.has_velocity());
        }
        assert!(vehicle.has_text("relay: no position, keeps last target"));
        vehicle.position_every_ms = 200;
        vehicle.run(800);
        assert_eq!(
            vehicle.link.state(),
            State::Blind,
            "one position is not enough"
        );
        vehicle.run(600);
        assert_eq!(vehicle.link.state(), State::Engaged);
    }
}

#[test]
fn a_restarted_autopilot_is_sent_its_requests_again() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = Vehicle::flying(kind);
        vehicle.engage();
        vehicle.run(3_000);
        let before = vehicle.intervals(33);
        vehicle.reboot();
        vehicle.run(1_500);
        assert!(
            vehicle.events.contains(&AutopilotEvent::Restarted),
            "{:?}",
            vehicle.events
        );
        assert!(vehicle.intervals(33) > before);
        assert!(!vehicle.link.is_flown());
        let told = vehicle.targets().len();
        vehicle.run(5_000);
        assert_eq!(vehicle.targets().len(), told, "nothing on the ground");
    }
}

#[test]
fn operator_values_are_sent_once_a_second() {
    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    vehicle.run(2_000);
    vehicle
        .link
        .handle_values(vehicle.now, Some(1.5), Some(place(300.0)));
    vehicle.run(10_000);
    for (name, expected) in [
        ("sir_db", 1.5),
        ("relay_x", 300.0),
        ("relay_y", 0.0),
        ("relay_h", 20.0),
    ] {
        let values: Vec<f32> = vehicle
            .received
            .iter()
            .filter_map(|(_, said)| match said {
                LinkMessage::Value { name: of, value } if of == name => Some(*value),
                _ => None,
            })
            .collect();
        assert!(
            (10..=11).contains(&values.len()),
            "{name}: {}",
            values.len()
        );
        assert!(values.iter().all(|value| *value == expected));
    }
    assert!(vehicle.link.send_text("a line of a relay"));
    vehicle.run(100);
    assert!(vehicle.has_text("a line of a relay"));
}

#[test]
fn a_withdrawn_setpoint_is_not_flown_again() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    vehicle.setpoint = Some(Placement::on_line(900.0, 20.0));
    vehicle.engage();
    vehicle.run(6_000);
    vehicle.setpoint = None;
    vehicle.run(12_000);
    let stopped = *vehicle.targets().last().unwrap();
    vehicle.run(5_000);
    let last = *vehicle.targets().last().unwrap();
    assert_eq!(
        (stopped.1.lat_e7, stopped.1.lon_e7),
        (last.1.lat_e7, last.1.lon_e7)
    );
    assert!(last.0 > stopped.0);
}

/// Checks that targets continue after a setpoint that is not finite or is too far away.
#[test]
fn a_drone_without_a_setpoint_holds_until_the_next_one() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = Vehicle::engaged(kind, 110.0);
        for wrong in [f32::NAN, f32::INFINITY, 1e9] {
            vehicle.setpoint = Some(place(wrong));
            vehicle.run(3_000);
            vehicle.setpoint = Some(place(120.0));
            vehicle.run(15_000);
            let at = vehicle.targets().last().unwrap().1.place();
            assert!((at.x_m - 120.0).abs() < 0.1, "{kind:?} {wrong}: {at:?}");
            vehicle.setpoint = Some(place(110.0));
            vehicle.run(15_000);
        }
    }
}

/// Checks that targets have no yaw if the bearing of the antenna is not a valid angle.
#[test]
fn a_bearing_of_none_is_left_out() {
    use uav_relay::pointing::Bearing;

    let mut vehicle = Vehicle::engaged(Kind::Px4, 110.0);
    for (azimuth_rad, leaves_out) in [(1.0, false), (f32::NAN, true), (1e9, true)] {
        let from = vehicle.now;
        vehicle.link.handle_bearing(Some(Bearing {
            azimuth_rad,
            elevation_rad: 0.0,
            distance_m: 1.0,
        }));
        vehicle.run(1_000);
        let targets = vehicle.targets_since(from);
        assert!(targets.len() > 3);
        let yaw = 1 << 10;
        let all = targets.iter().skip(1);
        assert!(
            all.map(|(_, target)| target.type_mask & yaw != 0)
                .all(|out| out == leaves_out)
        );
    }
}

/// Checks that a relay that is not ready sends its autopilot no targets.
///
/// A PX4 therefore refuses OFFBOARD.
#[test]
fn a_relay_that_is_not_ready_streams_nothing_in_standby() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    vehicle.setpoint = Some(place(120.0));
    let from = vehicle.now;
    vehicle.link.handle_ready(vehicle.now, false);
    vehicle.run(5_000);
    assert_eq!(vehicle.targets_since(from), []);
    vehicle.link.handle_ready(vehicle.now, true);
    // Targets start with the next heartbeat, within a second.
    vehicle.run(3_000);
    assert!(vehicle.targets_since(from).len() >= 8);
    vehicle.engage();
    assert_eq!(vehicle.link.state(), State::Engaged);
    let from = vehicle.now;
    vehicle.link.handle_ready(vehicle.now, false);
    vehicle.run(5_000);
    assert_eq!(vehicle.link.state(), State::Engaged);
    assert!(vehicle.targets_since(from).len() > 20, "it stays engaged");
}

/// Checks that a new membership view or mission is reported to the operator only once.
///
/// Only a relay whose drone is in flight reports it.
#[test]
fn a_view_and_a_mission_are_reported_to_the_operator_once() {
    use uav_relay::Event;
    use uav_relay::HoldReason::Unheard;

    let texts_since = |vehicle: &Vehicle, from: Instant| -> Vec<String> {
        let texts = vehicle.received.iter().filter_map(|(at, said)| match said {
            LinkMessage::Text(text) if *at >= from => Some(text.clone()),
            _ => None,
        });
        texts.collect()
    };
    let view = |vehicle: &mut Vehicle, hold| -> Vec<String> {
        let from = vehicle.now;
        vehicle.link.handle_event(Event::ViewAccepted);
        vehicle.run(500);
        vehicle.link.handle_event(Event::Converged);
        for _ in 0..600 {
            vehicle.link.handle_hold(vehicle.now, [None, hold]);
            vehicle.run(20);
        }
        texts_since(vehicle, from)
    };
    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    vehicle.run(2_000);
    assert_eq!(view(&mut vehicle, None), [""; 0], "on the ground");
    vehicle.fly_off();
    vehicle.run(2_000);
    vehicle.engage();
    vehicle.run(12_000);
    assert_eq!(view(&mut vehicle, None), ["relay: flies to new position"]);
    let waits = "relay: waits, no position from the next drone";
    assert_eq!(
        view(&mut vehicle, Some(Unheard)),
        ["relay: flies to new position", waits]
    );
    assert_eq!(
        view(&mut vehicle, Some(Unheard)),
        [""; 0],
        "it was told why it waits"
    );
    // Position updates within a view cause no text.
    let from = vehicle.now;
    for _ in 0..20 {
        vehicle.link.handle_event(Event::Converged);
        vehicle.link.handle_hold(vehicle.now, [None, Some(Unheard)]);
        vehicle.run(1_000);
    }
    assert_eq!(texts_since(&vehicle, from), [""; 0]);
    let from = vehicle.now;
    vehicle.link.handle_event(Event::Adopted);
    vehicle.run(500);
    assert_eq!(texts_since(&vehicle, from), ["relay: new mission adopted"]);
}

/// Checks that the reason for a drone's waiting is not reported to the operator if it lasts only 1.8 s.
///
/// Such reasons come and go while an agreement spreads along the chain. A lasting reason is reported.
#[test]
fn a_short_hold_reason_is_not_reported() {
    use uav_relay::HoldReason::Close;

    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    vehicle.run(2_000);
    vehicle.fly_off();
    for i in 0..1_000 {
        let reason = (i % 100 < 90).then_some(Close);
        vehicle.link.handle_hold(vehicle.now, [reason, None]);
        vehicle.run(20);
    }
    assert!(!vehicle.has_text("relay: waits, too close to the previous drone"));
    for _ in 0..200 {
        vehicle.link.handle_hold(vehicle.now, [Some(Close), None]);
        vehicle.run(20);
    }
    assert!(vehicle.has_text("relay: waits, too close to the previous drone"));
}

/// Checks that a lasting reason is reported if the caller's clock steps back by 500 s while it lasts.
#[test]
fn a_hold_reason_is_reported_after_the_clock_steps_back() {
    use uav_relay::HoldReason::Close;

    let mut vehicle = Vehicle::flying(Kind::ArduCopter);
    vehicle.link.handle_hold(vehicle.now, [Some(Close), None]);
    for time in [&mut vehicle.now, &mut vehicle.began] {
        *time = Instant::from_micros(time.as_micros() - 500_000_000);
    }
    for _ in 0..200 {
        vehicle.link.handle_hold(vehicle.now, [Some(Close), None]);
        vehicle.run(20);
    }
    assert!(vehicle.has_text("relay: waits, too close to the previous drone"));
}

#[test]
fn the_operator_gets_the_guards_hold_reason() {
    use uav_relay::HoldReason::{Order, Unheard};

    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    let order = "relay: waits, wrong order with the next drone";
    vehicle.run(2_000);
    vehicle.link.handle_hold(vehicle.now, [None, Some(Order)]);
    vehicle.run(1_000);
    assert!(!vehicle.has_text(order), "on the ground nobody asks");
    vehicle.fly_off();
    for i in 0..3_000 {
        // The reasons last 4 s and 3.5 s in turn.
        let reason = if i % 375 < 200 { Order } else { Unheard };
        vehicle.link.handle_hold(vehicle.now, [None, Some(reason)]);
        vehicle.run(20);
    }
    let told = vehicle.received.iter().filter_map(|(at, said)| match said {
        LinkMessage::Text(text) if text == order => Some(*at),
        _ => None,
    });
    let told: Vec<Instant> = told.collect();
    assert!((5..=7).contains(&told.len()), "once in 10 s: {told:?}");
}
