//! Battery messages of PX4 and ArduCopter, and the departure that a relay requests by them.

use mavlink::dialects::common::{
    BATTERY_STATUS_DATA, HOME_POSITION_DATA, MavLandedState, MavMessage, SYS_STATUS_DATA,
};
use uav_relay::{Departure, Duration, Event, Geodetic, Placement, Relay, Settings, Wiring};

use super::*;
use crate::exchange::of;
use crate::vehicle::{SYSTEM, axis};

impl Vehicle {
    /// Sends BATTERY_STATUS of battery `id`, with the optional MAVLink field `time_remaining`.
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

/// Flight time of the drones in these tests to their home position, s.
///
/// The way is 200 m at 5 m/s and 10 m down at 1.5 m/s.
const HOME_S: u16 = 46;

/// Relay and its vehicle, which exchange data in every step of the simulation.
struct Pair {
    vehicle: Vehicle,
    relay: Relay,
    events: Vec<Event>,
}

impl Pair {
    /// Creates relay `index` of a chain of `relays`, and its drone.
    fn new(vehicle: Vehicle, relays: u16, index: u16) -> Self {
        let settings = Settings {
            wiring: Wiring::Shared,
            ..Settings::default()
        };
        let mut relay = of(relays, index, settings);
        relay.set_reserve(Some(Duration::from_millis(180_000)));
        Self {
            vehicle,
            relay,
            events: Vec::new(),
        }
    }

    /// Creates the only relay of a chain and its flying drone, which knows its home.
    fn flying(kind: Kind) -> Self {
        let mut pair = Self::new(Vehicle::flying(kind), 1, 1);
        pair.home();
        pair
    }

    fn home(&mut self) {
        let home = Placement::on_line(300.0, 10.0);
        self.vehicle.home(axis().point(home).unwrap());
    }

    fn exchange(&mut self) {
        self.vehicle
            .link
            .exchange(&mut self.relay, self.vehicle.now);
    }

    /// Returns the relay's endurance, and the limit below which the relay requests to leave, s.
    ///
    /// Endurance is the remaining flight time. A value is `None` if it is unknown.
    fn told(&mut self) -> [Option<u16>; 2] {
        self.exchange();
        let now = self.vehicle.now;
        [self.relay.endurance_s(now), self.relay.endurance_limit_s()]
    }

    /// Runs for up to `seconds`, and calls `send` before each second.
    ///
    /// Returns the first second after which `until` is true; `None` if `until` stays false.
    fn run(
        &mut self,
        seconds: u16,
        send: impl Fn(&mut Vehicle, i32),
        until: impl Fn(&Self) -> bool,
    ) -> Option<u16> {
        (0..seconds).find(|s| {
            send(&mut self.vehicle, i32::from(*s));
            for _ in 0..50 {
                self.vehicle.step_without_exchange();
                self.exchange();
                self.vehicle.answer();
            }
            self.relay.handle_timeout(self.vehicle.now);
            let mut frame = [0; uav_relay::wire::frame::MAX_FRAME];
            while self
                .relay
                .poll_transmit(self.vehicle.now, &mut frame)
                .is_some()
            {}
            while let Some(event) = self.relay.poll_event() {
                self.vehicle.link.handle_event(event);
                self.events.push(event);
            }
            assert!(
                self.relay
                    .poll_timeout()
                    .is_none_or(|at| at > self.vehicle.now)
            );
            until(self)
        })
    }

    fn departs(&self) -> bool {
        self.relay.departure(self.vehicle.now) != Departure::Member
    }

    /// Returns the times at which the pilot received the status text `text`, s.
    fn read(&self, text: &str) -> Vec<f64> {
        let said = self.vehicle.received.iter();
        let said = said.filter(|(_, said)| *said == LinkMessage::Text(text.to_owned()));
        said.map(|(at, _)| at.as_micros() as f64 / 1e6).collect()
    }

