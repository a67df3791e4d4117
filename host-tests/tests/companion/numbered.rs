//! Drone numbers, which never change, as opposed to positions in the chain.

use serde_json::Value;

use crate::chain::{Chain, QUICK};
use crate::files::until;
use crate::medium::{Medium, QUIET};

/// Checks that relay 3 keeps its number in logs and status after relay 2 is lost.
///
/// Relay 3 is then the second relay of the chain.
#[test]
fn a_drone_keeps_its_number_when_its_place_changes() {
    let chain = Chain::on_channel(3, Medium::new(3, QUIET)).with(QUICK);
    let socket = chain.files.text("status");
    let mut first = chain.relay(1, "--json");
    let mut second = chain.relay(2, "");
    let mut third = chain.relay(3, &format!("--status-socket {socket}"));
    for relay in [&mut first, &mut second, &mut third] {
        relay.line("converged");
    }
    drop(second);
    third.line("lost: relay 2 upstream (toward Tx) does not reply");
    let line = third.line("view accepted: ");
    let said = " s  relay 3  view accepted: the chain has 2 relays; this relay is at place 2, counted from the transmitter (view ";
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
    for (json, name) in [("", " s  relay 2  "), ("--json", "\"index\":2")] {
        let mut chain =
            Chain::on_channel(3, Medium::new(3, QUIET)).started(&format!("{QUICK} {json}"));
        chain.relays[1].line("converged");
        let lines = chain.relays.swap_remove(1).stopped();
        assert!(lines.len() > 4, "{lines:?}");
        for line in lines {
            assert!(line.contains(name), "{line}");
        }
    }
}
