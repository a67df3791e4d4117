//! Uploads, message by message, as the document has them: who is offered what, what a proposal of another mission leads to, and
//! what is left after a reboot. `ground` has what Tx and Rx say.

use host_tests::fixtures::paper;
use uav_relay::wire::digest::digest;
use uav_relay::wire::upload::UploadError;
use uav_relay::{
    Duration, Event, Instant, Interference, LineError, Mission, MissionConfig, Port, Relay,
    Settings, Upload, ViewId, Wiring,
};

use super::codec::{Greeting, Said};
use super::forming::{
    ASKS, FLIES, FORMS, FRESH, events, granted, hearing, id, long, mark, proposed,
};
use super::kinds::{FIRST, framed, one_of_each, sent};
use super::offer::{KEPT, Offer, offer};
use super::receive::{FIELD, counted, relay};
use super::signed::{Peer, said, set, with_key};

pub(crate) const NOW: Instant = Instant::ZERO;

const REFUSED: Event = Event::UploadRefused {
    why: LineError::Distance,
};

/// Relay 4 of eight, which has nothing to say, the nodes beside it, and the digest of its mission.
pub(crate) fn relay_4() -> (Relay, [Peer; 2], u16) {
    let mut relay = with_key(4, Wiring::Pair);
    let peers = [(3, Port::Upstream), (5, Port::Downstream)]
        .map(|(node, port)| Peer::meets(&mut relay, 4, node, port));
    said(&mut relay, NOW);
    events(&mut relay);
    let base = digest(relay.mission());
    (relay, peers, base)
}

/// The mission of this version for the relays that were loaded with `base`.
pub(crate) fn upload(version: u16, base: u16) -> Offer {
    Offer {
        version,
        base,
        ..offer()
    }
}

/// A hello of a node that has heard of view 0 alone, and holds the mission of these: digest and version.
pub(crate) fn hello(mission: u16, neighbour: u16, holds: (u16, u16), flags: u8) -> Said {
    Said::Hello(greeting(mission, neighbour, holds, flags))
}

fn greeting(mission: u16, neighbour: u16, holds: (u16, u16), flags: u8) -> Greeting {
    Greeting {
        mission,
        neighbour,
        behind: 1,
        newest: 0,
        holds,
        nonce: 0,
        hears: 0,
        flags,
    }
}

pub(crate) fn mission_id(offer: &Offer) -> (u16, u16) {
    (offer.digest(), offer.version)
}

/// What it says now, and what a millisecond later.
fn both(relay: &mut Relay) -> [Vec<(u16, Said)>; 2] {
    let now = said(relay, NOW);
    let later = NOW + Duration::from_millis(1);
    relay.handle_timeout(later);
    [now, said(relay, later)]
}

pub(crate) fn held(relay: &Relay) -> Option<(u16, u16)> {
    let mission_id = relay.upload().map(Upload::id)?;
    Some((mission_id.digest, mission_id.version))
}

#[test]
fn an_offer_at_a_node_without_a_key_is_counted_and_nothing_else() {
    for port in [Port::Upstream, Port::Downstream] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let base = digest(relay.mission());
        let offer = Said::Offer(upload(2, base));
        relay.handle_bytes(NOW, port, &framed(4, port, &offer));
        assert_eq!(counted(relay.stats()), ["received", "unsigned"]);
        assert_eq!((sent(&mut relay, NOW), held(&relay)), (vec![], None));
        // Nor is it told by a hello.
        let newer = hello(base, 4, (1, 1), 0);
        relay.handle_bytes(NOW, port, &framed(4, port, &newer));
        assert_eq!(sent(&mut relay, NOW), []);
        assert_eq!(events(&mut relay), []);
    }
}