    fn unknowns(&self) -> usize {
        let unknown = |event: &&Event| **event == Event::EnduranceUnknown;
        self.events.iter().filter(unknown).count()
    }
}

/// Checks that a relay's endurance is nine tenths of the remaining time that a flying PX4 reports. Only BATTERY_STATUS of the first battery
/// counts.
#[test]
fn the_time_of_a_px4_counts_in_flight() {
    let mut pair = Pair::flying(Kind::Px4);
    pair.vehicle.battery(0, 61, 1_000);
    // Limit: 180 s of reserve, 180 s for a replacement, and the flight home.
    assert_eq!(pair.told(), [Some(900), Some(360 + HOME_S)]);
    // SYS_STATUS and other batteries say less than the first one's BATTERY_STATUS.
    pair.vehicle.sys_status(40);
    pair.vehicle.battery(1, 90, 5_000);
    assert_eq!(pair.told()[0], Some(900));
    pair.vehicle.link.set_endurance(f32::NAN, 2.0, 1.0);
    pair.vehicle.battery(0, 61, 1_000);
    let told = pair.told()[1];
    assert_eq!(told, Some(360 + 110), "200 m at 2 m/s, 10 m at 1 m/s");
}

/// Checks that a relay reserves twelve times `dead_after`, at most 4 min, for its replacement.
///
/// The reserved time is a part of the endurance (remaining flight time).
#[test]
fn the_time_of_a_replacement_is_capped() {
    for (dead_after_ms, replacement_s) in [(5_000, 60), (15_000, 180), (20_000, 240), (75_000, 240)]
    {
        let settings = Settings {
            wiring: Wiring::Shared,
            dead_after: Duration::from_millis(dead_after_ms),
            probe_after: Duration::from_millis(dead_after_ms / 3),
            ..Settings::default()
        };
        let mut relay = of(8, 3, settings);
        relay.handle_endurance(at(1), 2_000.0, 60.0);
        assert_eq!(relay.endurance_limit_s(), None, "without a reserve");
        relay.set_reserve(Some(Duration::from_millis(100_000)));
        assert_eq!(relay.endurance_limit_s(), Some(160 + replacement_s));
    }
}

/// Checks that the endurance is unknown if the home position is unknown or far from the line Tx-Rx.
#[test]
fn without_a_home_the_endurance_is_unknown() {
    let mut pair = Pair::new(Vehicle::flying(Kind::Px4), 1, 1);
    pair.vehicle.battery(0, 61, 1_000);
    assert_eq!(pair.told(), [None; 2]);
    pair.home();
    pair.vehicle.battery(0, 61, 1_000);
    assert_eq!(pair.told()[0], Some(900));
    let far = Geodetic::from_degrees(10.0, 8.0, 0.0).unwrap();
    pair.vehicle.home(far);
    pair.vehicle.battery(0, 61, 1_000);
    assert_eq!(pair.told()[0], None);
    // The unknown endurance before the home position was known does not count as a loss.
    assert_eq!(pair.relay.endurance_losses(), 1);
}

#[test]
fn an_invalid_percentage_is_unknown() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for percent in [-1, -128, 101, 127] {
            for time_s in [0, -1, i32::MIN, 600] {
                let mut pair = Pair::flying(kind);
                pair.vehicle.link.set_endurance(1_200.0, 5.0, 1.5);
                pair.vehicle.battery(0, percent, time_s);
                assert_eq!(pair.told(), [None; 2], "{percent} % {time_s} s");
                assert_eq!(pair.relay.endurance_losses(), 1);
            }
            let mut pair = Pair::flying(kind);
            pair.vehicle.link.set_endurance(1_200.0, 5.0, 1.5);
            pair.vehicle.sys_status(percent);
            assert_eq!(pair.told(), [None; 2]);
        }
    }
}

/// Checks that the endurance is a percentage of the configured flight time if no time is reported.
///
/// ArduCopter reports only the percentage.
#[test]
fn a_percentage_counts_by_the_time_of_a_full_battery() {
    let send: [fn(&mut Vehicle, i8); 2] = [
        |vehicle, percent| vehicle.battery(0, percent, 0),
        |vehicle, percent| vehicle.sys_status(percent),
    ];
    for send in send {
        let mut pair = Pair::flying(Kind::ArduCopter);
        send(&mut pair.vehicle, 60);
        assert_eq!(pair.told(), [None; 2], "never full");
        pair.vehicle.link.set_endurance(1_200.0, 5.0, 1.5);
        send(&mut pair.vehicle, 60);
        assert_eq!(pair.told()[0], Some(720));
        send(&mut pair.vehicle, 0);
        assert_eq!(pair.told()[0], Some(0));
    }
}

