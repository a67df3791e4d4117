//! Tests with captures of a simulated flight, one for each node, whose clocks differ.

#![cfg(not(target_os = "none"))]
#![cfg(test)]
#![allow(clippy::float_cmp)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use uav_relay::{GuardConfig, Instant, Side};
use uav_relay_capture::{Capture, Direction, Frame};
use uav_relay_replay::recording::Recording;
use uav_relay_replay::{clocks, replay};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission::mission;
use uav_relay_sim::simulator::drones::FlightSpec;
use uav_relay_sim::simulator::faults::LinkSpec;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::{Link, OnAir};
use uav_relay_sim::simulator::setup::Setup;

/// Delay of a frame from its last byte to its arrival, ms.
const LATENCY_MS: u64 = 2;

/// Simulated flight: all frames, and the relays' final positions.
struct Flown {
    frames: Vec<OnAir>,
    places: BTreeMap<u16, [f64; 2]>,
}

/// Simulates a chain with serial ports between neighbours or with a shared radio channel.
///
/// Relay 2 is switched off at `kill_s`. The ground station at Tx requests reports.
fn fly(relays: u16, is_shared: bool, seconds: u64, kill_s: Option<u64>) -> Flown {
    let (mission, _) = mission(&Scenario::default(), relays, 1e-4).unwrap();
    let mut setup = if is_shared {
        Setup::on_air(mission, Access::Csma)
    } else {
        Setup::new(mission)
    };
    setup.link = LinkSpec {
        baud: 57_600,
        latency: uav_relay::Duration::from_millis(LATENCY_MS),
    };
    setup.auth = true;
    setup.record = true;
    setup.watches = vec![(Side::Upstream, Instant::from_millis(1_000))];
    setup.kills = kill_s
        .into_iter()
        .map(|at| (2, Instant::from_millis(1_000 * at)))
        .collect();
    setup.settings.guard = Some(GuardConfig::of(&mission, mission.config().common));
    let distance_m = f64::from(mission.config().distance_m);
    let starts = (1..=relays).map(|index| {
        [
            distance_m * f64::from(index) / f64::from(relays + 1),
            0.0,
            20.0,
        ]
    });
    setup.flight = Some(FlightSpec::multicopters(starts.collect(), 0.0, 0.0));
    let end = Instant::from_millis(1_000 * seconds);
    let mut chain = uav_relay_sim::simulator::chain::Chain::new(setup.soaked(end)).unwrap();
    chain.advance(end);
    let places = chain.live(end).filter_map(|it| {
        let place = it.report.position?;
        Some((
            it.report.relay,
            [f64::from(place.x_m), f64::from(place.y_m)],
        ))
    });
    Flown {
        places: places.collect(),
        frames: chain.frames(end),
    }
}

/// Clock of a simulated node: it has an offset, s, a relative drift, and a sudden step.
///
/// `step` has the step's time and size, s.
#[derive(Clone, Copy, Default)]
struct Clock {
    offset: f64,
    drift: f64,
    step: Option<(f64, f64)>,
}

impl Clock {
    fn at(self, time: f64) -> f64 {
        let step = self
            .step
            .filter(|(from, _)| time >= *from)
            .map_or(0.0, |(_, by)| by);
        time * (1.0 + self.drift) + self.offset + step
    }
}

