//! Uploads message by message: offers, proposals of another mission, reboots.

use host_tests::fixtures::paper;
use serde_json::json;
use uav_relay::{Event, LineError, Mission, MissionConfig, Port, Settings, Upload, Wiring};
use uav_relay::{Relay, UploadError};

use super::bench::Bench;
use super::message::WireMessage;
use super::offer::{mission_id, upload};
use super::signed::{NOW, SignedBench, settings};
use super::votes::*;

/// Returns an offer of version 2 with the interferer at `y_m` in place of its usual y.
fn offer_with_y(base: u16, y_m: u8) -> WireMessage {
    upload(2, base).with(json!({ "interferer_y_m": y_m }))
}

#[test]
fn an_offer_to_a_node_without_a_key_is_only_counted() {
    for port in [Port::Upstream, Port::Downstream] {
        let mut bench = Bench::new(4, 8, Wiring::Pair);
        assert_eq!(bench.receive(port, &upload(2, bench.mission)), []);
        assert_eq!(bench.counted(), ["received", "unsigned"]);
        assert_eq!(bench.upload(), None);
        // A hello has no effect either.
        assert_eq!(bench.receive(port, &hello(bench.mission, 4, (1, 1), 0)), []);
        assert_eq!(bench.events(), []);
    }
}

#[test]
fn a_newer_mission_is_stored_offered_and_a_view_requested() {
    for (side, from, other) in [(0, 3, 5), (1, 5, 3)] {
        let mut met = SignedBench::fourth();
        let base = met.base;
        let newer = upload(2, base);
        let of = mission_id(&newer);
        let out = met.receive(side, &newer);
        assert_eq!(met.held(), Some(of));
        assert_eq!(met.events(), [Event::Uploaded]);
        assert_eq!(met.version(), 0, "not flown before it is counted");
        // An offer must answer a hello, and the other neighbour has sent none. So the relay asks it for a hello.
        let forms = |node| if node == 3 { FORMS } else { 0 };
        let answer = with_neighbours(1, 1, &hello(base, from, of, FRESH | forms(from)));
        let asks = hello(base, other, of, ASKS | FRESH | forms(other));
        assert_eq!(out, [(from, answer), (other, asks)]);
        let call = hello(base, 3, of, ASKS | FORMS | FRESH);
        let call = with_neighbours(u8::from(side == 0), 1, &call);
        assert_eq!(met.sent_after(NOW), [(3, call)]);
        // The neighbour does not hold the mission.
        let older = hello(base, 4, (base, 0), 0);
        assert_eq!(met.receive(1 - side, &older), [(other, newer)]);
        assert_eq!(met.stats().rejected(), 0);
    }
}

#[test]
fn an_offer_that_is_not_newer_is_answered_by_a_hello() {
    let mut met = SignedBench::fourth();
    let base = met.base;
    let newer = upload(2, base);
    let of = mission_id(&newer);
    met.receive(1, &newer);
    met.sent_after(NOW);
    met.events();
    // Equal version, smaller digest.
    let mut rivals = (1..u8::MAX).map(|y_m| offer_with_y(base, y_m));
    let rival = rivals.find(|rival| mission_id(rival) < of).unwrap();
    let fewer = upload(3, base).with(json!({ "relays": 7 }));
    // A mission that cannot be held is not answered, because it would be offered again.
    let answer = (5, with_neighbours(1, 1, &hello(base, 5, of, FRESH)));
    for (other, answers) in [
        (newer, true),
        (rival, true),
        (upload(1, base), true),
        (fewer, false),
    ] {
        let mut after = met.clone();
        let expected = Vec::from_iter(answers.then_some(answer.clone()));
        assert_eq!(after.receive(1, &other), expected, "{other:?}");
        assert_eq!(after.held(), Some(of));
        assert_eq!(after.events(), []);
        assert_eq!(after.stats().rejected(), 0);
    }
    assert_eq!(met.receive(1, &upload(9, base ^ 1)), []);
    assert_eq!(met.counted(), ["mission", "received"]);
    assert_eq!(met.held(), Some(of));
}