/// Checks that battery values on the ground do not count, because a PX4 reports an assumed time there.
#[test]
fn on_the_ground_no_endurance_counts() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut pair = Pair::new(Vehicle::new(kind), 1, 1);
        pair.home();
        pair.vehicle.link.set_endurance(1_200.0, 5.0, 1.5);
        let low = |vehicle: &mut Vehicle, _| vehicle.battery(0, 5, 40);
        assert_eq!(pair.run(60, low, Pair::departs), None);
        assert_eq!(pair.told(), [None; 2]);
        pair.vehicle.armed = true;
        assert_eq!(
            pair.run(60, low, Pair::departs),
            None,
            "armed, on the ground"
        );
        assert_eq!((pair.unknowns(), pair.relay.endurance_losses()), (0, 0));
        pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
        let high = |vehicle: &mut Vehicle, _| {
            vehicle.home(axis().point(Placement::on_line(300.0, 10.0)).unwrap());
            vehicle.battery(0, 80, 1_000);
        };
        pair.run(5, high, |_| false);
        let left_s = pair.relay.endurance_s(pair.vehicle.now).unwrap();
        assert!((895..=900).contains(&left_s), "{left_s}");
        pair.vehicle.armed = false;
        pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
        assert_eq!(pair.run(2_000, |_, _| {}, Pair::departs), None);
        assert_eq!(pair.told(), [None; 2], "the next battery is another one");
        assert_eq!(pair.unknowns(), 0);
    }
}

#[test]
fn a_relay_with_a_low_battery_requests_to_leave() {
    let mut pair = Pair::flying(Kind::Px4);
    let time = |time_s: i32| move |vehicle: &mut Vehicle, _: i32| vehicle.battery(0, 50, time_s);
    assert_eq!(pair.run(20, time(500), Pair::departs), None);
    assert_eq!(pair.run(14, time(300), Pair::departs), None, "too short");
    assert_eq!(pair.run(20, time(500), Pair::departs), None);
    // 0.9 * (500 - s) is 406.7 after 48 s.
    let falls = |vehicle: &mut Vehicle, s: i32| vehicle.battery(0, 50, 500 - s);
    let left = pair.run(200, falls, Pair::departs).unwrap();
    assert!((62..=65).contains(&left), "{left} s");
    assert_eq!(pair.unknowns(), 0);
    // If the messages stop, this is reported, and the request to leave stays.
    assert_eq!(pair.run(30, |_, _| {}, |pair| !pair.departs()), None);
    assert_eq!((pair.unknowns(), pair.relay.endurance_losses()), (1, 1));
    assert_eq!(pair.relay.endurance_s(pair.vehicle.now), None);
}

/// Checks that an endurance that was never known is reported as unknown at the start of control.
///
/// The report is repeated once a minute.
#[test]
fn an_endurance_that_was_never_known_is_told_at_the_start_of_control() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut pair = Pair::flying(kind);
        pair.run(30, |_, _| {}, |_| false);
        assert_eq!(pair.unknowns(), 0);
        pair.vehicle.mode = Mode::Companion;
        pair.run(60, |_, _| {}, |_| false);
        assert_eq!(pair.vehicle.link.state(), State::Engaged);
        assert_eq!((pair.unknowns(), pair.relay.endurance_losses()), (1, 1));
        assert_eq!(pair.read("battery: endurance unknown").len(), 1);
        assert_eq!(pair.told(), [None; 2]);
        pair.run(70, |_, _| {}, |_| false);
        assert_eq!((pair.unknowns(), pair.relay.endurance_losses()), (3, 1));
    }
}

