//! Profile collection at a relay: forwarding, results, and stale messages.

use host_tests::fixtures::paper;
use serde_json::json;
use uav_relay::{Interference, Method, MissionConfig, Port, Profile, Settings, Wiring};

use super::bench::Bench;
use super::kinds::{FIELD, FIRST, SECOND, mission, one_of_each, source};
use super::message::WireMessage;
use super::votes::FORMS;

const UP: Port = Port::Upstream;
const DOWN: Port = Port::Downstream;

/// Checks that a result of a collection of profiles is stale if the relay does not wait for it.
///
/// A profile is a relay's altitude and power. In a field of interference, messages that collect profiles and joint
/// positions are stale, too.
#[test]
fn profiles_that_are_not_awaited_are_stale() {
    let field = Interference::Field(FIELD);
    for (interference, tag) in [(paper(8).interference, 7), (field, 5), (field, 6)] {
        let config = MissionConfig {
            interference,
            ..paper(8)
        };
        let mut bench = Bench::of(config, 4, Wiring::Pair);
        let message = &one_of_each(FIRST, bench.mission)[tag];
        bench.receive(DOWN, message);
        assert_eq!(bench.setpoint(), None);
        assert_eq!(bench.counted(), ["received", "stale"], "{message:?}");
    }
}

/// Returns relay 4 of 8, which uses the joint method. If `differs` is true, it keeps an altitude of its own, 33 m.
fn fourth(differs: bool) -> Bench {
    let common = source().common;
    let settings = Settings {
        method: Method::Joint,
        hold_altitude: differs,
        profile: differs.then_some(Profile {
            altitude_m: 33.0,
            ..common
        }),
        ..Settings::default()
    };
    Bench::with(source(), 4, settings)
}

/// Returns the message `name`: a collection of relays' profiles (altitude and power), or its result.
///
/// The message has the profiles of the relays `indices`. The collection has pass number `number`, and begins with the
/// relay after relay `after`.
fn of(bench: &Bench, name: &str, number: u16, after: u16, indices: &[u16]) -> WireMessage {
    let seat = |index: &u16| json!({ "relay": index, "altitude_m": 30.0, "power_w": 0.5 });
    let seats: Vec<_> = indices.iter().map(seat).collect();
    let fields =
        json!({ "number": number, "view_digest": bench.mission, "after": after, "seats": seats });
    WireMessage::new(name, &fields)
}

/// Returns a copy of a message that collects relays' profiles, or of its result, with one more profile. A profile is
/// a relay's altitude and power.
fn with_profile(
    message: &WireMessage,
    name: &str,
    index: u16,
    altitude_m: f32,
    power_w: f32,
) -> WireMessage {
    let mut fields = json!(message.fields());
    let seat = json!({ "relay": index, "altitude_m": altitude_m, "power_w": power_w });
    fields["seats"].as_array_mut().unwrap().push(seat);
    WireMessage::new(name, &fields)
}

#[test]
fn a_collection_is_forwarded_and_its_result_returned() {
    for differs in [false, true] {
        let mut bench = fourth(differs);
        let told = of(&bench, "Gather", FIRST, 0, &[1, 3]);
        let own = if differs {
            with_profile(&told, "Gather", 4, 33.0, 1.0)
        } else {
            told.clone()
        };
        assert_eq!(bench.receive(UP, &told), [(DOWN, own.clone())]);
        // The collection is repeated while its result is pending.
        let busy = one_of_each(FIRST, bench.mission)[2].clone();
        assert_eq!(bench.receive(UP, &told), [(UP, busy)]);
        let all = with_profile(&own, "Gathered", 6, 0.0, 2.0);
        assert_eq!(bench.receive(DOWN, &all), [(UP, all.clone())]);
        assert_eq!(bench.setpoint(), None, "no relay moves");
        // The collection is repeated after its result.
        assert_eq!(bench.receive(UP, &told), [(UP, all)]);
        assert_eq!(bench.counted(), ["received", "repeated"]);
    }
}

