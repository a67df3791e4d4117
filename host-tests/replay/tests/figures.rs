//! Figures of flights whose reports are made up: long ones, outages, and near passes.

#![cfg(not(target_os = "none"))]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test fails by it"
)]

use uav_relay::Placement;
use uav_relay::wire::frame::Header;
use uav_relay::wire::message::{Coarse, Entry, Message, Reports};
use uav_relay_capture::Direction;
use uav_relay_replay::flight::Flight;
use uav_relay_replay::recording::Frame;

/// State of a relay that its pilot flies.
const FLOWN: u16 = 4_096;

/// Returns a frame with the report of a relay at `x_m` on the line, at a time in s.
fn report(at: f64, relay: u16, x_m: f32) -> Frame {
    let place = Placement {
        x_m,
        y_m: 0.0,
        altitude_m: 20.0,
    };
    let mut reports = Reports::new(1, 7);
    let entry = Entry::new(relay, 0, FLOWN, Coarse::of(Some(place)));
    reports.entries.push(entry).unwrap();
    Frame {
        at,
        direction: Direction::In,
        wire: Vec::new(),
        header: Header {
            network: 1,
            sender: relay,
            destination: 0,
            counter: 0,
        },
        message: Some(Message::Report(reports)),
    }
}

#[test]
fn outages_of_a_long_flight_are_alarms_and_losses() {
    // Relay 2 is lost at 5000 s; all relays from 9000 to 9060 s, relay 1 three seconds earlier.
    let mut frames = Vec::new();
    for second in 0..10_800 {
        let is_out = |from: i32| (from..9_060).contains(&second);
        let silent = [is_out(8_998), second > 5_000, is_out(9_001)];
        for (relay, _) in (1..).zip(silent).filter(|(_, is)| !is) {
            frames.push(report(f64::from(second), relay, 100.0 * f32::from(relay)));
        }
    }
    let flight = Flight::new(&frames, 3, None);
    assert!(flight.steps.len() <= 7_202 && flight.worst_db.len() == flight.steps.len());
    assert!((flight.time_of(flight.steps.len() - 1) - 10_799.0).abs() < 1e-9);
    let begins = |text: &str| {
        let alarm = flight.alarms.iter().find(|it| it.text.starts_with(text));
        alarm
            .unwrap_or_else(|| panic!("{:?}", flight.alarms))
            .time_s
    };
    assert!((begins("relay 2") - 5_005.0).abs() < 1.0);
    assert!((begins("no report of any relay for 59 s") - 9_005.0).abs() < 1.0);
    let losses: Vec<_> = flight
        .losses
        .iter()
        .map(|it| (it.relay, it.until))
        .collect();
    assert_eq!(
        losses,
        [(2, None), (0, Some(9_060.0))],
        "{:?}",
        flight.losses
    );
}

#[test]
fn a_near_pass_between_two_snapshots_is_found() {
    let times = [0.0, 10.0, 10.25, 10.5, 20.0];
    let frames: Vec<Frame> = times
        .into_iter()
        .zip([50.0, 20.0, 1.0, 20.0, 50.0])
        .flat_map(|(at, apart)| [report(at, 1, 100.0), report(at, 2, 100.0 + apart)])
        .collect();
    let nearest = Flight::new(&frames, 2, None).nearest.unwrap();
    assert!((nearest.distance_m - 1.0).abs() < 0.01, "{nearest:?}");
    assert_eq!(nearest.relays, [1, 2]);
}