/// Checks that a status text tells the pilot every 5 s to leave when only the reserve is left.
///
/// The chain has refused the relay's departure. The text stops when the pilot takes control.
#[test]
fn the_pilot_is_told_to_leave_at_the_last_reserve() {
    const LEAVE: &str = "battery: leave now";
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut pair = Pair::flying(kind);
        pair.vehicle.mode = Mode::Companion;
        let seconds = |vehicle: &Vehicle| (vehicle.now.as_micros() / 1_000_000) as i32;
        let end_s = seconds(&pair.vehicle) + 500;
        let falls = |vehicle: &mut Vehicle, _| vehicle.battery(0, 50, end_s - seconds(vehicle));
        pair.run(200, falls, Pair::departs).unwrap();
        let refused = pair.relay.departure(pair.vehicle.now);
        assert_eq!(refused, Departure::NeedsQuorum, "the only relay");
        // The reserve is 180 s beyond the way home; the text comes 15 s later.
        let first = pair.run(300, falls, |pair| !pair.read(LEAVE).is_empty());
        let left_s = pair.relay.endurance_s(pair.vehicle.now).unwrap();
        let home_s = pair.relay.endurance_limit_s().unwrap() - 360;
        assert!(left_s.abs_diff(home_s + 165) <= 2, "{first:?}: {left_s}");
        pair.run(60, falls, |_| false);
        let times = pair.read(LEAVE);
        assert!((12..=13).contains(&times.len()), "{times:?}");
        assert!(
            times
                .windows(2)
                .all(|pair| (5.0..6.1).contains(&(pair[1] - pair[0]))),
            "{times:?}"
        );
        // The text also comes if the position is unknown.
        pair.vehicle.position_every_ms = u64::MAX;
        pair.run(60, falls, |_| false);
        assert_eq!(pair.vehicle.link.state(), State::Blind);
        let blind = pair.read(LEAVE).len() - times.len();
        assert!((10..=13).contains(&blind), "{blind}");
        pair.vehicle.mode = Mode::Position;
        pair.run(2, falls, |_| false);
        let before = pair.read(LEAVE).len();
        pair.run(60, falls, |_| false);
        assert_eq!(pair.read(LEAVE).len(), before, "he has taken over");
    }
}

fn at(s: u64) -> Instant {
    Instant::from_millis(1_000 * s)
}

/// Returns relay `index` of `relays` on a shared channel.
fn shared(relays: u16, index: u16) -> Relay {
    Pair::new(Vehicle::new(Kind::Px4), relays, index).relay
}

/// Checks that the last endurance counts down without new values. An invalid value makes the endurance unknown.
#[test]
fn the_last_endurance_counts_down() {
    let mut silent = shared(1, 1);
    silent.handle_endurance(at(1), 381.0, 0.0);
    silent.handle_endurance(at(2), 380.0, 0.0);
    for s in 3..36 {
        silent.handle_timeout(at(s));
        assert_eq!(silent.departure(at(s)), Departure::Member);
    }
    assert_eq!(
        (silent.endurance_s(at(35)), silent.endurance_losses()),
        (None, 1)
    );
    for s in 36..40 {
        silent.handle_timeout(at(s));
    }
    assert_ne!(silent.departure(at(40)), Departure::Member);
    for value in [f32::NAN, -1.0, f32::INFINITY] {
        for which in 0..2 {
            let mut relay = shared(1, 1);
            relay.handle_endurance(at(1), 900.0, 0.0);
            let mut values = [900.0, 0.0];
            values[which] = value;
            relay.handle_endurance(at(2), values[0], values[1]);
            assert_eq!(
                (relay.endurance_s(at(2)), relay.endurance_losses()),
                (None, 1)
            );
        }
    }
}

/// Checks that without new messages the endurance counts down from the last confirmed value.
///
/// A value is confirmed if it agrees with the previous value. If there is only one value, the countdown starts from
/// that value.
#[test]
fn the_last_confirmed_endurance_counts_down() {
    // Seconds at which the relay requests to leave, and reaches its reserve.
    let silence = |mut relay: Relay, from: u64| {
        let mut first = [None; 2];
        for s in from..1_200 {
            relay.handle_timeout(at(s));
            let leaves = relay.departure(at(s)) != Departure::Member;
            for (first, is_true) in first.iter_mut().zip([leaves, relay.is_at_reserve()]) {
                *first = first.or(is_true.then_some(s));
            }
        }
        first
    };
    // 900 s at second 19, then once much less or more: 360 s are left at 559 s, 180 s at 739 s.
    for wrong_s in [100.0, 365.0, 1_500.0] {
        let mut relay = shared(1, 1);
        assert_eq!(fly(&mut relay, 1, 20, 900.0), Departure::Member);
        relay.handle_endurance(at(20), wrong_s, 0.0);
        assert_eq!(silence(relay, 21), [Some(575), Some(754)], "{wrong_s}");
    }
    // Only one value: 1200 s at second 1, 60 s of them for the way home.
    let mut relay = shared(1, 1);
    relay.handle_endurance(at(1), 1_200.0, 60.0);
    assert_eq!(silence(relay, 2), [Some(797), Some(976)]);
    // After a pause the older values do not count.
    let mut relay = shared(1, 1);
    assert_eq!(fly(&mut relay, 1, 20, 500.0), Departure::Member);
    relay.handle_endurance(at(60), 1_200.0, 0.0);
    assert_eq!(silence(relay, 61), [Some(916), Some(1_095)]);
}