#[test]
fn a_newer_mission_is_held_told_and_offered_on_and_a_view_called_for() {
    for side in [0, 1] {
        let (mut relay, mut peers, base) = relay_4();
        let newer = upload(2, base);
        let from = [3, 5][side];
        peers[side].says(&mut relay, NOW, &Said::Offer(newer));
        assert_eq!(held(&relay), Some(mission_id(&newer)));
        assert_eq!(events(&mut relay), [Event::Uploaded]);
        assert_eq!(relay.version(), 0, "not flown before it is counted");
        let form = if side == 0 { FORMS } else { 0 };
        // No message has come from the other side yet.
        let answer = hello(base, from, mission_id(&newer), FRESH | form);
        let answer = long(1, hearing(1, answer));
        // The other one has said no hello that an offer could answer: it is asked for one.
        let other = [5, 3][side];
        let form = if side == 1 { FORMS } else { 0 };
        let asks = hello(base, other, mission_id(&newer), ASKS | FRESH | form);
        let now = vec![(from, answer), (other, long(1, asks))];
        let call = hello(base, 3, mission_id(&newer), ASKS | FORMS | FRESH);
        let call = long(1, hearing([1, 0][side], call));
        assert_eq!(both(&mut relay), [now, vec![(3, call)]]);
        // It has not said that it holds it.
        let older = hello(base, 4, (base, 0), 0);
        peers[1 - side].says(&mut relay, NOW, &older);
        assert_eq!(said(&mut relay, NOW), [(other, Said::Offer(newer))]);
        assert_eq!(relay.stats().rejected(), 0);
    }
}

#[test]
fn an_offer_that_is_not_newer_is_answered_by_a_hello() {
    let (mut relay, mut peers, base) = relay_4();
    let newer = upload(2, base);
    peers[1].says(&mut relay, NOW, &Said::Offer(newer));
    both(&mut relay);
    events(&mut relay);
    // As large a version, and the smaller digest.
    let rival = (1..u8::MAX)
        .map(|y| Offer {
            y_m: f32::from(y),
            ..newer
        })
        .find(|rival| rival.digest() < newer.digest())
        .unwrap();
    let fewer = Offer {
        relays: 7,
        ..upload(3, base)
    };
    // What cannot be held is not answered: it would only be offered again.
    let answer = long(1, hello(base, 5, mission_id(&newer), FRESH));
    let answer = || vec![(5, hearing(1, answer.clone()))];
    for (other, answer) in [
        (newer, answer()),
        (rival, answer()),
        (upload(1, base), answer()),
        (fewer, vec![]),
    ] {
        let mut after = relay.clone();
        peers[1].clone().says(&mut after, NOW, &Said::Offer(other));
        assert_eq!(said(&mut after, NOW), answer, "{other:?}");
        assert_eq!(held(&after), Some(mission_id(&newer)));
        assert_eq!(events(&mut after), []);
        assert_eq!(after.stats().rejected(), 0);
    }
    let stranger = Said::Offer(upload(9, base ^ 1));
    peers[1].says(&mut relay, NOW, &stranger);
    assert_eq!(counted(relay.stats()), ["mission", "received"]);
    assert_eq!(said(&mut relay, NOW), []);
    assert_eq!(held(&relay), Some(mission_id(&newer)));
}

/// There would be no line on earth for it.
#[test]
fn a_relay_with_sites_refuses_another_distance_and_tells_once() {
    let mission = Mission::try_new(paper(8)).unwrap();
    let (identity, settings) = set(4, Wiring::Pair);
    let sited = Settings {
        sited: true,
        ..settings
    };
    let base = digest(&mission);
    let longer = Offer {
        distance_m: mission.config().distance_m.next_up(),
        ..upload(2, base)
    };
    let mut relay = Relay::new(mission, identity, sited, 1, NOW).unwrap();
    let mut peer = Peer::meets(&mut relay, 4, 5, Port::Downstream);
    said(&mut relay, NOW);
    events(&mut relay);
    for (times, told) in [(1, vec![REFUSED]), (2, vec![])] {
        peer.says(&mut relay, NOW, &Said::Offer(longer));
        assert_eq!((events(&mut relay), relay.stats().mission), (told, times));
        assert_eq!((said(&mut relay, NOW), held(&relay)), (vec![], None));
    }
    let next = Offer {
        version: 3,
        ..longer
    };
    peer.says(&mut relay, NOW, &Said::Offer(next));
    assert_eq!(events(&mut relay), [REFUSED]);
    // By hand, and after a reboot.
    let by_hand = Upload::new(
        &mission,
        4,
        MissionConfig {
            distance_m: longer.distance_m,
            ..*mission.config()
        },
    );
    let by_hand = by_hand.unwrap();
    let refused = Err(UploadError::Line(LineError::Distance));
    assert_eq!(relay.handle_upload(NOW, &by_hand), refused);
    let mut begins = Relay::new(mission, identity, sited, 1, NOW).unwrap();
    assert_eq!(begins.resume(&by_hand), refused);
    let mut without = Relay::new(mission, identity, settings, 1, NOW).unwrap();
    assert_eq!(without.resume(&by_hand), Ok(()));
    // One that keeps the distance is held, and from then on an older one is not looked at.
    peer.says(&mut relay, NOW, &Said::Offer(upload(5, base)));
    assert_eq!(events(&mut relay), [Event::Uploaded]);
    peer.says(&mut relay, NOW, &Said::Offer(longer));
    assert_eq!((events(&mut relay), relay.stats().mission), (vec![], 3));
}