/// Writes the frames that `node` has sent and received to a capture, with the times of `clock`.
///
/// The node is switched off at `end_s`. From second 70 to 71.5 it receives nothing, so that just after a step of its
/// clock no frame in two captures shows the new offset.
fn capture(flown: &Flown, folder: &Path, node: u16, clock: Clock, end_s: f64) -> PathBuf {
    let path = folder.join(format!("node{node}.pcapng"));
    let mut capture = Capture::new(std::fs::File::create(&path).unwrap(), "a test", "").unwrap();
    let port = capture.interface("port", "").unwrap();
    for (number, frame) in flown.frames.iter().enumerate() {
        let end = frame.at.as_micros() as f64 / 1e6;
        let sender = sender(&frame.bytes);
        let hears = match frame.link {
            Link::After(before) => node == before || node == before + 1,
            Link::Shared => sender.abs_diff(node) <= 4,
        };
        if !hears || end >= end_s {
            continue;
        }
        let (time, direction) = if sender == node {
            (end - frame.bytes.len() as f64 / 5_760.0, Direction::Out)
        } else if frame.note.is_empty() && !(70.0..71.5).contains(&end) {
            // A program reads a frame up to 8 ms after its last byte.
            let late = LATENCY_MS as f64 + (number * 7 % 9) as f64;
            (end + late / 1e3, Direction::In)
        } else {
            continue;
        };
        let frame = Frame {
            at: Duration::from_secs_f64(clock.at(time)),
            bytes: &frame.bytes,
            len: frame.bytes.len(),
            direction,
            comment: "",
        };
        capture.frame(port, &frame).unwrap();
    }
    capture.finish().unwrap();
    path
}

/// Returns the node number of a frame's sender, from its decoded header.
fn sender(wire: &[u8]) -> u16 {
    let mut deframer = uav_relay::wire::deframe::Deframer::new();
    let (last, rest) = wire.split_last().unwrap();
    for byte in rest {
        assert!(deframer.push(*byte).is_none());
    }
    let plain = deframer.push(*last).unwrap().unwrap();
    uav_relay::wire::frame::open(plain).unwrap().header.sender
}

const EPOCH: f64 = 1.8e9;

/// Checks that an operator's command in the comment on a damaged packet is kept.
///
/// The command must move to the next frame, or to the last frame if no frame follows.
#[test]
fn an_act_on_a_damaged_packet_is_kept() {
    let flown = fly(2, false, 10, None);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("station.pcapng");
    let mut capture = Capture::new(std::fs::File::create(&path).unwrap(), "", "").unwrap();
    let port = capture.interface("", "").unwrap();
    let mut put = |number: usize, is_damaged: bool, comment: &str| {
        let mut bytes = flown.frames[number].bytes.clone();
        bytes[9] ^= if is_damaged { 0x55 } else { 0 };
        let frame = Frame {
            at: Duration::from_secs(number as u64),
            bytes: &bytes,
            len: bytes.len(),
            direction: Direction::In,
            comment,
        };
        capture.frame(port, &frame).unwrap();
    };
    put(0, false, "");
    put(1, true, "operator: one");
    put(2, true, "");
    put(3, false, "operator: two");
    put(4, false, "");
    put(5, true, "operator: three");
    capture.finish().unwrap();
    let read = Recording::load(&path).unwrap().frames;
    let read: Vec<&str> = read.iter().map(|it| &it.comment[..]).collect();
    assert_eq!(
        read,
        ["", "operator: one; operator: two", "operator: three"]
    );
}