/// Checks that a relay acts on a low or high endurance only after it has lasted 15 s.
///
/// Repeated operator orders do not delay the detection that only the reserve is left.
#[test]
fn each_decision_takes_its_time() {
    let mut relay = shared(1, 1);
    for s in 1..=16 {
        relay.handle_endurance(at(s), 300.0, 0.0);
    }
    assert_ne!(relay.departure(at(16)), Departure::Member);
    relay.handle_endurance(at(17), 1_200.0, 0.0);
    assert_ne!(relay.departure(at(17)), Departure::Member, "one high value");
    for stays in [true, false] {
        let mut relay = shared(1, 1);
        for s in 1..=17 {
            assert!(!relay.is_at_reserve() || s > 16);
            if stays {
                relay.stay(at(s));
            } else {
                relay.leave(at(s), None);
            }
            relay.handle_endurance(at(s), 100.0, 0.0);
        }
        assert!(relay.is_at_reserve(), "stay {stays}");
        assert_eq!(relay.must_leave(), !stays);
    }
}

/// Checks that an operator's order to stay holds until half of the spare endurance is used up.
///
/// Spare is the endurance beyond the way home.
#[test]
fn the_operators_order_to_stay_holds() {
    let mut relay = shared(1, 1);
    let fly = |relay: &mut Relay, from: u64, to: u64| {
        (from..to).find(|s| {
            relay.handle_timeout(at(*s));
            relay.handle_endurance(at(*s), 500.0 - *s as f32, 50.0);
            relay.departure(at(*s)) != Departure::Member
        })
    };
    // 500 - 410: the way home, the reserve and the replacement.
    assert_eq!(fly(&mut relay, 1, 300), Some(106));
    relay.stay(at(110));
    // Of 340 s beyond the way home less than 170 s are left from 281 s on.
    assert_eq!(relay.endurance_limit_s(), Some(50 + 170));
    assert_eq!(fly(&mut relay, 110, 400), Some(296));
    // With no endurance left, an order to stay holds until the firmware itself orders the relay to leave.
    relay.stay(at(500));
    assert_eq!(fly(&mut relay, 500, 900), None);
    assert!(relay.poll_timeout().is_none_or(|due| due > at(899)));
    relay.leave(at(900), None);
    assert_ne!(relay.departure(at(900)), Departure::Member);
    relay.stay(at(901));
    relay.handle_endurance(at(902), 900.0, 50.0);
    assert_eq!(fly(&mut relay, 903, 904), None);
}

/// Runs `relay` from second `from` to `to`, and returns the relay's departure state at the end.
///
/// The endurance is `left_s`, and the flight home takes no time.
fn fly(relay: &mut Relay, from: u64, to: u64, left_s: f32) -> Departure {
    for s in from..to {
        relay.handle_timeout(at(s));
        let mut frame = [0; uav_relay::wire::frame::MAX_FRAME];
        while relay.poll_transmit(at(s), &mut frame).is_some() {}
        relay.handle_endurance(at(s), left_s, 0.0);
    }
    relay.departure(at(to))
}

/// Checks that a spare relay or a just started relay stays outside of the chain with a low endurance.
///
/// The endurance must be low for 15 s. The relay returns to its former state after 15 s of high endurance.
#[test]
fn a_low_battery_keeps_a_spare_and_a_restarted_relay_outside() {
    for is_spare in [true, false] {
        let start = || {
            let mut relay = shared(3, 2);
            if is_spare {
                relay.wait_as_spare(at(1));
            }
            let before = relay.departure(at(1));
            assert_eq!(before == Departure::Spare, is_spare);
            (relay, before)
        };
        let (mut relay, before) = start();
        relay.handle_endurance(at(2), 100.0, 0.0);
        assert_eq!(relay.departure(at(2)), before, "one value");
        assert_eq!(fly(&mut relay, 3, 17, 250.0), before, "too short");
        assert_eq!(fly(&mut relay, 17, 18, 250.0), Departure::Outside);
        assert_eq!(fly(&mut relay, 18, 32, 900.0), Departure::Outside);
        if is_spare {
            assert_eq!(fly(&mut relay, 32, 34, 380.0), Departure::Outside);
            assert_eq!(fly(&mut relay, 34, 49, 900.0), Departure::Outside);
        }
        assert_eq!(fly(&mut relay, 49, 51, 900.0), before, "recovered");
        // A single low value, followed by silence, counts as well after 15 s.
        let (mut relay, before) = start();
        relay.handle_endurance(at(2), 100.0, 0.0);
        for s in 3..60 {
            relay.handle_timeout(at(s));
            let stays = relay.departure(at(s)) == before;
            assert_eq!(stays, s < 17, "{s}");
        }
        // If no later view exists, a relay returns after 15 s in spite of its low endurance. A spare does not return,
        // and a relay at its reserve only by the operator's order.
        let (mut relay, _) = start();
        assert_eq!(fly(&mut relay, 2, 18, 250.0), Departure::Outside);
        let stays = fly(&mut relay, 18, 60, 250.0) == Departure::Outside;
        assert_eq!(stays, is_spare);
        let (mut relay, _) = start();
        assert_eq!(fly(&mut relay, 2, 1_000, 150.0), Departure::Outside);
        relay.stay(at(1_000));
        assert_eq!(
            relay.departure(at(1_000)),
            Departure::Member,
            "the operator's order"
        );
    }
}

