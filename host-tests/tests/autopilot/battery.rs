//! Battery messages of PX4 and ArduCopter, and the departure that a relay requests by them.

use mavlink::dialects::common::{
    BATTERY_STATUS_DATA, HOME_POSITION_DATA, MavMessage, SYS_STATUS_DATA,
};
use uav_relay::{Departure, Event, Geodetic, Placement, Settings, Wiring};

use super::*;
use crate::exchange::relay;
use crate::vehicle::{SYSTEM, axis};

impl Vehicle {
    /// Sends BATTERY_STATUS of battery `id` with the field `time_remaining`, an extension.
    fn battery(&mut self, id: u8, percent: i8, time_s: i32) {
        let data = BATTERY_STATUS_DATA {
            id,
            battery_remaining: percent,
            ..BATTERY_STATUS_DATA::DEFAULT
        };
        let mut payload = [0; 41];
        let message = MavMessage::BATTERY_STATUS(data);
        let mut raw = mavlink::MAVLinkV2MessageRaw::new();
        raw.serialize_message(mavlink::MavHeader::default(), &message);
        payload[..raw.payload().len()].copy_from_slice(raw.payload());
        payload[36..40].copy_from_slice(&time_s.to_le_bytes());
        let mut frame = vec![0xFD, 40, 0, 0, 0, SYSTEM, 1, 147, 0, 0];
        frame.extend(&payload[..40]);
        let checksum = mavlink::calculate_crc(&frame[1..], 154);
        frame.extend(checksum.to_le_bytes());
        self.link.handle_bytes(self.now, &frame);
    }

    fn sys_status(&mut self, percent: i8) {
        let data = SYS_STATUS_DATA {
            battery_remaining: percent,
            ..SYS_STATUS_DATA::DEFAULT
        };
        self.send_from([SYSTEM, 1], &MavMessage::SYS_STATUS(data));
    }

    fn home(&mut self, at: Geodetic) {
        let data = HOME_POSITION_DATA {
            latitude: at.lat_e7,
            longitude: at.lon_e7,
            altitude: at.amsl_mm,
            ..HOME_POSITION_DATA::DEFAULT
        };
        self.send_from([SYSTEM, 1], &MavMessage::HOME_POSITION(data));
    }
}

/// Returns the reported remaining time, its error, and the time of the way home, s.
fn endurance(vehicle: &mut Vehicle) -> Option<[f32; 3]> {
    let newest = vehicle.link.poll_endurance();
    assert_eq!(vehicle.link.poll_endurance(), None, "once");
    newest
}

#[test]
fn the_time_that_a_px4_reports_counts() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    vehicle.battery(0, 61, 700);
    let [remaining_s, error_s, home_s] = endurance(&mut vehicle).unwrap();
    assert_eq!((remaining_s, error_s), (700.0, 70.0));
    assert_eq!(home_s, 0.0, "home is where the first position was");
    // Home is 200 m and 10 m of altitude away, at 5 m/s.
    let home = Placement::on_line(300.0, 10.0);
    vehicle.home(axis().point(home).unwrap());
    vehicle.battery(0, 61, 690);
    let [.., home_s] = endurance(&mut vehicle).unwrap();
    assert!((home_s - 42.0).abs() < 0.1, "{home_s}");
    // SYS_STATUS and other batteries say less than the first one's BATTERY_STATUS.
    vehicle.sys_status(40);
    vehicle.battery(1, 90, 5_000);
    assert_eq!(endurance(&mut vehicle), None);
    vehicle.home(Geodetic::from_degrees(10.0, 8.0, 0.0).unwrap());
    vehicle.battery(0, 61, 680);
    let [.., home_s] = endurance(&mut vehicle).unwrap();
    assert!(home_s.is_nan(), "far from the line");
}

#[test]
fn an_invalid_percentage_without_a_time_is_unknown() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for percent in [-1, -128, 101, 127] {
            for time_s in [0, -1, i32::MIN] {
                let mut vehicle = Vehicle::flying(kind);
                vehicle.battery(0, percent, time_s);
                let [remaining_s, ..] = endurance(&mut vehicle).unwrap();
                assert!(remaining_s.is_nan(), "{percent} % {time_s} s");
            }
            let mut vehicle = Vehicle::flying(kind);
            vehicle.sys_status(percent);
            assert!(endurance(&mut vehicle).unwrap()[0].is_nan());
        }
    }
}