#[test]
fn of_two_missions_with_one_version_the_larger_digest_is_the_newer() {
    let (mut relay, mut peers, base) = relay_4();
    let mut offers: Vec<Offer> = (0..6_u8)
        .map(|y| Offer {
            y_m: f32::from(y),
            ..upload(2, base)
        })
        .collect();
    for offer in &offers {
        peers[0].says(&mut relay, NOW, &Said::Offer(*offer));
    }
    offers.sort_by_key(Offer::digest);
    assert_eq!(held(&relay), Some(mission_id(&offers[5])));
    let next = upload(3, base);
    peers[0].says(&mut relay, NOW, &Said::Offer(next));
    assert_eq!(held(&relay), Some(mission_id(&next)), "whatever its digest");
}

#[test]
fn a_hello_of_an_older_mission_is_answered_by_an_offer_and_of_a_newer_one_by_a_hello() {
    let (mut relay, mut peers, base) = relay_4();
    let own = upload(2, base);
    peers[0].says(&mut relay, NOW, &Said::Offer(own));
    both(&mut relay);
    let (digest, version) = mission_id(&own);
    let answer = long(1, hearing(1, hello(base, 5, mission_id(&own), FRESH)));
    for (holds, expected) in [
        ((base, 0), Some(Said::Offer(own))),
        ((digest - 1, version), Some(Said::Offer(own))),
        ((u16::MAX, version - 1), Some(Said::Offer(own))),
        ((digest, version), None),
        ((digest + 1, version), Some(answer.clone())),
        ((0, version + 1), Some(answer)),
    ] {
        let mut after = relay.clone();
        let hello = hello(base, 4, holds, 0);
        peers[1].clone().says(&mut after, NOW, &hello);
        let expected: Vec<_> = expected.map(|said| (5, said)).into_iter().collect();
        assert_eq!(said(&mut after, NOW), expected, "{holds:?}");
    }
    // What was loaded cannot be offered: whoever holds less than that was loaded with another mission.
    let (mut relay, mut peers, base) = relay_4();
    peers[1].says(
        &mut relay,
        NOW,
        &hello(base, 4, (base.wrapping_sub(1), 0), 0),
    );
    assert_eq!(said(&mut relay, NOW), []);
}

/// A proposal to relay 4, or a decision.
fn forming(tag: u8, number: u32, of: (u16, u16), place: u16) -> Said {
    match tag {
        11 => Said::Proposal(proposed(id(number, 1), of, place, 8)),
        _ => granted(id(number, 1), of, place, 8),
    }
}

#[test]
fn a_proposal_of_another_mission_than_the_one_held_leads_to_a_hello() {
    let (mut relay, mut peers, base) = relay_4();
    let newer = mission_id(&upload(2, base));
    let before = *relay.stats();
    for proposal in [newer, (base, 2), (base.wrapping_add(1), 0)] {
        let mut after = relay.clone();
        let mut peer = peers[0].clone();
        peer.says(&mut after, NOW, &forming(11, 1, proposal, 3));
        let (was, is) = (before, after.stats());
        let raised = (is.view - was.view, is.mission - was.mission);
        assert_eq!(raised, (1, 0), "{proposal:?}");
        let answer = long(1, hello(base, 3, (base, 0), ASKS | FRESH | FLIES));
        assert_eq!(said(&mut after, NOW), [(3, hearing(1, answer))]);
        assert_eq!(after.stats().received, before.received + 1);
    }
    peers[0].says(&mut relay, NOW, &forming(11, 1, (base, 0), 3));
    let on = (5, forming(11, 1, (base, 0), 4));
    assert_eq!(said(&mut relay, NOW), [on], "its own");
}

