//! Messages between the ground stations at Tx and Rx and a relay.

use host_tests::fixtures::paper;
use uav_relay::{Event, Mission, Port, Wiring};

use super::bench::Bench;
use super::kinds::{FIRST, level, one_of_each};
use super::message::WireMessage;
use super::offer::{mission_id, upload};
use super::signed::{SignedBench, settings};
use super::votes::{ASKS, FLIES, FORMS, FRESH, READY, hello, with_neighbours};

/// Returns relay `own` of eight with a key, which has authenticated a ground station at `port`.
fn with_ground(own: u16, ground: u16, port: Port) -> SignedBench {
    let mission = Mission::try_new(paper(8)).unwrap();
    SignedBench::new(mission, own, settings(wiring(port)), &[(ground, port)])
}

const fn wiring(port: Port) -> Wiring {
    match port {
        Port::Shared => Wiring::Shared,
        _ => Wiring::Pair,
    }
}

#[test]
fn ground_stations_offer_request_and_get_replies() {
    for (own, ground, port) in [
        (1, 0, Port::Upstream),
        (8, 9, Port::Downstream),
        (1, 0, Port::Shared),
        (4, 0, Port::Shared),
        (5, 9, Port::Shared),
        (8, 9, Port::Shared),
    ] {
        let mut met = with_ground(own, ground, port);
        let base = met.base;
        let mut hears = |message: &WireMessage| {
            let mut out = met.receive(0, message);
            out.retain(|(to, _)| *to == ground);
            let told: Vec<WireMessage> = out.into_iter().map(|(_, message)| message).collect();
            (told, met.events(), met.clone())
        };
        // A relay that has not taken part in a pass is fresh, and counts only itself as connected. The leader is not
        // fresh.
        let (flags, behind) = if own == 1 { (0, 8) } else { (FRESH, 1) };
        let (told, ..) = hears(&hello(base, 0, (1, 1), READY));
        assert_eq!(told, [], "it has not asked");
        let first = with_neighbours(0, behind, &hello(base, 0, (base, 0), flags | FLIES));
        let (told, events, _) = hears(&hello(base, 0, (1, 1), ASKS | FORMS));
        assert_eq!((told, events), (vec![first], vec![]), "{own}");
        let newer = upload(1, base);
        let holds = with_neighbours(0, behind, &hello(base, 0, mission_id(&newer), flags));
        for events in [vec![Event::Uploaded], vec![]] {
            let (told, is, after) = hears(&newer);
            assert_eq!((told, is), (vec![holds.clone()], events), "{own}");
            assert_eq!(after.held(), Some(mission_id(&newer)));
            assert_eq!(after.counted(), ["received"]);
            assert!(!after.neighbours().contains(&Some(ground)));
        }
    }
}

#[test]
fn messages_that_the_ground_may_not_send_are_misaddressed() {
    let met = with_ground(1, 0, Port::Upstream);
    let base = met.base;
    for message in one_of_each(FIRST, base) {
        let mut after = met.clone();
        after.receive(0, &message);
        let expected = match message.name() {
            "Hello" | "Offer" | "Level" | "Watch" => "received",
            _ => "misaddressed",
        };
        assert_eq!(after.counted(), [expected], "{message:?}");
        // The relay's settings have no `listen`, so it rejects the reported sample.
        let refused = u32::from(message.is("Level"));
        assert_eq!(after.stats().samples_rejected, refused, "{message:?}");
    }
    for message in [
        upload(1, base ^ 1),
        hello(base ^ 1, 0, (1, 1), ASKS),
        level(base ^ 1),
    ] {
        let mut after = met.clone();
        assert_eq!(after.receive(0, &message), []);
        assert_eq!(after.counted(), ["mission", "received"], "{message:?}");
        assert_eq!(after.held(), None);
    }
}

#[test]
fn only_near_relays_with_a_key_accept_the_ground() {
    // On a shared channel relays accept frames of Tx and Rx from up to eight numbers away.
    for (own, ground, relays, port) in [
        (2_u16, 0, 8, Port::Upstream),
        (7, 9, 8, Port::Downstream),
        (9, 0, 12, Port::Shared),
        (4, 13, 12, Port::Shared),
    ] {
        let near = own.abs_diff(ground).min(4).abs_diff(ground);
        let far = settings(wiring(port));
        let unsigned = uav_relay::Settings {
            auth: None,
            ..settings(Wiring::Shared)
        };
        for (own, settings, port) in [(own, far, port), (near, unsigned, Port::Shared)] {
            let mut bench = Bench::with(paper(relays), own, settings);
            let bytes = super::bench::frame_between(ground, own, &upload(1, bench.mission));
            let now = bench.now;
            bench.handle_bytes(now, port, &bytes);
            assert_eq!(bench.counted(), ["misaddressed"], "{own}");
        }
    }
}