/// Flies for `span_s` with the percentage `percent(time)`; returns the endurance after each second.
fn discharge(
    vehicle: &mut Vehicle,
    span_s: u16,
    send: impl Fn(&mut Vehicle, i8),
    percent: impl Fn(f32) -> f32,
) -> Vec<Option<[f32; 3]>> {
    let second = |s: u16| {
        vehicle.run(1_000);
        send(vehicle, percent(f32::from(s)) as i8);
        endurance(vehicle)
    };
    (0..span_s).map(second).collect()
}

/// Checks the endurance by the slope of a percentage that falls by one in 13 s.
///
/// ArduCopter reports it in BATTERY_STATUS, with the time 0, and PX4 in SYS_STATUS.
#[test]
fn the_slope_of_the_percentage_gives_the_endurance() {
    for kind in [Kind::ArduCopter, Kind::Px4] {
        let send = |vehicle: &mut Vehicle, percent: i8| match kind {
            Kind::ArduCopter => vehicle.battery(0, percent, 0),
            Kind::Px4 => vehicle.sys_status(percent),
        };
        let mut vehicle = Vehicle::flying(kind);
        let all = discharge(&mut vehicle, 600, send, |s| 90.9 - s / 13.0);
        let first = all.iter().position(Option::is_some).unwrap();
        assert!((60..95).contains(&first), "{first} s");
        for (s, told) in all.iter().enumerate().skip(first) {
            let [remaining_s, error_s, _] = told.unwrap();
            // The percentage is cut off: 0 % at 90 * 13 s.
            let exact = 89.9 * 13.0 - s as f32;
            assert!(
                (remaining_s - exact).abs() < error_s,
                "{s}: {remaining_s} {exact} {error_s}"
            );
            assert!(
                (remaining_s / exact - 1.0).abs() < 0.1,
                "{s}: {remaining_s} {exact}"
            );
        }
        // Twice the consumption counts within 5 min.
        let all = discharge(&mut vehicle, 300, send, |s| (44.8 - s / 6.5).max(0.0));
        let [remaining_s, ..] = all.last().unwrap().unwrap();
        assert_eq!(remaining_s, 0.0, "empty after 291 s");
    }
}

#[test]
fn a_battery_that_tells_nothing_is_never_full() {
    let send: fn(&mut Vehicle, i8) = |vehicle, percent| vehicle.battery(0, percent, 0);
    // A percentage that does not change is unknown after 3 min, one on the ground is no estimate.
    let mut vehicle = Vehicle::flying(Kind::ArduCopter);
    let all = discharge(&mut vehicle, 240, send, |_| 100.0);
    assert!(all[..179].iter().all(Option::is_none));
    assert!(all[181..].iter().all(|told| told.unwrap()[0].is_nan()));
    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    let all = discharge(&mut vehicle, 240, send, |s| 90.0 - s / 10.0);
    assert!(all.iter().all(Option::is_none));
    // Once the slope is known, a percentage that is stuck does not stop the countdown; one that rises ends it.
    let mut vehicle = Vehicle::flying(Kind::ArduCopter);
    let all = discharge(&mut vehicle, 320, send, |s| (50.0 - s / 10.0).max(30.0));
    let [a, b] = [205, 305].map(|s: usize| all[s].unwrap()[0]);
    assert!((a - b - 100.0).abs() < 1.0, "{a} {b}");
    let all = discharge(&mut vehicle, 1, send, |_| 80.0);
    assert!(all[0].unwrap()[0].is_nan());
    // A single glitch to 0 % is not believed, a repeated one is.
    let mut vehicle = Vehicle::flying(Kind::ArduCopter);
    discharge(&mut vehicle, 200, send, |s| 60.0 - s / 10.0);
    let all = discharge(&mut vehicle, 4, send, |s| [0.0, 39.0, 0.0, 0.0][s as usize]);
    assert_eq!(all[0], None);
    assert!(all[1].unwrap()[0] > 300.0);
    assert_eq!(all[2], None);
    assert_eq!(all[3].unwrap()[0], 0.0);
}

