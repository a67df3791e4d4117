//! Adoption of an uploaded mission by a view, and its use after a reboot.

use host_tests::fixtures::paper;
use uav_relay::wire::digest::digest;
use uav_relay::{
    Duration, Event, Interference, Mission, MissionConfig, Port, Relay, Upload, ViewId, Wiring,
};

use super::codec::{Greeting, Said};
use super::kinds::{FIRST, one_of_each};
use super::offer::{KEPT, Offer};
use super::receive::{FIELD, counted};
use super::signed::{Peer, said, set};
use super::votes::{ASKS, FLIES, FORMS, FRESH, events, hearing, id, long, mark};

use super::uploads::*;

/// Returns a relay that received version 2 from its neighbours and flies it in view 1 of all eight.
fn adopted() -> (Relay, [Peer; 2], u16, Offer) {
    let (mut relay, mut peers, base) = relay_4();
    let newer = upload(2, base);
    adopts(&mut relay, &mut peers, &newer);
    (relay, peers, base, newer)
}

/// Makes relay 4 accept `newer` and fly it in view 1 of all eight.
pub(crate) fn adopts(relay: &mut Relay, peers: &mut [Peer; 2], newer: &Offer) {
    let base = newer.base;
    peers[0].says(relay, NOW, &Said::Offer(*newer));
    peers[1].says(relay, NOW, &hello(base, 4, mission_id(newer), 0));
    both(relay);
    peers[0].says(relay, NOW, &forming(11, 1, mission_id(newer), 3));
    assert_eq!(
        said(relay, NOW),
        [(5, forming(11, 1, mission_id(newer), 4))]
    );
    assert_eq!((relay.version(), relay.view()), (0, ViewId::LOADED));
    peers[1].says(relay, NOW, &forming(12, 1, mission_id(newer), 5));
    assert_eq!(
        said(relay, NOW),
        [(3, forming(12, 1, mission_id(newer), 4))]
    );
}

#[test]
fn a_view_that_is_granted_flies_the_mission_of_its_proposal() {
    let (mut relay, peers, base, newer) = adopted();
    assert_eq!((relay.version(), relay.view().number()), (2, 1));
    assert_eq!(digest(relay.mission()), newer.digest());
    let told = events(&mut relay);
    assert_eq!(told, [Event::ViewAccepted, Event::Uploaded, Event::Adopted]);
    assert_eq!(relay.stats().rejected(), 0);
    let mark = mark(relay.view().bits());
    let own = newer.digest().wrapping_add(mark);
    // Digests of a pass: of the same view, of another view of that mission, of the earlier mission, of neither.
    for (digest, expected) in [
        (own, [0, 0]),
        (own.wrapping_add(5), [1, 0]),
        (base.wrapping_add(mark), [1, 0]),
        (base ^ 0x4000, [1, 0]),
    ] {
        let mut after = relay.clone();
        let sweep = &one_of_each(FIRST, digest)[0];
        peers[0].clone().says(&mut after, NOW, sweep);
        let stats = after.stats();
        assert_eq!([stats.view, stats.mission], expected, "{digest:04x}");
        let greeted = said(&mut after, NOW).iter().any(|(to, said)| {
            *to == 3 && matches!(said, Said::Hello(hello) if hello.flags & FLIES != 0)
        });
        assert_eq!(greeted, expected != [0, 0], "{digest:04x}");
    }
    // Heartbeats always carry the base's digest.
    for (mission, expected) in [(base, 0), (newer.digest(), 1), (own, 1)] {
        let mut after = relay.clone();
        let beat = Said::Heartbeat {
            mission,
            request: 0,
            reply: 0,
        };
        peers[0].clone().says(&mut after, NOW, &beat);
        assert_eq!(after.stats().mission, expected);
    }
}

#[test]
fn a_count_of_the_mission_flown_is_taken_though_a_newer_one_is_held_and_of_an_older_one_is_not() {
    let (mut relay, mut peers, base, flown) = adopted();
    events(&mut relay);
    peers[0].says(&mut relay, NOW, &forming(11, 2, mission_id(&flown), 3));
    said(&mut relay, NOW);
    let next = upload(3, base);
    peers[0].says(&mut relay, NOW, &Said::Offer(next));
    both(&mut relay);
    for (of, view) in [
        ((base, 0), 1),
        (mission_id(&next), 1),
        (mission_id(&flown), 2),
    ] {
        let mut after = relay.clone();
        peers[1]
            .clone()
            .says(&mut after, NOW, &forming(12, 2, of, 5));
        assert_eq!(
            (after.version(), after.view().number()),
            (2, view),
            "{of:?}"
        );
        if view == 2 {
            // The relay still holds a newer mission than it flies.
            let [_, later] = both_at(&mut after, NOW + Duration::from_millis(1));
            let call = Greeting {
                mission: base,
                neighbour: 3,
                behind: 5,
                latest_view: id(2, 1),
                latest_mission: (next.digest(), 3),
                offer_number: 0,
                hears: 1,
                flags: ASKS | FORMS,
            };
            assert_eq!(later, [(3, Said::Hello(call))]);
        }
    }
}