/// Checks that one high endurance value does not return a relay that left the chain at its reserve.
///
/// The relay returns only after 15 s of high endurance.
#[test]
fn one_high_value_does_not_return_a_relay_at_its_reserve() {
    let mut relay = shared(3, 2);
    assert_eq!(fly(&mut relay, 2, 40, 100.0), Departure::Outside);
    assert!(relay.must_leave() && relay.is_at_reserve());
    for s in 40..200 {
        let left_s = if s % 14 == 0 { 1_200.0 } else { 100.0 };
        assert_eq!(fly(&mut relay, s, s + 1, left_s), Departure::Outside, "{s}");
        assert!(relay.must_leave(), "{s}");
    }
    assert_eq!(fly(&mut relay, 200, 215, 300.0), Departure::Outside);
    assert!(relay.is_at_reserve());
    // It is still needed: there is no later view.
    assert_eq!(fly(&mut relay, 215, 217, 300.0), Departure::Requested);
    assert!(!relay.is_at_reserve());
}

/// Checks that landing and taking off do not bring a relay with a low battery back into the chain.
///
/// The relay rejoins only after 15 s of high endurance.
#[test]
fn a_landing_does_not_return_a_spent_relay() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut pair = Pair::new(Vehicle::flying(kind), 3, 2);
        pair.home();
        let low = |vehicle: &mut Vehicle, _| vehicle.battery(0, 5, 150);
        let is_inside = |pair: &Pair| pair.relay.departure(pair.vehicle.now) != Departure::Outside;
        // Its restart: 15 s before it takes part in anything.
        fly(&mut pair.relay, 1, 18, 100.0);
        pair.run(40, low, |_| false);
        assert!(!is_inside(&pair) && pair.relay.is_at_reserve());
        for _ in 0..2 {
            pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
            pair.run(4, low, is_inside);
            assert!(!pair.relay.must_leave());
            pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
            assert_eq!(pair.run(14, low, is_inside), None);
        }
        assert_eq!(pair.run(60, low, is_inside), None);
        pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
        pair.run(4, low, is_inside);
        pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
        let high = |vehicle: &mut Vehicle, _| vehicle.battery(0, 80, 1_500);
        let returned = pair.run(60, high, is_inside);
        assert!(
            returned.is_some_and(|s| (14..=17).contains(&s)),
            "{returned:?}"
        );
    }
}

/// Checks that the home position becomes unknown if the autopilot restarts.
#[test]
fn a_restarted_autopilot_has_no_home() {
    let mut pair = Pair::flying(Kind::Px4);
    let time = |vehicle: &mut Vehicle, _: i32| vehicle.battery(0, 50, 1_000);
    pair.run(3, time, |_| false);
    assert!(pair.relay.endurance_s(pair.vehicle.now).is_some());
    pair.vehicle.reboot();
    pair.run(3, time, |_| false);
    pair.vehicle.armed = true;
    pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    pair.run(5, time, |_| false);
    assert_eq!(pair.told(), [None; 2], "the home of the flight before");
    pair.home();
    pair.run(2, time, |_| false);
    assert!(pair.relay.endurance_s(pair.vehicle.now).is_some());
}