/// Checks that a relay forwards a full collection of profiles (altitude and power) unchanged.
///
/// The next collection must begin with the relays that follow the last relay in the full collection.
#[test]
fn a_full_roster_is_continued_by_the_next_pass() {
    let config = MissionConfig {
        band: mission(paper(8).interference).band,
        ..paper(20)
    };
    let settings = Settings {
        hold_altitude: true,
        ..Settings::default()
    };
    let mut bench = Bench::with(config, 10, settings);
    let eight = [1, 2, 3, 4, 5, 6, 7, 8];
    for (name, port, to) in [("Gather", UP, DOWN), ("Gathered", DOWN, UP)] {
        let full = of(&bench, name, FIRST, 0, &eight);
        assert_eq!(bench.receive(port, &full), [(to, full)]);
    }
    // Some relays have not been asked, so a sweep is too early; and a collection behind other relays is stale.
    let aside = one_of_each(SECOND, bench.mission)[5].clone();
    for message in [aside, of(&bench, "Gather", SECOND, 7, &[8])] {
        let mut after = bench.clone();
        assert_eq!(after.receive(UP, &message), []);
        assert_eq!(after.counted(), ["received", "stale"], "{message:?}");
    }
    let next = of(&bench, "Gather", SECOND, 8, &[9]);
    let own = with_profile(&next, "Gather", 10, 20.0, 1.0);
    assert_eq!(bench.receive(UP, &next), [(DOWN, own)]);
}

/// Checks that a relay that has missed the collection of profiles refuses a sweep that needs them.
///
/// A profile is a relay's altitude and power. The relay then requests a new membership view. A relay misses a
/// collection, for example, by a reboot.
#[test]
fn a_pass_of_unknown_profiles_is_stale_and_requests_a_view() {
    let fresh = fourth(false);
    let asked = |message: &WireMessage| message.is("Hello") && message.has(FORMS);
    let first = of(&fresh, "Gather", FIRST, 0, &[2]);
    for (told, message) in [
        (true, of(&fresh, "Gather", FIRST, 0, &[3])),
        (true, one_of_each(SECOND, fresh.mission)[5].clone()),
        (false, of(&fresh, "Gather", FIRST, 2, &[3])),
    ] {
        let mut bench = fresh.clone();
        if told {
            assert_eq!(bench.receive(UP, &first).len(), 1);
        }
        let mut out = bench.receive(UP, &message);
        assert_eq!(bench.counted(), ["received", "stale"], "{message:?}");
        out.extend(bench.advance_1_s());
        assert!(out.iter().any(|(_, message)| asked(message)), "{out:?}");
    }
}

/// Checks that a collection of profiles is stale if it has the receiver's profile or a later relay's.
///
/// A profile is a relay's altitude and power. The relays on the way of the message cannot have added these profiles.
#[test]
fn a_collection_with_its_receivers_profile_is_stale() {
    for index in [4, 5] {
        let mut bench = fourth(false);
        let message = of(&bench, "Gather", FIRST, 0, &[index]);
        assert_eq!(bench.receive(UP, &message), []);
        assert_eq!(bench.counted(), ["received", "stale"]);
    }
}

/// Checks that a relay counts a wrong `Gathered` message as stale and keeps its state.
///
/// `Gathered` carries the result of a collection: the profiles (altitude and power) of the relays. It is wrong if it
/// has another collection number or another start, or arrives a second time. It is also wrong if it lacks profiles, or
/// has the profile of a relay beyond the chain's end.
#[test]
fn a_roster_that_does_not_fit_is_stale_and_changes_nothing() {
    let mut bench = fourth(false);
    let gather = of(&bench, "Gather", FIRST, 0, &[2]);
    assert_eq!(bench.receive(UP, &gather).len(), 1);
    for (number, after, indices) in [
        (SECOND, 0, &[2, 6][..]),
        (FIRST, 1, &[2, 6]),
        (FIRST, 0, &[6]),
        (FIRST, 0, &[]),
        (FIRST, 0, &[2, 9]),
    ] {
        let mut other = bench.clone();
        let roster = of(&bench, "Gathered", number, after, indices);
        assert_eq!(other.receive(DOWN, &roster), []);
        assert_eq!(other.counted(), ["received", "stale"], "{roster:?}");
        assert_eq!(other.phase(), bench.phase());
    }
    let fits = of(&bench, "Gathered", FIRST, 0, &[2, 8]);
    assert_eq!(bench.receive(DOWN, &fits), [(UP, fits.clone())]);
    assert_eq!(bench.receive(DOWN, &fits), []);
    assert_eq!(bench.counted(), ["received", "stale"]);
}
