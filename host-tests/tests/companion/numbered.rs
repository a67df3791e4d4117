//! Drone numbers, which never change, as opposed to positions in the chain.

use serde_json::Value;

use crate::medium::{Medium, QUIET};
use crate::process::Relay;
use crate::stays::until;

fn start(channel: &Medium, index: usize, more: &[&str]) -> Relay {
    let (number, tty) = (index.to_string(), channel.tty(index - 1));
    let options = ["--index", &number, "--of", "3", "--shared", tty];
    let quick = ["--probe-after-ms", "500", "--dead-after-ms", "1500"];
    Relay::start(&[&options[..], &quick, more].concat())
}

/// Checks the loss of relay 2: relay 3 is the second of two then, and keeps its number 3.
#[test]
fn a_drone_keeps_its_number_when_its_place_in_the_chain_changes() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("status");
    let channel = Medium::new(3, QUIET);
    let mut first = start(&channel, 1, &["--json"]);
    let mut second = start(&channel, 2, &[]);
    let more = ["--status-socket", socket.to_str().unwrap()];
    let mut third = start(&channel, 3, &more);
    for relay in [&mut first, &mut second, &mut third] {
        relay.line("converged");
    }
    drop(second);
    third.line("lost: relay 2 upstream does not reply");
    let line = third.line("view accepted: ");
    let said = " s  relay 3  view accepted: 2 relays, this relay at place 2, view ";
    assert!(line.contains(said), "{line}");
    let said = until(&socket, |said| said["relay"]["relays"] == 2);
    assert_eq!(said["relay"]["index"], 3, "{said:#}");
    assert_eq!(said["relay"]["place"], 2, "{said:#}");
    let line = first.line("\"event\":\"view accepted\"");
    let said: Value = serde_json::from_str(&line).unwrap();
    assert_eq!((&said["index"], &said["place"]), (&1.into(), &1.into()));
}

#[test]
fn every_line_names_its_relay() {
    let channel = Medium::new(3, QUIET);
    for (json, name) in [(false, " s  relay 2  "), (true, "\"index\":2")] {
        let relays =
            [1, 2, 3].map(|index| start(&channel, index, &["--json"][..usize::from(json)]));
        let [_first, mut second, _third] = relays;
        second.line("converged");
        second.signal(rustix::process::Signal::TERM);
        let lines = second.end().stdout;
        assert!(lines.len() > 4, "{lines:?}");
        for line in lines {
            assert!(line.contains(name), "{line}");
        }
    }
}
