//! Adoption of an uploaded mission by a view, and its use after a reboot.

use host_tests::fixtures::paper;
use serde_json::json;
use uav_relay::wire::digest::digest;
use uav_relay::{
    Duration, Event, Interference, Mission, MissionConfig, Port, Upload, ViewId, Wiring,
};

use super::kinds::{FIELD, FIRST, beat, one_of_each};
use super::message::WireMessage;
use super::offer::{KEPT, kept, mission_id, upload};
use super::signed::{NOW, SignedBench, settings};
use super::votes::*;

/// Returns relay 4 after it adopted an upload of mission version 2, and this upload.
///
/// Relay 4 adopted the upload in membership view 1 of all eight relays.
fn adopted() -> (SignedBench, WireMessage) {
    let mut met = SignedBench::fourth();
    let newer = upload(2, met.base);
    adopts(&mut met, &newer);
    (met, newer)
}

/// Makes relay 4 receive the upload `newer`, and adopt it in membership view 1 of all eight relays.
pub(crate) fn adopts(met: &mut SignedBench, newer: &WireMessage) {
    let of = mission_id(newer);
    met.receive(0, newer);
    met.receive(1, &hello(met.base, 4, of, 0));
    met.sent_after(NOW);
    let out = met.receive(0, &proposed(id(1, 1), of, 3, 8));
    assert_eq!(out, [(5, proposed(id(1, 1), of, 4, 8))]);
    assert_eq!((met.version(), met.view()), (0, ViewId::LOADED));
    let out = met.receive(1, &granted(id(1, 1), of, 5, 8));
    assert_eq!(out, [(3, granted(id(1, 1), of, 4, 8))]);
}

#[test]
fn a_granted_view_flies_the_mission_of_its_proposal() {
    let (mut met, newer) = adopted();
    let base = met.base;
    let (flown, version) = mission_id(&newer);
    assert_eq!((met.version(), met.view().number()), (version, 1));
    assert_eq!(digest(met.mission()), flown);
    let told = [Event::ViewAccepted, Event::Uploaded, Event::Adopted];
    assert_eq!(met.events(), told);
    assert_eq!(met.stats().rejected(), 0);
    let mark = mark(met.view().bits());
    let own = flown.wrapping_add(mark);
    // Digests of a pass: of the same view, of another view of that mission, of the earlier mission, of neither.
    for (digest, expected) in [
        (own, [0, 0]),
        (own.wrapping_add(5), [1, 0]),
        (base.wrapping_add(mark), [1, 0]),
        (base ^ 0x4000, [1, 0]),
    ] {
        let mut after = met.clone();
        let out = after.receive(0, &one_of_each(FIRST, digest)[0]);
        let stats = after.stats();
        assert_eq!([stats.view, stats.mission], expected, "{digest:04x}");
        let hello = |(to, message): &(u16, WireMessage)| {
            *to == 3 && message.is("Hello") && message.has(FLIES)
        };
        assert_eq!(out.iter().any(hello), expected != [0, 0], "{digest:04x}");
    }
    // Heartbeats always carry the digest of the mission before flight.
    for (mission, expected) in [(base, 0), (flown, 1), (own, 1)] {
        let mut after = met.clone();
        after.receive(0, &beat(mission, 0, 0));
        assert_eq!(after.stats().mission, expected);
    }
}

#[test]
fn only_a_decision_of_the_flown_mission_is_accepted() {
    let (mut met, flown) = adopted();
    met.events();
    met.receive(0, &proposed(id(2, 1), mission_id(&flown), 3, 8));
    let next = upload(3, met.base);
    met.receive(0, &next);
    met.sent_after(NOW);
    for (of, view) in [
        ((met.base, 0), 1),
        (mission_id(&next), 1),
        (mission_id(&flown), 2),
    ] {
        let mut after = met.clone();
        after.receive(1, &granted(id(2, 1), of, 5, 8));
        let flies = (after.version(), after.view().number());
        assert_eq!(flies, (2, view), "{of:?}");
        if view == 2 {
            // The relay still holds a newer mission than it flies.
            let out = after.sent_after(NOW + Duration::from_millis(1));
            let call = with_neighbours(1, 5, &hello(met.base, 3, mission_id(&next), ASKS | FORMS));
            let call = call.with(json!({ "latest_view": id(2, 1) }));
            assert_eq!(out, [(3, call)]);
        }
    }
}

