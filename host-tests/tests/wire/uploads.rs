//! Uploads message by message: offers, proposals of another mission, reboots.

use host_tests::fixtures::paper;
use uav_relay::UploadError;
use uav_relay::wire::digest::digest;
use uav_relay::{
    Duration, Event, Instant, LineError, Mission, MissionConfig, Port, Relay, Settings, Upload,
    Wiring,
};

use super::codec::{Greeting, Said};
use super::kinds::{framed, sent};
use super::offer::{Offer, offer};
use super::receive::{counted, relay};
use super::signed::{Peer, said, set, with_key};
use super::votes::{
    ASKS, FLIES, FORMS, FRESH, REFUSED as REFUSED_FLAG, events, granted, hearing, id, long,
    proposed,
};

pub(crate) const NOW: Instant = Instant::ZERO;

const REFUSED: Event = Event::UploadRefused {
    why: LineError::Distance,
};

/// Returns an idle relay 4 of eight, its neighbours, and the digest of its mission.
pub(crate) fn relay_4() -> (Relay, [Peer; 2], u16) {
    let mut relay = with_key(4, Wiring::Pair);
    let peers = [(3, Port::Upstream), (5, Port::Downstream)]
        .map(|(node, port)| Peer::meets(&mut relay, 4, node, port));
    said(&mut relay, NOW);
    events(&mut relay);
    let base = digest(relay.mission());
    (relay, peers, base)
}

/// Returns a mission of `version` for relays loaded with `base`.
pub(crate) fn upload(version: u16, base: u16) -> Offer {
    Offer {
        version,
        base,
        ..offer()
    }
}

/// Returns the hello of a node that knows only view 0 and holds the mission `holds` (digest, version).
pub(crate) fn hello(mission: u16, neighbour: u16, holds: (u16, u16), flags: u8) -> Said {
    Said::Hello(greeting(mission, neighbour, holds, flags))
}

pub(crate) fn greeting(mission: u16, neighbour: u16, holds: (u16, u16), flags: u8) -> Greeting {
    Greeting {
        mission,
        neighbour,
        behind: 1,
        latest_view: 0,
        latest_mission: holds,
        offer_number: 0,
        hears: 0,
        flags,
    }
}

pub(crate) fn mission_id(offer: &Offer) -> (u16, u16) {
    (offer.digest(), offer.version)
}

/// Returns the messages sent now and a millisecond later.
pub(crate) fn both(relay: &mut Relay) -> [Vec<(u16, Said)>; 2] {
    both_at(relay, NOW)
}

/// Returns the messages sent at `now` and a millisecond later.
pub(crate) fn both_at(relay: &mut Relay, now: Instant) -> [Vec<(u16, Said)>; 2] {
    let first = said(relay, now);
    let later = now + Duration::from_millis(1);
    relay.handle_timeout(later);
    [first, said(relay, later)]
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
        // A hello has no effect either.
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
        // There was no message from the other side yet.
        let answer = hello(base, from, mission_id(&newer), FRESH | form);
        let answer = long(1, hearing(1, answer));
        // The other neighbour has sent no hello that an offer could answer, so it is asked for one.
        let other = [5, 3][side];
        let form = if side == 1 { FORMS } else { 0 };
        let asks = hello(base, other, mission_id(&newer), ASKS | FRESH | form);
        let now = vec![(from, answer), (other, long(1, asks))];
        let call = hello(base, 3, mission_id(&newer), ASKS | FORMS | FRESH);
        let call = long(1, hearing([1, 0][side], call));
        assert_eq!(both(&mut relay), [now, vec![(3, call)]]);
        // The neighbour does not hold the mission.
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
    // Equal version, smaller digest.
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
    // A mission that cannot be held is not answered, because it would be offered again.
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

/// Checks a relay with sites, for which another distance has no line on earth.
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
        let id = mission_id(&longer);
        let refusal = Greeting {
            hears: 1,
            ..greeting(base, 5, id, FRESH | REFUSED_FLAG)
        };
        let says = (said(&mut relay, NOW), held(&relay));
        assert_eq!(says, (vec![(5, Said::Hello(refusal))], None));
    }
    let next = Offer {
        version: 3,
        ..longer
    };
    peer.says(&mut relay, NOW, &Said::Offer(next));
    assert_eq!(events(&mut relay), [REFUSED]);
    // The mission is refused from the firmware, and after a reboot.
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
    // A mission with the same distance is held, and older ones are ignored from then on.
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
    // The loaded mission cannot be offered: a node that holds an older one was loaded differently.
    let (mut relay, mut peers, base) = relay_4();
    peers[1].says(
        &mut relay,
        NOW,
        &hello(base, 4, (base.wrapping_sub(1), 0), 0),
    );
    assert_eq!(said(&mut relay, NOW), []);
}

/// Returns a proposal to relay 4, or a decision.
pub(crate) fn forming(tag: u8, number: u32, of: (u16, u16), place: u16) -> Said {
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
    // The neighbour has sent no hello that an offer could answer, so it is asked for one.
    let asks = Greeting {
        latest_view: id(1, 1),
        behind: 4,
        ..greeting(base, 5, mission_id(&newer), ASKS)
    };
    assert_eq!(said(&mut relay, NOW), [(5, Said::Hello(asks))]);
    peers[1].says(&mut relay, NOW, &hello(base, 4, (base, 0), 0));
    assert_eq!(said(&mut relay, NOW), [(5, Said::Offer(newer))]);
    // The offer is not repeated at once: a hello shows whether it has arrived.
    peers[1].says(&mut relay, NOW, &hello(base, 4, mission_id(&newer), 0));
    assert_eq!(said(&mut relay, NOW), [(5, proposal(4))]);
}