#[test]
fn frames_of_clocks_that_differ_drift_and_step_are_in_their_order() {
    let flown = fly(3, false, 150, None);
    let folder = tempfile::tempdir().unwrap();
    let clocks = [
        Clock {
            offset: EPOCH,
            ..Clock::default()
        },
        Clock {
            offset: EPOCH + 7.25,
            drift: 100e-6,
            step: None,
        },
        Clock {
            offset: EPOCH - 3_000.5,
            drift: -100e-6,
            step: None,
        },
        Clock {
            offset: 12.0,
            drift: 20e-6,
            step: Some((70.0, EPOCH)),
        },
    ];
    let files: Vec<PathBuf> = (0..)
        .zip(clocks)
        .map(|(node, clock)| capture(&flown, folder.path(), node, clock, f64::INFINITY))
        .collect();
    let recordings = files.iter().map(|file| Recording::load(file).unwrap());
    let merged = clocks::merge(recordings.collect()).unwrap();
    let (frames, alignments) = (merged.frames, merged.files);
    assert_eq!(merged.warnings, Vec::<String>::new());
    assert!(
        alignments[1..].iter().all(|it| it.common > Some(100)),
        "{alignments:?}"
    );
    let truth = flown.frames.iter().map(|frame| (&frame.bytes, frame));
    let truth: BTreeMap<_, _> = truth.collect();
    let errors: Vec<f64> = frames
        .iter()
        .filter_map(|frame| {
            let sent = truth.get(&frame.wire)?;
            let begin = sent.at.as_micros() as f64 / 1e6 - sent.bytes.len() as f64 / 5_760.0;
            Some((frame.at - EPOCH - begin).abs())
        })
        .collect();
    let most = errors.iter().copied().fold(0.0, f64::max);
    println!(
        "{} frames of {}, largest error {:.1} ms",
        errors.len(),
        flown.frames.len(),
        most * 1e3
    );
    assert!(errors.len() * 10 > flown.frames.len() * 9);
    assert!(most < 0.01, "{most} s");

    let shown = replay(&files, None).unwrap().flight;
    for relay in &shown.last.relays {
        let [x, y] = flown.places[&relay.number];
        let at = relay.position.unwrap();
        assert!(
            (at.x_m - x).hypot(at.y_m - y) < 1.0,
            "{relay:?}, but {x} {y}"
        );
    }
    assert!(shown.available.unwrap().1[0] > 0.9, "{:?}", shown.available);
    // The relays report the digest of the default scenario's mission.
    assert!(shown.worst_db.last().unwrap().is_some());
}

/// Writes the captures of all nodes with the same clock; returns their paths.
///
/// Relay 2 is switched off at `kill_s`.
fn captures(flown: &Flown, folder: &Path, relays: u16, kill_s: f64) -> Vec<PathBuf> {
    let clock = Clock {
        offset: EPOCH,
        ..Clock::default()
    };
    let end_s = |node| if node == 2 { kill_s } else { f64::INFINITY };
    let nodes = 0..=relays;
    nodes
        .map(|node| capture(flown, folder, node, clock, end_s(node)))
        .collect()
}

#[test]
fn files_that_are_no_captures_of_one_flight_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let flown = fly(3, false, 40, None);
    let files = captures(&flown, folder.path(), 3, f64::INFINITY);
    let whole = std::fs::read(&files[1]).unwrap();
    let first = std::fs::read(&files[0]).unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    // The link type of the interface is changed to a wrong one.
    let mut ethernet = whole.clone();
    let at = ethernet
        .windows(4)
        .position(|it| it == [147, 0, 0, 0])
        .unwrap();
    ethernet[at] = 1;
    // The capture gets a fault in the middle of each frame.
    let mut noise = Capture::new(Vec::new(), "", "").unwrap();
    let port = noise.interface("", "").unwrap();
    for frame in &flown.frames {
        let mut bytes = frame.bytes.clone();
        bytes[9] ^= 0x55;
        let frame = Frame {
            at: Duration::ZERO,
            bytes: &bytes,
            len: bytes.len(),
            direction: Direction::In,
            comment: "",
        };
        noise.frame(port, &frame).unwrap();
    }
    let late = folder.path().join("late");
    std::fs::create_dir(&late).unwrap();
    let day = Clock {
        offset: EPOCH + 86_400.0,
        ..Clock::default()
    };
    let next_day = capture(&fly(3, false, 20, Some(15)), &late, 2, day, f64::INFINITY);
    let fleet = folder.path().join("other");
    std::fs::create_dir(&fleet).unwrap();
    let other = captures(&fly(4, false, 20, None), &fleet, 4, f64::INFINITY);
    let text = write("text.pcapng", b"x_m,y_m\n1,2\n");
    let cut = write("cut.pcapng", &whole[..100]);
    let ethernet = write("ethernet.pcapng", &ethernet);
    let noise = write("noise.pcapng", &noise.finish().unwrap());
    let absent = folder.path().join("absent.pcapng");
    let part = write("part.pcapng", &first[..first.len() / 2]);
    for (file, why) in [
        (write("empty.pcapng", &[]), "has no frames of relays"),
        (text, "is not a capture (pcapng)"),
        (
            cut,
            "is not a valid capture: the file ends inside a pcapng block",
        ),
        (ethernet, "has no frames of relays"),
        (noise, "is an intact frame of a relay"),
        (absent, "cannot be read: No such file or directory"),
        (other[2].clone(), "the files are of different chains"),
        (write("again.pcapng", &first), "is the same capture as"),
        (part, "is the same capture as"),
        (
            next_day,
            "24.0 h apart from them by its clock: not of the same flight",
        ),
    ] {
        let error = replay(&[files[0].clone(), file.clone()], None).unwrap_err();
        println!("{error}");
        assert!(
            error.starts_with(&*file.to_string_lossy()) && error.contains(why),
            "{error}"
        );
    }
    let text = uav_relay_scenario::DEFAULT.replace("distance_m = 1000", "distance_m = 900");
    let scenario = write("other.toml", text.as_bytes());
    let error = replay(&files, Some(&scenario)).unwrap_err();
    assert!(
        error.contains("other.toml: its mission of 3 relays is not the one"),
        "{error}"
    );
    // A companion has lost its power. Its frames until then are used.
    let cut = write("lost_power.pcapng", &whole[..whole.len() / 2]);
    let shown = replay(&[files[0].clone(), cut, files[2].clone()], None).unwrap();
    assert!(
        shown.warnings[0].contains("lost_power.pcapng: damaged after"),
        "{:?}",
        shown.warnings
    );
    assert_eq!(shown.warnings.len(), 1, "{:?}", shown.warnings);
}

