//! Tests of a flight's figures with made-up reports: long flights, outages, and near passes.

#![cfg(not(target_os = "none"))]
#![cfg(test)]

use uav_relay::Placement;
use uav_relay::wire::frame::Header;
use uav_relay::wire::message::{Coarse, Entry, Message, Reports};
use uav_relay_capture::Direction;
use uav_relay_replay::flight::Flight;
use uav_relay_replay::recording::{Frame, Recording};
use uav_relay_replay::{clocks, page};

/// State in a report: the pilot flies the drone.
const FLOWN: u16 = 4_096;

/// Returns a frame with a report: at the time `at`, s, relay `relay` is at `x_m` on the line Tx-Rx.
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
        comment: String::new(),
    }
}

#[test]
fn outages_of_a_long_flight_are_alarms_and_losses() {
    // Relay 2 is lost at 5000 s. All relays are silent from 9000 to 9060 s, and relay 1 falls silent three seconds
    // earlier.
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
    // Before the first agreement, reports may be less frequent.
    let begin_s = begins("relay 2");
    assert!((begin_s - 5_010.0).abs() < 1.0, "{begin_s}");
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

/// Checks that a relay that the operator has reported as landed disappears until it reports again.
#[test]
fn a_relay_that_the_operator_cleared_is_gone_until_it_reports_again() {
    let flown = |end: i32| {
        let mut frames = Vec::new();
        for second in 0..end {
            for relay in [1, 2, 3] {
                if relay != 2 || second <= 20 || second > 90 {
                    frames.push(report(f64::from(second), relay, 100.0 * f32::from(relay)));
                }
            }
        }
        for frame in &mut frames {
            let acts = match (frame.at, frame.header.sender) {
                // Relay 3 is not lost, so this command is only logged.
                (15.0, 1) => "operator: clear-lost 3 by the page; operator: upload 1 by the page",
                (60.0, 3) => "operator: clear-lost 2 by the page at 127.0.0.1",
                _ => continue,
            };
            acts.clone_into(&mut frame.comment);
        }
        Flight::new(&frames, 3, None)
    };
    let listed = |flight: &Flight| {
        flight
            .last
            .relays
            .iter()
            .map(|it| it.number)
            .collect::<Vec<_>>()
    };
    let lasting = |flight: &Flight| {
        flight
            .alarms
            .iter()
            .filter(|it| it.cleared_s.is_none())
            .count()
    };
    let before = flown(59);
    assert_eq!((listed(&before), lasting(&before)), (vec![1, 2, 3], 1));
    let cleared = flown(80);
    assert_eq!((listed(&cleared), lasting(&cleared)), (vec![1, 3], 0));
    let alarm = cleared.alarms.iter().find(|it| it.lost == Some(2)).unwrap();
    assert!((alarm.cleared_s.unwrap() - 60.0).abs() < 1.0, "{alarm:?}");
    let back = flown(100);
    assert_eq!((listed(&back), lasting(&back)), (vec![1, 2, 3], 0));
    let acts: Vec<_> = back
        .log
        .iter()
        .filter(|it| it.text.contains("operator") || it.text.contains("cleared"))
        .collect();
    let texts: Vec<&str> = acts.iter().map(|it| &it.text[..]).collect();
    assert_eq!(
        texts,
        [
            "operator: clear-lost 3 by the page",
            "operator: upload 1 by the page",
            "operator: lost relay 2 cleared",
            "relay 2: reports again after it was cleared"
        ]
    );
    assert!((acts[2].time_s - 60.0).abs() < 1.0);
}

/// Checks that no operator's command is lost or moved far in time, even if a capture repeats its frame.
#[test]
fn acts_of_the_operator_stay_at_their_time_and_are_all_kept() {
    let seconds = || (0..100).map(f64::from);
    let mut station = recording(1, seconds());
    let mut other = recording(1, seconds().map(|at| at + 0.01));
    other.frames[30].at += 0.02;
    // Two copies of the frame at second 10 have a command. The second copy is the last frame.
    let mut repeated = station.frames[10].clone();
    repeated.at = 60.5;
    "operator: clear-lost 3 by one".clone_into(&mut repeated.comment);
    station.frames.insert(61, repeated);
    let mut late = station.frames[10].clone();
    late.at = 99.5;
    "operator: clear-lost 4 by one".clone_into(&mut late.comment);
    station.frames.push(late);
    // Both stations have a command at the same frame.
    "operator: upload 1 by one".clone_into(&mut station.frames[30].comment);
    "operator: upload 2 by other".clone_into(&mut other.frames[30].comment);
    let merged = clocks::merge(vec![station, other]).unwrap();
    assert_eq!(merged.frames.len(), 100);
    let acts = merged.frames.iter().filter(|it| !it.comment.is_empty());
    let acts: Vec<(f64, &str)> = acts.map(|it| (it.at.round(), &it.comment[..])).collect();
    assert_eq!(
        acts,
        [
            (30.0, "operator: upload 1 by one"),
            (31.0, "operator: upload 2 by other"),
            (61.0, "operator: clear-lost 3 by one"),
            (99.0, "operator: clear-lost 4 by one"),
        ]
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

/// Returns a recording with frames of relay `relay` at these times, s.
fn recording(relay: u16, times: impl Iterator<Item = f64>) -> Recording {
    let frames = (0..u64::MAX).zip(times).map(|(number, at)| Frame {
        wire: [u64::from(relay).to_le_bytes(), number.to_le_bytes()].concat(),
        ..report(at, relay, 100.0)
    });
    Recording {
        name: format!("relay{relay}"),
        frames: frames.collect(),
        network: 1,
        mission: None,
        fault: None,
    }
}

#[test]
fn steps_of_the_first_clock_are_left_out_with_a_warning() {
    // The file's clock starts in 1970, is set to the right time at second 60, and goes back by 5 s at second 90.
    let seconds = (0..120).map(f64::from);
    let clock = seconds.map(|at| match at {
        ..60.0 => at,
        60.0..90.0 => 1.8e9 + at,
        _ => 1.8e9 - 5.0 + at,
    });
    let merged = clocks::merge(vec![recording(1, clock)]).unwrap();
    let [warning] = merged.warnings.as_slice() else {
        panic!("{:?}", merged.warnings)
    };
    let expected =
        "jumps by +1800000001.0 s, 59 s after its first frame (2 jumps in all): corrected";
    assert!(warning.contains(expected), "{warning}");
    let [first, last] = [0, 119].map(|index| merged.frames[index].at);
    assert!((last - first - 117.0).abs() < 1e-3, "{first} {last}");
    assert!((last - 1.8e9 - 114.0).abs() < 1e-3, "{last}");
    let flight = Flight::new(&merged.frames, 1, None);
    assert!((234..=236).contains(&flight.steps.len()));
}

#[test]
fn steps_of_another_clock_without_common_frames_are_left_out_with_a_warning() {
    let seconds = |from: f64| (0..60).map(move |at| from + f64::from(at));
    let other = recording(2, seconds(1e9).chain(seconds(2e9)));
    let merged = clocks::merge(vec![recording(1, seconds(1e9)), other]).unwrap();
    assert!(
        merged.warnings.iter().any(|it| it
            .starts_with("the time of the flight jumps by +999999941.0 s, 59 s after its first")),
        "{:?}",
        merged.warnings
    );
    assert!(Flight::new(&merged.frames, 2, None).duration < 120.0);
}

#[test]
fn a_chart_of_years_has_few_labels() {
    let flight = Flight {
        duration: 1.8e9,
        period: 250_000.0,
        worst_db: vec![Some(1.0); 7_200],
        ..Flight::default()
    };
    let html = page::page(&flight, &[], &[]);
    let labels = html.matches("text-anchor=\"middle\">").count();
    assert!((5..=20).contains(&labels), "{labels}");
}

#[test]
fn the_page_replaces_neither_an_input_nor_a_capture() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let capture = write("flight.pcapng", b"\n\r\r\n");
    let input = write("input.pcapng", b"x");
    let scenario = write("drone.toml", b"x");
    let linked = folder.path().join("link.html");
    std::os::unix::fs::symlink(&input, &linked).unwrap();
    for (out, what) in [
        (&input, "an input file"),
        (&linked, "an input file"),
        (&scenario, "an input file"),
        (&capture, "a capture"),
    ] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_replay"));
        command.arg(&input).arg("--scenario").arg(&scenario);
        let output = command.arg("--out").arg(out).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        let expected = format!(
            "{}: --out is {what}: give another name, as flight.html",
            out.display()
        );
        assert!(error.contains(&expected), "{error}");
    }
    assert_eq!(std::fs::read(&capture).unwrap(), b"\n\r\r\n");
}