/// Checks that the link requests battery messages while none arrive.
///
/// This holds both at the start and after the messages have stopped.
#[test]
fn messages_of_the_battery_are_requested_while_they_are_missing() {
    let mut pair = Pair::flying(Kind::ArduCopter);
    pair.vehicle.link.set_endurance(1_200.0, 5.0, 1.5);
    let asked = |pair: &Pair| {
        [147, 242].map(|id| {
            let all = pair.vehicle.received.iter();
            all.filter(|(_, heard)| *heard == LinkMessage::Interval { id })
                .count()
        })
    };
    let sends = |vehicle: &mut Vehicle, _| {
        vehicle.battery(0, 80, 0);
        vehicle.home(axis().point(Placement::on_line(300.0, 10.0)).unwrap());
    };
    pair.run(8, sends, |_| false);
    let first = asked(&pair);
    pair.run(60, sends, |_| false);
    assert_eq!(asked(&pair), first, "they arrive");
    pair.run(20, |_, _| {}, |_| false);
    let then = asked(&pair);
    assert!(then[0] > first[0] && then[1] > first[1], "{then:?}");
}

/// Checks that the pilot is told once a minute of the reached reserve, in spite of an order to stay.
#[test]
fn an_order_to_stay_does_not_silence_the_reserve() {
    const RESERVE: &str = "battery: at the reserve";
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for mode in [Mode::Companion, Mode::Position] {
            let mut pair = Pair::flying(kind);
            pair.vehicle.mode = mode;
            let low = |vehicle: &mut Vehicle, _| vehicle.battery(0, 10, 200);
            pair.run(30, low, |pair| !pair.read(RESERVE).is_empty())
                .unwrap();
            pair.relay.stay(pair.vehicle.now);
            pair.run(185, low, |_| false);
            assert_eq!(
                pair.relay.departure(pair.vehicle.now),
                Departure::Member,
                "it stays"
            );
            let times = pair.read(RESERVE);
            assert_eq!(times.len(), 4, "{times:?}");
            let spaces = times.windows(2).map(|pair| pair[1] - pair[0]);
            assert!(
                spaces.clone().all(|s| (60.0..62.0).contains(&s)),
                "{times:?}"
            );
            let high = |vehicle: &mut Vehicle, _| vehicle.battery(0, 80, 1_200);
            pair.run(120, high, |_| false);
            assert_eq!(pair.read(RESERVE).len(), 4, "a reserve again");
        }
    }
}

/// Checks that a drone counts as landed when it is disarmed, or has reported the landed state for 2 s.
#[test]
fn a_drone_is_landed_by_its_own_report() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = Vehicle::new(kind);
        vehicle.armed = true;
        vehicle.heartbeat();
        vehicle.drive();
        assert_eq!(vehicle.link.state(), State::Grounded);
        assert!(!vehicle.link.is_landed(vehicle.now), "{kind:?}");
        vehicle.run(1_500);
        assert!(!vehicle.link.is_landed(vehicle.now), "{kind:?}");
        vehicle.run(1_500);
        assert!(vehicle.link.is_landed(vehicle.now), "{kind:?}");
        vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
        vehicle.run(1_000);
        assert!(!vehicle.link.is_landed(vehicle.now), "{kind:?}");
        vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
        vehicle.armed = false;
        vehicle.run(1_000);
        assert!(vehicle.link.is_landed(vehicle.now), "{kind:?}");
    }
}

/// Checks that the endurance stays known if the autopilot reports the landed state only once in flight.
#[test]
fn a_flicker_of_the_landed_state_forgets_nothing() {
    let mut pair = Pair::flying(Kind::Px4);
    let time = |vehicle: &mut Vehicle, _: i32| vehicle.battery(0, 50, 1_000);
    pair.run(3, time, |_| false);
    pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
    pair.run(1, |_, _| {}, |_| false);
    pair.vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    pair.run(1, |_, _| {}, |_| false);
    assert!(pair.relay.endurance_s(pair.vehicle.now).is_some());
}

/// Checks that the endurance becomes unknown if the position is too old to compute the way home.
#[test]
fn a_way_home_from_an_old_position_is_unknown() {
    let mut pair = Pair::flying(Kind::Px4);
    let time = |vehicle: &mut Vehicle, _: i32| vehicle.battery(0, 50, 1_000);
    pair.run(3, time, |_| false);
    pair.vehicle.position_every_ms = u64::MAX;
    pair.run(9, time, |_| false);
    assert_eq!(pair.relay.endurance_losses(), 0);
    pair.run(3, time, |_| false);
    assert_eq!(pair.relay.endurance_losses(), 1);
    assert_eq!(pair.told()[0], None);
}

