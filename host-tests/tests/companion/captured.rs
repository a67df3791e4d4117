//! Captures of three processes' ports, as `cargo decode` reads them.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use rustix::process::Signal;
use serde_json::Value;

use super::medium::{Medium, QUIET};
use super::process::Relay;
use super::signed::Files;
use super::stays::fill_disk;
use super::{Chain, simulated};
use uav_relay_scenario::Scenario;

/// Sender, destination and counter of a frame.
type Seen = (u64, u64, u64);

/// Returns the frames in a capture with their directions. A capture may begin with a partial frame.
fn frames(file: &Path) -> Vec<(String, Seen)> {
    let output = Command::new("cargo")
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .args(["decode", "--json"])
        .arg(file)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let frames = text.lines().map(|line| serde_json::from_str(line).unwrap());
    let (whole, hurt): (Vec<Value>, Vec<Value>) =
        frames.partition(|frame: &Value| frame["refused"].is_null());
    assert!(hurt.len() <= 2, "{hurt:?}");
    let frame = |frame: &Value| {
        let number = |name: &str| frame[name].as_u64().unwrap();
        let way = frame["direction"].as_str().unwrap().to_owned();
        (
            way,
            (number("sender"), number("destination"), number("counter")),
        )
    };
    whole.iter().map(frame).collect()
}

#[test]
fn every_frame_is_in_the_captures_of_both_ends() {
    let folder = tempfile::tempdir().unwrap();
    let file = |index: usize| folder.path().join(format!("relay{index}.pcapng"));
    let mut chain = Chain::of_wires(3, QUIET);
    for index in 1..=3 {
        chain.options = vec!["--capture".to_owned(), file(index).display().to_string()];
        let relay = chain.relay(index);
        chain.relays.push(relay);
    }
    let places: Vec<_> = chain.relays.iter_mut().map(Relay::settled).collect();
    assert_eq!(places, simulated(&Scenario::default(), 3));
    // All frames in transit have arrived by then, and no new ones are sent for seconds.
    std::thread::sleep(Duration::from_millis(500));
    for relay in chain.relays {
        relay.signal(Signal::TERM);
        assert_eq!(relay.end().status, Some(0));
    }
    let all = [1, 2, 3].map(|index| frames(&file(index)));
    let went = |at: usize, way: &str, from: u64, to: u64| -> BTreeSet<Seen> {
        let frames = all[at - 1].iter().filter(|(its, _)| its == way);
        let seen = frames.map(|(_, seen)| *seen);
        seen.filter(|seen| (seen.0, seen.1) == (from, to)).collect()
    };
    for (from, to) in [(1, 2), (2, 1), (2, 3), (3, 2)] {
        let sent = went(from, "out", from as u64, to as u64);
        let heard = went(to, "in", from as u64, to as u64);
        assert!(
            !heard.is_empty() && heard.is_subset(&sent),
            "{from} to {to}"
        );
        assert!(sent.len() - heard.len() <= 2, "{sent:?}, {heard:?}");
    }
}

#[test]
fn a_capture_that_cannot_begin_is_refused() {
    let mut chain = Chain::of_wires(2, QUIET);
    chain.options = vec!["--capture".to_owned(), "/dev/full".to_owned()];
    let relay = chain.relay(1);
    let ended = relay.end();
    assert_eq!(ended.status, Some(1));
    assert!(
        ended.stderr.join(" ").contains("--capture /dev/full: "),
        "{ended:?}"
    );
}