#[test]
fn the_node_after_is_offered_the_mission_before_the_proposal() {
    let (mut relay, mut peers, base) = relay_4();
    let newer = upload(2, base);
    peers[0].says(&mut relay, NOW, &Said::Offer(newer));
    both(&mut relay);
    let proposal = |place| forming(11, 1, mission_id(&newer), place);
    peers[0].says(&mut relay, NOW, &proposal(3));
    // It has said no hello that an offer could answer: it is asked for one. The relay is fresh no more, since it takes part in a proposal.
    let asks = Greeting {
        newest: id(1, 1),
        behind: 4,
        ..greeting(base, 5, mission_id(&newer), ASKS)
    };
    assert_eq!(said(&mut relay, NOW), [(5, Said::Hello(asks))]);
    peers[1].says(&mut relay, NOW, &hello(base, 4, (base, 0), 0));
    assert_eq!(said(&mut relay, NOW), [(5, Said::Offer(newer))]);
    // It is not repeated at once: a hello shows whether it has arrived.
    peers[1].says(&mut relay, NOW, &hello(base, 4, mission_id(&newer), 0));
    assert_eq!(said(&mut relay, NOW), [(5, proposal(4))]);
}

/// A relay that flies version 2 in view 1 of all eight, which its neighbours have handed it.
fn adopted() -> (Relay, [Peer; 2], u16, Offer) {
    let (mut relay, mut peers, base) = relay_4();
    let newer = upload(2, base);
    adopts(&mut relay, &mut peers, &newer);
    (relay, peers, base, newer)
}

/// Relay 4 takes `newer`, and flies it in view 1 of all eight.
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
    assert_eq!(told, [Event::Reformed, Event::Uploaded, Event::Adopted]);
    assert_eq!(relay.stats().rejected(), 0);
    let mark = mark(relay.view().bits());
    let own = newer.digest().wrapping_add(mark);
    // From a pass of the same view, of another view of that mission, of the mission before, of no view of either.
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
    // Signs of life are of the base for good.
    for (mission, expected) in [(base, 0), (newer.digest(), 1), (own, 1)] {
        let mut after = relay.clone();
        let beat = Said::Heartbeat {
            mission,
            ask: 0,
            answer: 0,
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
            // It still holds a newer one than it flies.
            let [_, later] = both(&mut after);
            let call = Greeting {
                mission: base,
                neighbour: 3,
                behind: 5,
                newest: id(2, 1),
                holds: (next.digest(), 3),
                nonce: 0,
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
    // By chance the base has the same digest.
    let number = peer.clone().number(relay.clone(), NOW);
    let offer = Offer {
        answer: number,
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

/// Every hello bears a number, another one `dead_after` after the first with the one before. An offer counts while its number is one of
/// the last two, and was said not more than twice `dead_after` ago; and a relay's own offer bears the number that it was told.
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
    // Of the second number the relay has said no hello yet.
    for (answer, ms, counts) in [
        (first, 0, true),
        (first, 30_000, true),
        (first, 30_001, false),
        (0, 0, false),
        (next, 0, false),
        (first ^ 0x4000, 0, false),
    ] {
        let mut after_it = relay.clone();
        let offer = Said::Offer(Offer { answer, ..newer });
        peers[0]
            .clone()
            .says_as_it_is(&mut after_it, after(ms), &offer);
        let expected = counts.then_some(mission_id(&newer));
        assert_eq!(held(&after_it), expected, "{answer} at {ms}");
        assert_eq!(after_it.stats().stale, u32::from(!counts));
        // It is told by a hello in either case, whose number the next offer bears.
        let hellos = said(&mut after_it, after(ms));
        let told = |(to, said): &(u16, Said)| *to == 3 && matches!(said, Said::Hello(_));
        assert!(hellos.iter().any(told), "{answer} at {ms}: {hellos:?}");
    }
    // A hello with the next number has been said, and another one with the one after that.
    let mut later = relay.clone();
    let mut peer = peers[0].clone();
    for (ms, first_counts) in [(15_000, true), (30_000, false)] {
        let asks = hello(base, 4, (base, 0), ASKS);
        peer.says_as_it_is(&mut later, after(ms), &asks);
        said(&mut later, after(ms));
        let mut after_it = later.clone();
        let offer = Said::Offer(Offer {
            answer: first,
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
    let asks = Said::Hello(Greeting { nonce, ..greeting });
    peers[1].clone().says(&mut told, NOW, &asks);
    let answers = Offer {
        answer: nonce,
        ..newer
    };
    assert_eq!(said(&mut told, NOW), [(5, Said::Offer(answers))]);
}