#[test]
fn a_relay_with_a_low_battery_requests_to_leave() {
    let mut vehicle = Vehicle::flying(Kind::Px4);
    let settings = Settings {
        wiring: Wiring::Shared,
        ..Settings::default()
    };
    let mut relay = relay(settings);
    let mut events = Vec::new();
    let mut fly = |relay: &mut uav_relay::Relay, seconds: u16, time_s: fn(u16) -> i32| {
        (0..seconds).find(|s| {
            vehicle.run(1_000);
            if time_s(*s) != 0 {
                vehicle.battery(0, 50, time_s(*s));
            }
            vehicle.link.exchange(relay, vehicle.now);
            relay.handle_timeout(vehicle.now);
            events.extend(core::iter::from_fn(|| relay.poll_event()));
            assert!(relay.poll_timeout().is_none_or(|at| at > vehicle.now));
            relay.departure(vehicle.now) != Departure::Member
        })
    };
    // The way home takes no time: the limit is 180 s of reserve and 180 s of a replacement.
    assert_eq!(fly(&mut relay, 20, |_| 500), None);
    assert_eq!(relay.endurance_limit_s(), Some(360));
    assert_eq!(fly(&mut relay, 4, |_| 300), None, "too short");
    assert_eq!(fly(&mut relay, 20, |_| 500), None);
    // 0.9 * (500 - s) is 360 after 100 s.
    let left = fly(&mut relay, 200, |s| 500 - i32::from(s)).unwrap();
    assert!((104..=107).contains(&left), "{left} s");
    assert_eq!(relay.stats().endurance_unknown, 0);
    // An end of the messages is reported, and cancels nothing.
    fly(&mut relay, 1, |_| 0);
    for _ in 0..30 {
        assert_eq!(fly(&mut relay, 1, |_| 0), Some(0));
    }
    assert_eq!(relay.stats().endurance_unknown, 1);
    assert_eq!(relay.endurance_s(Instant::from_millis(1_200_000)), None);
    for _ in 0..5 {
        assert_eq!(fly(&mut relay, 1, |_| 600), Some(0));
    }
    assert_eq!(fly(&mut relay, 10, |_| 600), None, "cancelled");
    let lost = events
        .iter()
        .filter(|event| **event == Event::EnduranceUnknown);
    assert_eq!(lost.count(), 1);
}

/// Checks that an unknown endurance counts down, and that the firmware's own departure stays.
#[test]
fn the_last_endurance_counts_down_and_a_manual_departure_stays() {
    let settings = Settings {
        wiring: Wiring::Shared,
        ..Settings::default()
    };
    let mut silent = relay(settings);
    let at = |s: u64| Instant::from_millis(1_000 * s);
    silent.handle_endurance(at(1), 400.0, 20.0, 0.0);
    for s in 2..25 {
        silent.handle_timeout(at(s));
        assert_eq!(silent.departure(at(s)), Departure::Member);
    }
    assert_eq!(silent.endurance_s(at(24)), None);
    for s in 25..30 {
        silent.handle_timeout(at(s));
    }
    assert_ne!(silent.departure(at(30)), Departure::Member);

    let mut manual = relay(settings);
    manual.leave(at(1), Some(600));
    for s in 2..60 {
        manual.handle_endurance(at(s), if s < 20 { 100.0 } else { 900.0 }, 0.0, 0.0);
        assert_ne!(manual.departure(at(s)), Departure::Member);
    }
    manual.stay(at(60));
    assert_eq!(manual.departure(at(60)), Departure::Member);
    for value in [f32::NAN, -1.0, f32::INFINITY] {
        for which in 0..3 {
            let mut relay = relay(settings);
            relay.handle_endurance(at(1), 900.0, 0.0, 0.0);
            let mut values = [900.0, 0.0, 0.0];
            values[which] = value;
            relay.handle_endurance(at(2), values[0], values[1], values[2]);
            assert_eq!(relay.endurance_s(at(2)), None);
            assert_eq!(relay.stats().endurance_unknown, 1);
        }
    }
}

/// Checks the command to return: repeated until the mode changes, never after the pilot's choice.
///
/// It is sent only while the relay controls the drone.
#[test]
fn the_return_is_commanded_until_the_mode_changes() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let returns = |vehicle: &Vehicle| {
            let said = vehicle.received.iter();
            said.filter(|(_, said)| *said == LinkMessage::Return)
                .count()
        };
        let mut vehicle = Vehicle::flying(kind);
        vehicle.link.return_home(vehicle.now);
        vehicle.run(3_000);
        assert_eq!(returns(&vehicle), 0, "its pilot flies");
        vehicle.setpoint = Some(place(180.0));
        vehicle.engage();
        vehicle.run(1_000);
        assert_eq!(vehicle.link.state(), State::Engaged);
        vehicle.link.return_home(vehicle.now);
        vehicle.run(5_000);
        assert_eq!(returns(&vehicle), 3);
        vehicle.mode = Mode::Hold;
        vehicle.run(3_000);
        vehicle.engage();
        vehicle.run(5_000);
        assert_eq!(returns(&vehicle), 3, "the pilot's choice ends it");
    }
}