#[test]
fn in_a_field_no_upload_is_stored() {
    let mission = MissionConfig {
        interference: Interference::Field(FIELD),
        ..paper(8)
    };
    let mission = Mission::try_new(mission).unwrap();
    let mut met = SignedBench::new(mission, 4, settings(Wiring::Pair), &[(3, Port::Upstream)]);
    // The mission and the base happen to have the same digest.
    met.receive(0, &upload(1, met.base));
    assert_eq!((met.held(), met.counted()), (None, vec!["received"]));
}

#[test]
fn a_stored_mission_is_flown_after_a_reboot() {
    let (met, newer) = adopted();
    let mut bytes = [0; KEPT];
    met.upload().unwrap().encode(&mut bytes).unwrap();
    assert_eq!(bytes[..], kept(&newer));
    let upload = Upload::decode(&bytes).unwrap();
    for remembers in [false, true] {
        let mut met = SignedBench::fourth();
        if remembers {
            met.resume(&upload).unwrap();
        }
        let asks = hello(met.base, 4, mission_id(&newer), ASKS);
        let holds = if remembers {
            mission_id(&newer)
        } else {
            (met.base, 0)
        };
        let answer = with_neighbours(1, 1, &hello(met.base, 3, holds, FRESH | FLIES));
        assert_eq!(met.receive(0, &asks), [(3, answer)]);
        assert_eq!((met.version(), met.view()), (holds.1, ViewId::LOADED));
        met.receive(0, &one_of_each(FIRST, mission_id(&newer).0)[0]);
        assert_eq!(met.stats().view, u32::from(!remembers));
    }
}

/// Checks which mission offers count as answers to a hello: the others are stale.
///
/// A relay's hello has a number. The relay takes a new number when the time `dead_after` has passed since the first use
/// of the old number. An offer must repeat one of the last two numbers. It is stale if this number was sent more than
/// twice `dead_after` ago.
#[test]
fn an_offer_that_answers_no_recent_hello_is_stale() {
    let met = SignedBench::fourth();
    let newer = upload(2, met.base);
    let after = |ms| NOW + Duration::from_millis(ms);
    let first = met.offer_number(0, NOW);
    assert_ne!(first, 0);
    assert_eq!(met.offer_number(0, after(14_999)), first);
    let next = if first == u16::MAX { 1 } else { first + 1 };
    assert_eq!(met.offer_number(0, after(15_000)), next);
    // The relay has not sent a hello with the second number yet.
    for (answer, ms, counts) in [
        (first, 0, true),
        (first, 30_000, true),
        (first, 30_001, false),
        (0, 0, false),
        (next, 0, false),
        (first ^ 0x4000, 0, false),
    ] {
        let mut met = met.clone();
        let offer = newer.with(json!({ "offer_number": answer }));
        let out = met.receive_unchanged(0, after(ms), &offer);
        let expected = counts.then_some(mission_id(&newer));
        assert_eq!(met.held(), expected, "{answer} at {ms}");
        assert_eq!(met.stats().stale, u32::from(!counts));
        // In either case the neighbour gets a hello, whose number the next offer repeats.
        let told = |(to, message): &(u16, WireMessage)| *to == 3 && message.is("Hello");
        assert!(out.iter().any(told), "{answer} at {ms}: {out:?}");
    }
    // A hello with the next number was sent, and another with the one after that.
    let mut later = met.clone();
    let asks = hello(met.base, 4, (met.base, 0), ASKS);
    for (ms, first_counts) in [(15_000, true), (30_000, false)] {
        later.receive_unchanged(0, after(ms), &asks);
        let mut after_it = later.clone();
        let offer = newer.with(json!({ "offer_number": first }));
        after_it.receive_unchanged(1, after(ms), &offer);
        assert_eq!(after_it.held().is_some(), first_counts, "at {ms}");
    }
    let mut told = met.clone();
    told.receive(0, &newer);
    told.sent_after(NOW);
    let older = hello(met.base, 4, (met.base, 0), 0).with(json!({ "offer_number": 0xABCD }));
    let answers = newer.with(json!({ "offer_number": 0xABCD }));
    assert_eq!(told.receive(1, &older), [(5, answers)]);
}