/// Checks the middle relay, which has two ports and reports the failure once for both.
#[test]
fn a_disk_that_fills_up_ends_the_capture_and_not_the_flight() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("relay.pcapng");
    let capture = ["--capture", file.to_str().unwrap()].map(str::to_owned);
    let quick = ["--probe-after-ms", "300", "--dead-after-ms", "900"].map(str::to_owned);
    let mut chain = Chain::of_wires(3, QUIET);
    for index in 1..=3 {
        chain.options = quick.to_vec();
        if index == 2 {
            chain.options.extend(capture.clone());
        }
        let relay = chain.relay(index);
        chain.relays.push(relay);
    }
    assert_eq!(chain.settled(), simulated(&Scenario::default(), 3));
    fill_disk(chain.relays[1].pid(), true);
    let full = std::fs::metadata(&file).unwrap().len();
    let line = chain.relays[1].line("capture ended: ");
    let why = "--capture cannot be written: File too large";
    assert!(line.contains(why), "{line}");
    // The neighbours keep asking for signs of life and receive them.
    std::thread::sleep(Duration::from_secs(4));
    let again = chain.relays[1].lines_with("capture ended");
    assert!(again.is_empty(), "once: {again:?}");
    for relay in &mut chain.relays {
        assert!(!relay.has_said("lost: ") && !relay.has_said("lease expired: "));
    }
    // A capture does not resume when space is available again.
    fill_disk(chain.relays[1].pid(), false);
    std::thread::sleep(Duration::from_secs(1));
    assert!(std::fs::metadata(&file).unwrap().len() <= full + 64);
    for relay in chain.relays {
        relay.signal(Signal::TERM);
        assert_eq!(relay.end().status, Some(0));
    }
}

/// Checks a full disk at a ground station. It reports the end of its capture and still answers relays.
#[test]
fn a_disk_that_fills_up_ends_the_capture_and_not_the_station() {
    let files = Files::new();
    let wire = Medium::new(2, QUIET);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ground.pcapng").display().to_string();
    let level = folder.path().join("level");
    std::fs::write(&level, "1e-9\n").unwrap();
    let signed = files.options("key", "ground");
    let mut options = vec!["--stand", "--end", "tx", "--of", "1", "--tty", wire.tty(0)];
    options.extend([
        "--capture",
        &file,
        "--measurements",
        level.to_str().unwrap(),
    ]);
    options.extend(signed.iter().map(String::as_str));
    let mut station = Relay::ground(&options);
    station.line("measurement: 1.000e-9 W");
    fill_disk(station.pid(), true);
    let signed = files.options("key", "relay");
    let mut options = vec!["--index", "1", "--of", "1", "--upstream", wire.tty(1)];
    options.extend(signed.iter().map(String::as_str));
    let _relay = Relay::start(&options);
    for power in ["2e-9\n", "3e-9\n", "4e-9\n"] {
        std::thread::sleep(Duration::from_millis(1_200));
        std::fs::write(&level, power).unwrap();
    }
    station.line("capture ended: --capture cannot be written: File too large");
    if !station.has_said("back: relay 1") {
        station.line("back: relay 1 is received");
    }
    assert!(station.lines_with("capture ended").is_empty(), "once");
    station.signal(Signal::TERM);
    assert_eq!(station.end().status, Some(0));
}

/// Checks that a restart after a crash does not overwrite the earlier capture.
#[test]
fn a_restart_keeps_the_capture_of_the_start_before() {
    let folder = tempfile::tempdir().unwrap();
    let name = |name: &str| folder.path().join(name);
    let first = name("relay1.pcapng");
    let mut chain = Chain::of_wires(2, QUIET);
    let mut second = chain.relay(2);
    chain.options = ["--capture", first.to_str().unwrap()]
        .map(str::to_owned)
        .to_vec();
    let mut kept = Vec::new();
    for (number, file) in (1..).zip([&first, &name("relay1-2.pcapng"), &name("relay1-3.pcapng")]) {
        let mut relay = chain.relay(1);
        if number > 1 {
            let line = relay.line("capture: written to ");
            let said = format!(
                "written to {}, because {} holds an earlier capture",
                file.display(),
                first.display()
            );
            assert!(line.ends_with(&said), "{line}");
        }
        relay.line("converged: ");
        std::thread::sleep(Duration::from_millis(300));
        // A dropped relay is killed.
        drop(relay);
        assert!(!frames(file).is_empty(), "start {number}");
        kept.push((file.clone(), std::fs::read(file).unwrap()));
        for (file, bytes) in &kept {
            assert!(std::fs::read(file).unwrap() == *bytes, "{}", file.display());
        }
    }
    second.line("converged: ");
    // A refused start leaves no file.
    chain
        .options
        .extend(["--positions", "/dev/null"].map(str::to_owned));
    let ended = chain.relay(1).end();
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}