#[test]
fn in_a_field_nothing_is_held() {
    let mission = MissionConfig {
        interference: Interference::Field(FIELD),
        ..paper(8)
    };
    let mission = Mission::try_new(mission).unwrap();
    let (identity, settings) = set(4, Wiring::Pair);
    let mut relay = Relay::new(mission, identity, settings, 1, NOW).unwrap();
    let mut peer = Peer::meets(&mut relay, 4, 3, Port::Upstream);
    said(&mut relay, NOW);
    // The mission and the base happen to have the same digest.
    let number = peer.clone().number(relay.clone(), NOW);
    let offer = Offer {
        offer_number: number,
        ..upload(1, digest(&mission))
    };
    peer.says_as_it_is(&mut relay, NOW, &Said::Offer(offer));
    assert_eq!(
        (held(&relay), counted(relay.stats())),
        (None, vec!["received"])
    );
}

#[test]
fn what_was_kept_is_held_and_flown_after_a_reboot_and_else_what_was_loaded() {
    let (relay, _, base, newer) = adopted();
    let mut kept = [0; KEPT];
    relay.upload().unwrap().encode(&mut kept).unwrap();
    assert_eq!(kept[..], newer.kept());
    let upload = Upload::decode(&kept).unwrap();
    let loaded = Mission::try_new(paper(8)).unwrap();
    for remembers in [false, true] {
        let (identity, settings) = set(4, Wiring::Pair);
        let mut relay = Relay::new(loaded, identity, settings, 1, NOW).unwrap();
        if remembers {
            relay.resume(&upload).unwrap();
        }
        let mut peer = Peer::meets(&mut relay, 4, 3, Port::Upstream);
        said(&mut relay, NOW);
        peer.says(&mut relay, NOW, &hello(base, 4, mission_id(&newer), ASKS));
        let holds = if remembers {
            mission_id(&newer)
        } else {
            (base, 0)
        };
        let answer = long(1, hearing(1, hello(base, 3, holds, FRESH | FLIES)));
        assert_eq!(said(&mut relay, NOW), [(3, answer)]);
        assert_eq!((relay.version(), relay.view()), (holds.1, ViewId::LOADED));
        let sweep = &one_of_each(FIRST, newer.digest())[0];
        peer.says(&mut relay, NOW, sweep);
        assert_eq!(relay.stats().view, u32::from(!remembers));
    }
}

/// Checks the numbers that link offers to hellos.
///
/// A number changes `dead_after` after its first use. An offer must have one of the last two, sent at most twice `dead_after`
/// ago; a relay's offer repeats the number that it received.
#[test]
fn an_offer_that_does_not_answer_a_hello_of_late_is_stale() {
    let (relay, peers, base) = relay_4();
    let newer = upload(2, base);
    let after = |ms| NOW + Duration::from_millis(ms);
    let number = |relay: &Relay, ms| peers[0].clone().number(relay.clone(), after(ms));
    let first = number(&relay, 0);
    assert_ne!(first, 0);
    assert_eq!(number(&relay, 14_999), first);
    let next = if first == u16::MAX { 1 } else { first + 1 };
    assert_eq!(number(&relay, 15_000), next);
    // The relay has not sent a hello with the second number yet.
    for (answer, ms, counts) in [
        (first, 0, true),
        (first, 30_000, true),
        (first, 30_001, false),
        (0, 0, false),
        (next, 0, false),
        (first ^ 0x4000, 0, false),
    ] {
        let mut after_it = relay.clone();
        let offer = Said::Offer(Offer {
            offer_number: answer,
            ..newer
        });
        peers[0]
            .clone()
            .says_as_it_is(&mut after_it, after(ms), &offer);
        let expected = counts.then_some(mission_id(&newer));
        assert_eq!(held(&after_it), expected, "{answer} at {ms}");
        assert_eq!(after_it.stats().stale, u32::from(!counts));
        // In either case the neighbour gets a hello, whose number the next offer repeats.
        let hellos = said(&mut after_it, after(ms));
        let told = |(to, said): &(u16, Said)| *to == 3 && matches!(said, Said::Hello(_));
        assert!(hellos.iter().any(told), "{answer} at {ms}: {hellos:?}");
    }
    // A hello with the next number was sent, and another with the one after that.
    let mut later = relay.clone();
    let mut peer = peers[0].clone();
    for (ms, first_counts) in [(15_000, true), (30_000, false)] {
        let asks = hello(base, 4, (base, 0), ASKS);
        peer.says_as_it_is(&mut later, after(ms), &asks);
        said(&mut later, after(ms));
        let mut after_it = later.clone();
        let offer = Said::Offer(Offer {
            offer_number: first,
            ..newer
        });
        peers[1]
            .clone()
            .says_as_it_is(&mut after_it, after(ms), &offer);
        assert_eq!(held(&after_it).is_some(), first_counts, "at {ms}");
    }
    let mut told = relay.clone();
    peers[0].clone().says(&mut told, NOW, &Said::Offer(newer));
    both(&mut told);
    let Said::Hello(greeting) = hello(base, 4, (base, 0), 0) else {
        panic!("a hello");
    };
    let nonce = 0xABCD;
    let asks = Said::Hello(Greeting {
        offer_number: nonce,
        ..greeting
    });
    peers[1].clone().says(&mut told, NOW, &asks);
    let answers = Offer {
        offer_number: nonce,
        ..newer
    };
    assert_eq!(said(&mut told, NOW), [(5, Said::Offer(answers))]);
}