/// Checks that a relay that knows the positions of Tx and Rx refuses a mission with another distance.
///
/// The surveyed positions fix the distance from Tx to Rx, so that no such mission can be right. The refusal is reported
/// once.
#[test]
fn a_relay_with_sites_refuses_another_distance_once() {
    let refused = Event::UploadRefused {
        why: LineError::Distance,
    };
    let sited = Settings {
        sited: true,
        ..settings(Wiring::Pair)
    };
    let mut met = SignedBench::fourth_with(sited);
    let base = met.base;
    let mission = *met.mission();
    let distance_m = mission.config().distance_m.next_up();
    let longer = upload(2, base).with(json!({ "distance_m": distance_m }));
    for (times, told) in [(1, vec![refused]), (2, vec![])] {
        let refusal = with_neighbours(1, 1, &hello(base, 5, mission_id(&longer), FRESH | REFUSED));
        assert_eq!(met.receive(1, &longer), [(5, refusal)]);
        assert_eq!((met.events(), met.stats().mission), (told, times));
        assert_eq!(met.held(), None);
    }
    met.receive(1, &longer.with(json!({ "version": 3 })));
    assert_eq!(met.events(), [refused]);
    // The mission is refused from the firmware, and after a reboot.
    let config = MissionConfig {
        distance_m,
        ..*mission.config()
    };
    let by_hand = Upload::new(&mission, 4, config).unwrap();
    let refused = Err(UploadError::Line(LineError::Distance));
    assert_eq!(met.handle_upload(NOW, &by_hand), refused);
    let resumed = |settings| fourth(settings).resume(&by_hand);
    assert_eq!(resumed(sited), refused);
    assert_eq!(resumed(settings(Wiring::Pair)), Ok(()));
    // A mission with the same distance is held, and older ones are ignored from then on.
    met.receive(1, &upload(5, base));
    assert_eq!(met.events(), [Event::Uploaded]);
    met.receive(1, &longer);
    assert_eq!((met.events(), met.stats().mission), (vec![], 3));
}

/// Returns relay 4 of eight, which has not authenticated any neighbour yet.
pub(crate) fn fourth(settings: Settings) -> Relay {
    let mission = Mission::try_new(paper(8)).unwrap();
    host_tests::fixtures::relay(mission, 4, settings)
}

#[test]
fn of_missions_with_one_version_the_larger_digest_is_newer() {
    let mut met = SignedBench::fourth();
    let mut offers: Vec<WireMessage> = (0..6).map(|y_m| offer_with_y(met.base, y_m)).collect();
    for offer in &offers {
        met.receive(0, offer);
    }
    offers.sort_by_key(mission_id);
    assert_eq!(met.held(), Some(mission_id(&offers[5])));
    let next = upload(3, met.base);
    met.receive(0, &next);
    assert_eq!(met.held(), Some(mission_id(&next)), "whatever its digest");
}

#[test]
fn a_hello_of_an_older_mission_is_answered_by_an_offer() {
    let mut met = SignedBench::fourth();
    let base = met.base;
    let own = upload(2, base);
    met.receive(0, &own);
    met.sent_after(NOW);
    let (digest, version) = mission_id(&own);
    let answer = with_neighbours(1, 1, &hello(base, 5, (digest, version), FRESH));
    for (holds, expected) in [
        ((base, 0), Some(&own)),
        ((digest - 1, version), Some(&own)),
        ((u16::MAX, version - 1), Some(&own)),
        ((digest, version), None),
        ((digest + 1, version), Some(&answer)),
        ((0, version + 1), Some(&answer)),
    ] {
        let out = met.clone().receive(1, &hello(base, 4, holds, 0));
        let expected = expected.map(|message| (5, message.clone()));
        assert_eq!(out, Vec::from_iter(expected), "{holds:?}");
    }
    // The mission before flight cannot be offered: a node with another digest was configured with another mission.
    let other = hello(base, 4, (base.wrapping_sub(1), 0), 0);
    assert_eq!(SignedBench::fourth().receive(1, &other), []);
}

#[test]
fn a_proposal_of_an_unknown_mission_leads_to_a_hello() {
    let mut met = SignedBench::fourth();
    let base = met.base;
    let newer = mission_id(&upload(2, base));
    let proposal = |of, place| proposed(id(1, 1), of, place, 8);
    for of in [newer, (base, 2), (base.wrapping_add(1), 0)] {
        let mut after = met.clone();
        let answer = with_neighbours(1, 1, &hello(base, 3, (base, 0), ASKS | FRESH | FLIES));
        assert_eq!(after.receive(0, &proposal(of, 3)), [(3, answer)]);
        let (was, is) = (met.stats(), after.stats());
        let raised = [
            is.view - was.view,
            is.mission - was.mission,
            is.received - was.received,
        ];
        assert_eq!(raised, [1, 0, 1], "{of:?}");
    }
    let out = met.receive(0, &proposal((base, 0), 3));
    assert_eq!(out, [(5, proposal((base, 0), 4))], "its own");
}

#[test]
fn the_next_node_is_offered_the_mission_before_the_proposal() {
    let mut met = SignedBench::fourth();
    let base = met.base;
    let newer = upload(2, base);
    let of = mission_id(&newer);
    met.receive(0, &newer);
    met.sent_after(NOW);
    let proposal = |place| proposed(id(1, 1), of, place, 8);
    // An offer must answer a hello, and the neighbour has sent none. So the relay asks it for a hello.
    let asks =
        with_neighbours(0, 4, &hello(base, 5, of, ASKS)).with(json!({ "latest_view": id(1, 1) }));
    assert_eq!(met.receive(0, &proposal(3)), [(5, asks)]);
    assert_eq!(met.receive(1, &hello(base, 4, (base, 0), 0)), [(5, newer)]);
    // The offer is not repeated at once: a hello shows whether it has arrived.
    assert_eq!(met.receive(1, &hello(base, 4, of, 0)), [(5, proposal(4))]);
}
