//! Captures of a simulated flight, one of each node, with clocks of their own: merged, shown, refused.

#![cfg(not(target_os = "none"))]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::float_cmp,
    reason = "a test fails by it"
)]

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
use uav_relay_sim::simulator::outcome::{Link, OnAir};
use uav_relay_sim::simulator::setup::Setup;

/// Time that a frame takes from its sender to its receiver, after its last byte.
const LATENCY_MS: u64 = 2;

/// A simulated flight: all frames, and the relays' positions at the end.
struct Flown {
    frames: Vec<OnAir>,
    places: BTreeMap<u16, [f64; 2]>,
}

/// Flies a chain over wires, whose ground station at Tx watches. Relay 2 is switched off at `kill_s`.
fn fly(relays: u16, seconds: u64, kill_s: Option<u64>) -> Flown {
    let (mission, _) = mission(&Scenario::default(), relays, 1e-4).unwrap();
    let mut setup = Setup::new(mission);
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

/// Clock of a node: offset, s, drift, and from a time on a step, s.
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

/// Writes the capture of `node`, by its clock, until it is switched off at `end_s`.
fn capture(flown: &Flown, folder: &Path, node: u16, clock: Clock, end_s: f64) -> PathBuf {
    let path = folder.join(format!("node{node}.pcapng"));
    let mut capture = Capture::new(std::fs::File::create(&path).unwrap(), "a test", "").unwrap();
    let port = capture.interface("port", "").unwrap();
    for (number, frame) in flown.frames.iter().enumerate() {
        let Link::After(before) = frame.link else {
            panic!()
        };
        let end = frame.at.as_micros() as f64 / 1e6;
        let sender = sender(&frame.bytes);
        if (node != before && node != before + 1) || end >= end_s {
            continue;
        }
        let (time, direction) = if sender == node {
            (end - frame.bytes.len() as f64 / 5_760.0, Direction::Out)
        } else if frame.note.is_empty() {
            // A program reads up to 8 ms after the last byte.
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

/// Returns the sender of a frame: the low 12 bits of its first word, behind the first COBS code.
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

#[test]
fn frames_of_clocks_that_differ_drift_and_step_are_in_their_order() {
    let flown = fly(3, 150, None);
    let folder = tempfile::tempdir().unwrap();
    let clocks = [
        Clock {
            offset: EPOCH,
            ..Clock::default()
        },
        Clock {
            offset: EPOCH + 7.25,
            drift: 80e-6,
            step: None,
        },
        Clock {
            offset: EPOCH - 3_000.5,
            drift: -60e-6,
            step: None,
        },
        Clock {
            offset: 12.0,
            drift: 20e-6,
            step: Some((70.0, EPOCH)),
        },
    ];
    let files: Vec<PathBuf> = clocks
        .iter()
        .enumerate()
        .map(|(node, clock)| capture(&flown, folder.path(), node as u16, *clock, f64::INFINITY))
        .collect();
    let recordings = files.iter().map(|file| Recording::load(file).unwrap());
    let (frames, alignments, warnings) = clocks::merge(recordings.collect()).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
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
    assert!(most < 0.05, "{most} s");

    let shown = replay(&files, None).unwrap().flight;
    for relay in &shown.last.relays {
        let [x, y] = flown.places[&relay.number];
        let at = relay.position.unwrap();
        assert!(
            (at.x_m - x).hypot(at.y_m - y) < 1.0,
            "{relay:?}, but {x} {y}"
        );
    }
    assert!(shown.available.unwrap().1 > 0.9, "{:?}", shown.available);
    // The mission of the default scenario is known by its digest.
    assert!(shown.worst_db.last().unwrap().is_some());
}
