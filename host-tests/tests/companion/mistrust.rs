//! Autopilot and relay of which only one signs, or with different keys: the mismatch is reported.

use rustix::process::Signal;

use crate::flying::Flight;
use crate::process::Ended;

/// Keys as a ground station writes them, one with white space around it.
const ONE: &str = "1111111122222222333333334444444455555555666666667777777788888888";
const OTHER: &str = " 1111111122222222333333334444444455555555666666667777777788888889\n";

/// Returns the relay's exit, and true if the drone has accepted a frame.
fn tells(drone: Option<&str>, relay: Option<&str>, line: &str) -> (Ended, bool) {
    let mut flight = Flight::started("arducopter", 380.0, [drone, relay]);
    flight.relay.line(line);
    let believed = !flight.drone.so_far().is_empty();
    flight.relay.signal(Signal::TERM);
    let ended = flight.relay.end();
    assert_eq!(ended.status, Some(0));
    assert!(!format!("{ended:?}").contains("5555"), "{ended:?}");
    (ended, believed)
}

fn has(ended: &Ended, part: &str) -> bool {
    ended.stdout.iter().any(|line| line.contains(part))
}

#[test]
fn an_autopilot_that_signs_to_a_relay_without_a_key_is_told_of() {
    let line = "autopilot: signs its frames and ignores unsigned ones: give --autopilot-key-file";
    let (ended, believed) = tells(Some(ONE), None, line);
    assert!(!believed);
    assert!(has(&ended, "autopilot: found"), "{ended:?}");
}

#[test]
fn an_autopilot_that_does_not_sign_is_told_of_and_not_heard() {
    let line = "autopilot: does not sign its frames, which are ignored";
    let (ended, _) = tells(None, Some(ONE), line);
    assert!(has(&ended, "frames rejected because of their signatures"));
    assert!(!has(&ended, "autopilot: found"), "{ended:?}");
}

#[test]
fn two_keys_are_told_of_and_neither_hears_the_other() {
    let line = "autopilot: signs with another key than that of --autopilot-key-file; its frames are ignored";
    let (ended, believed) = tells(Some(ONE), Some(OTHER), line);
    assert!(!believed);
    assert!(has(&ended, "frames rejected because of their signatures"));
    assert!(!has(&ended, "autopilot: found"), "{ended:?}");
}
