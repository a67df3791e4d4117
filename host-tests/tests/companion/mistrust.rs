//! Autopilot and relay of which only one signs, or with different keys: the mismatch is reported.

use crate::flying::Flight;

/// MAVLink signing key of one party, in hexadecimal.
const ONE: &str = "1111111122222222333333334444444455555555666666667777777788888888";
/// MAVLink signing key of the other party, which differs in one digit and has white space around it.
const OTHER: &str = " 1111111122222222333333334444444455555555666666667777777788888889\n";

/// Checks that a relay reports differing MAVLink keys, ignores the drone's frames, and logs no key.
///
/// In some cases only the drone or only the relay has a key.
#[test]
fn different_mavlink_keys_are_reported_and_frames_ignored() {
    let unsigned =
        "signs its frames and ignores unsigned frames: give its key with --autopilot-key-file";
    let other = "signs with another key than that of --autopilot-key-file, so its frames are ignored: give the autopilot and this relay the same key";
    let plain = "does not sign its frames, so they are ignored";
    for (drone, relay, line) in [
        (Some(ONE), None, unsigned),
        (None, Some(ONE), plain),
        (Some(ONE), Some(OTHER), other),
    ] {
        let mut flight = Flight::started("arducopter", [drone, relay], "");
        flight.relay.line(&format!("autopilot: {line}"));
        let is_believed = !flight.drone.so_far().is_empty();
        assert!(!is_believed || drone.is_none(), "{line}");
        let said = flight.relay.stopped().concat();
        assert!(!said.contains("5555"), "{said}");
        let is_refused =
            said.contains("frames from the autopilot were rejected because of their signatures");
        assert!(is_refused || relay.is_none(), "{said}");
        assert_eq!(said.contains("autopilot: found"), relay.is_none(), "{said}");
    }
}
