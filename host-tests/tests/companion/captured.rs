//! What goes over the ports of three processes, as `cargo decode` reads it from their captures.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use rustix::process::Signal;
use serde_json::Value;

use super::medium::QUIET;
use super::process::Relay;
use super::{Chain, simulated};
use uav_relay_scenario::Scenario;

/// A frame: its sender, its destination, its counter.
type Seen = (u64, u64, u64);

/// The frames in a capture, with the way they went. A port that is opened while somebody speaks begins with a part of a frame.
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
    // What was on its way is there by then, and nothing new is said for seconds.
    std::thread::sleep(std::time::Duration::from_millis(500));
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
