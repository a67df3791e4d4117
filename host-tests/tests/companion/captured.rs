//! Captures of three processes' ports, as `cargo decode` reads them.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde_json::Value;
use uav_relay_scenario::Scenario;

use crate::binary::decode;
use crate::chain::{Chain, simulated};
use crate::medium::QUIET;
use crate::process::Relay;
use crate::stays::fill_disk;

/// Frame in a capture: its sender, destination and counter.
type FrameId = (u64, u64, u64);

/// Returns the frames in a capture file with their directions. The first frame may be partial.
fn frames(file: &Path) -> Vec<(String, FrameId)> {
    let output = Command::new(decode())
        .arg("--json")
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
    let mut chain = Chain::on_wires(3, QUIET);
    let file = |chain: &Chain, index: usize| chain.files.text(&format!("relay{index}.pcapng"));
    for index in 1..=3 {
        let relay = chain.relay(index, &format!("--capture {}", file(&chain, index)));
        chain.relays.push(relay);
    }
    assert_eq!(chain.settled(), simulated(&Scenario::default(), 3));
    // All frames in transit have arrived by then, and no new ones are sent for seconds.
    std::thread::sleep(Duration::from_millis(500));
    chain
        .relays
        .drain(..)
        .for_each(|relay| drop(relay.stopped()));
    let all = [1, 2, 3].map(|index| frames(Path::new(&file(&chain, index))));
    let went = |at: usize, way: &str, from: u64, to: u64| -> BTreeSet<FrameId> {
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
    let line = Chain::on_wires(2, QUIET)
        .relay(1, "--capture /dev/full")
        .refused(1);
    assert!(line.contains("--capture /dev/full: "), "{line}");
}

/// Checks that a full disk ends a relay's capture but not its flight.
///
/// The relay has two ports, and reports the failure only once for both ports.
#[test]
fn a_disk_that_fills_up_ends_the_capture_and_not_the_flight() {
    let mut chain = Chain::on_wires(3, QUIET).with("--probe-after-ms 300 --dead-after-ms 900");
    let file = chain.files.text("relay.pcapng");
    for (index, own) in [(1, ""), (2, &*format!("--capture {file}")), (3, "")] {
        let relay = chain.relay(index, own);
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
        assert!(!relay.has_printed("lost: ") && !relay.has_printed("lease expired: "));
    }
    // A capture does not resume when space is available again.
    fill_disk(chain.relays[1].pid(), false);
    std::thread::sleep(Duration::from_secs(1));
    assert!(std::fs::metadata(&file).unwrap().len() <= full + 64);
    chain
        .relays
        .drain(..)
        .for_each(|relay| drop(relay.stopped()));
}

/// Checks that a full disk ends a ground station's capture, but not its service to the relays.
#[test]
fn a_disk_that_fills_up_ends_the_capture_and_not_the_station() {
    let chain = Chain::with_ground(1, QUIET);
    let files = &chain.files;
    let (file, level) = (files.text("ground.pcapng"), files.write("level", "1e-9\n"));
    let (tty, signed) = (
        chain.tx.as_ref().unwrap().tty(0),
        files.signed("key", "ground"),
    );
    let stand = format!("--stand --end tx --of 1 --tty {tty} --measurements {level}");
    let mut station = Relay::ground(&format!("{stand} --capture {file} {signed}"));
    station.line("measurement: measured interference 1.000e-9 W");
    fill_disk(station.pid(), true);
    let _relay = chain.relay(1, &files.signed("key", "relay"));
    for power in ["2e-9\n", "3e-9\n", "4e-9\n"] {
        std::thread::sleep(Duration::from_millis(1_200));
        std::fs::write(&level, power).unwrap();
    }
    station.line("capture ended: --capture cannot be written: File too large");
    station.wait_for("back: relay 1");
    assert!(station.lines_with("capture ended").is_empty(), "once");
    station.stopped();
}

/// Checks that a restart after a crash does not overwrite the earlier capture.
#[test]
fn a_restart_keeps_the_capture_of_the_start_before() {
    let chain = Chain::on_wires(2, QUIET);
    let mut second = chain.relay(2, "");
    let first = chain.files.path("captured/relay1.pcapng");
    let folder = first.parent().unwrap();
    std::fs::create_dir(folder).unwrap();
    let capture = format!("--capture {}", first.display());
    let mut kept = Vec::new();
    let others = ["relay1-2.pcapng", "relay1-3.pcapng"].map(|name| folder.join(name));
    for (number, file) in (1..).zip([&first, &others[0], &others[1]]) {
        let mut relay = chain.relay(1, &capture);
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
    let refused = chain.relay(1, &format!("{capture} --positions /dev/null"));
    assert_eq!(refused.end().status, Some(1));
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), 3);
}