/// Checks that setpoint control ends if a PX4 sends only battery messages for 0.84 s.
///
/// After such a silence the PX4 may be in a failsafe, so the pilot must choose the mode again.
#[test]
fn messages_of_the_battery_hide_no_silence_of_a_px4() {
    // The phase shifts the link's TIMESYNC requests. In some phases no reply is late, and the link notices only the
    // silence.
    for phase in 0..10 {
        let mut vehicle = Vehicle::engaged(Kind::Px4, 300.0);
        vehicle.run(50 * phase);
        assert_eq!(vehicle.link.state(), State::Engaged);
        vehicle.mute = true;
        vehicle.echoes = false;
        for _ in 0..3 {
            vehicle.run(280);
            vehicle.battery(0, 50, 1_000);
            vehicle.sys_status(50);
        }
        vehicle.mute = false;
        vehicle.echoes = true;
        vehicle.run(3_000);
        assert_eq!(
            vehicle.link.state(),
            State::Standby,
            "phase {phase}: the pilot has to choose again"
        );
    }
}

/// Checks that a relay cancels its request to leave after 15 s of sufficient endurance.
///
/// Sufficient is 30 s above the limit for leaving. A request by the firmware is not cancelled.
#[test]
fn a_request_ends_once_the_endurance_has_recovered() {
    let mut relay = shared(1, 1);
    assert_eq!(fly(&mut relay, 1, 10, 900.0), Departure::Member);
    assert_ne!(fly(&mut relay, 10, 26, 340.0), Departure::Member);
    assert!(relay.leaves_by_endurance() && !relay.must_leave());
    assert_ne!(fly(&mut relay, 26, 60, 385.0), Departure::Member);
    assert_ne!(fly(&mut relay, 60, 74, 395.0), Departure::Member);
    assert_eq!(fly(&mut relay, 74, 77, 395.0), Departure::Member);
    relay.leave(at(77), None);
    assert!(!relay.leaves_by_endurance());
    assert_ne!(fly(&mut relay, 77, 200, 900.0), Departure::Member);
}

/// Checks that an endurance that is unknown in every second value is reported only once a minute.
///
/// A value of six hours or more counts as unknown.
#[test]
fn alternating_values_are_told_once_a_minute() {
    let mut relay = shared(1, 1);
    let mut events = 0;
    for s in 1..=240 {
        let left_s = if s % 2 == 0 { 900.0 } else { f32::NAN };
        relay.handle_endurance(at(s), left_s, 0.0);
        while let Some(event) = relay.poll_event() {
            events += u32::from(event == Event::EnduranceUnknown);
        }
    }
    assert_eq!((events, relay.endurance_losses()), (4, 120));
    relay.handle_endurance(at(241), 21_700.0, 0.0);
    assert_eq!(relay.endurance_s(at(241)), None, "six hours and more");
    relay.handle_endurance(at(242), 21_500.0, 0.0);
    assert_eq!(relay.endurance_s(at(242)), Some(21_500));
}

/// Checks that a relay without a reserve never leaves by itself.
///
/// Its endurance is shown, but an unknown endurance is not reported.
#[test]
fn without_a_reserve_the_endurance_is_only_shown() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut pair = Pair::flying(kind);
        pair.relay.set_reserve(None);
        pair.vehicle.mode = Mode::Companion;
        let low = |vehicle: &mut Vehicle, _| vehicle.battery(0, 5, 40);
        assert_eq!(pair.run(60, low, Pair::departs), None);
        assert_eq!(pair.told(), [Some(35), None]);
        assert_eq!(pair.run(100, |_, _| {}, Pair::departs), None);
        assert_eq!(pair.told(), [None; 2]);
        assert_eq!(pair.unknowns(), 0);
        let asked = |asked| {
            let all = pair.vehicle.received.iter();
            let all = all.filter(|(_, heard)| *heard == LinkMessage::Interval { id: asked });
            all.count()
        };
        assert_eq!(asked(147) + asked(242), 0);
        let mut asks = Pair::flying(kind);
        asks.vehicle.link.set_endurance(1_200.0, 5.0, 1.5);
        asks.run(60, |_, _| {}, Pair::departs);
        for id in [147, 242] {
            let all = asks.vehicle.received.iter();
            let all = all.filter(|(_, heard)| *heard == LinkMessage::Interval { id });
            let most = if kind == Kind::Px4 { 0 } else { 4 };
            assert!((most.min(1)..=most).contains(&all.count()), "{id}");
        }
    }
}