#[test]
fn ten_minutes_of_eight_relays_are_a_small_page_with_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let flown = fly(8, true, 600, Some(300));
    let files = captures(&flown, folder.path(), 8, 300.0);
    let shown = replay(&files, None).unwrap();
    let (flight, html) = (&shown.flight, &shown.html);
    println!(
        "{} frames, page of {} bytes",
        flown.frames.len(),
        html.len()
    );
    assert!(
        (1_190..=1_201).contains(&flight.steps.len()),
        "{}",
        flight.steps.len()
    );
    assert!(html.len() < 5_000_000, "{}", html.len());
    assert_eq!(shown.warnings, Vec::<String>::new());
    let (from, [all, members]) = flight.available.unwrap();
    assert!(
        from < 60.0 && (0.3..0.6).contains(&all) && members > 0.9,
        "{:?}",
        flight.available
    );
    // Relay 2 is lost for good, and the others move to their new positions.
    let [loss] = flight.losses.as_slice() else {
        panic!("{:?}", flight.losses)
    };
    assert!(
        loss.relay == 2 && (loss.from - 300.0).abs() < 2.0 && loss.until.is_none(),
        "{loss:?}"
    );
    assert_eq!(flight.views.last().unwrap().2, 7);
    assert!(
        flight
            .alarms
            .iter()
            .any(|it| it.text.starts_with("relay 2")),
        "{:?}",
        flight.alarms
    );
    let nearest = flight.nearest.unwrap();
    assert!((10.0..100.0).contains(&nearest.distance_m), "{nearest:?}");
    for (relay, [x, y]) in flown.places.iter().filter(|(relay, _)| **relay != 2) {
        let shown = flight
            .last
            .relays
            .iter()
            .find(|it| it.number == *relay)
            .unwrap();
        let at = shown.position.unwrap();
        assert!(
            (at.x_m - x).hypot(at.y_m - y) < 1.0,
            "{shown:?}, but {x} {y}"
        );
    }
    // The page loads nothing, and no text of a file becomes a part of it.
    assert!(
        !html.contains("src=\"")
            && !html.contains("href=\"/")
            && html.contains("default-src 'none'")
    );
}
