//! What one relay does with an offer and a roster, and says of them.

use super::{Hail, Message, Node, Side, Stamp, Upload};
use crate::mission::tests::paper;
use crate::mission::{Interference, Interferer, Mission, MissionConfig};
use crate::settings::{Identity, Settings, Wiring};
use crate::time::Instant;
use crate::wire::auth::{Auth, Key};
use crate::wire::message::{Before, Roster};

const NOW: Instant = Instant::from_millis(10_000);

fn base() -> Mission {
    Mission::try_new(paper(3)).unwrap()
}

fn upload(version: u16) -> Upload {
    upload_to(&base(), version)
}

fn upload_to(base: &Mission, version: u16) -> Upload {
    let interference = Interference::Source(Interferer {
        power_w: 80.0,
        x_m: 700.0,
        y_m: 100.0,
    });
    let config = MissionConfig {
        interference,
        ..*base.config()
    };
    Upload::new(base, version, config).unwrap()
}

/// Relay 2 of 3, with or without a key.
fn relay(signs: bool) -> Node {
    relay_of(base(), 2, signs)
}

fn relay_of(mission: Mission, index: u16, signs: bool) -> Node {
    let settings = Settings {
        wiring: Wiring::Shared,
        auth: signs.then_some(Auth {
            key: Key::new([1; 32]),
            epoch: 1,
        }),
        ..Settings::default()
    };
    let identity = Identity { network: 1, index };
    let mut node = Node::new(mission, identity, settings, 1, Instant::ZERO);
    // What it says by itself after so long.
    node.handle_timeout(NOW);
    said(&mut node);
    node
}

fn said(node: &mut Node) -> heapless::Vec<(u16, Message), 8> {
    let mut said = heapless::Vec::new();
    while let Some((_, to, message)) = node.poll_message(NOW) {
        let message = match message {
            Message::Hail(hail) => Message::Hail(hail),
            Message::Roster(roster) => Message::Roster(roster),
            Message::Offer(upload) => Message::Offer(upload),
            Message::Heartbeat { mission, answer } => Message::Heartbeat { mission, answer },
            _ => panic!("{message:?}"),
        };
        said.push((to, message)).unwrap();
    }
    said
}

/// A hail of a neighbour that has taken relay 2.
fn hail(node: &Node, holds: Stamp) -> Message {
    Message::Hail(Hail {
        mission: node.members.digest,
        newest: 0,
        neighbour: 2,
        ask: false,
        form: false,
        fresh: false,
        ready: true,
        holds,
        flies: true,
    })
}

fn roster(stamp: Stamp) -> Message {
    Message::Roster(Roster {
        stamp,
        view: 1,
        place: 1,
        before: Before {
            view: 0,
            relays: 3,
            leader: true,
        },
    })
}

#[test]
fn who_does_not_hold_the_mission_hands_no_roster_on_and_says_what_it_holds() {
    let mut node = relay(true);
    let held = node.members.held;
    let known = hail(&node, held);
    node.handle_message(NOW, Side::Upstream, 1, &known);
    assert_eq!(said(&mut node), []);
    node.handle_message(NOW, Side::Upstream, 1, &roster(upload(1).stamp()));
    assert_eq!((node.stats.view, node.stats.mission), (1, 0));
    let said = said(&mut node);
    assert!(
        matches!(said[..], [(1, Message::Hail(Hail { holds, .. }))] if holds == held),
        "{said:?}"
    );
}

#[test]
fn the_next_relay_is_offered_the_mission_before_the_roster_comes_to_it() {
    let mut node = relay(true);
    let new = upload(1);
    node.handle_message(NOW, Side::Upstream, 1, &Message::Offer(new));
    assert_eq!(node.members.held, new.stamp());
    assert_ne!(node.members.flown, new.stamp());
    let told = said(&mut node);
    assert!(
        matches!(told[..], [(1, Message::Hail(Hail { holds, flies: false, .. }))] if holds == new.stamp()),
        "{told:?}"
    );
    node.handle_message(NOW, Side::Upstream, 1, &roster(new.stamp()));
    assert_eq!(said(&mut node), [(3, Message::Offer(new))]);
    // It says that it holds it.
    let holds = hail(&node, new.stamp());
    node.handle_message(NOW, Side::Downstream, 3, &holds);
    let told = said(&mut node);
    assert!(
        matches!(told[..], [(3, Message::Roster(Roster { stamp, place: 2, .. }))] if stamp == new.stamp()),
        "{told:?}"
    );
}

#[test]
fn who_holds_an_older_mission_is_offered_the_newer_one_and_who_holds_a_newer_one_is_told() {
    let mut node = relay(true);
    let (older, newer) = (node.members.held, upload(2).stamp());
    let ahead = hail(&node, newer);
    node.handle_message(NOW, Side::Downstream, 3, &ahead);
    let told = said(&mut node);
    assert!(
        matches!(told[..], [(3, Message::Hail(Hail { holds, .. }))] if holds == older),
        "{told:?}"
    );
    let new = upload(1);
    node.handle_upload(NOW, &new).unwrap();
    // The neighbour that the leader is beyond is offered it at once.
    assert_eq!(said(&mut node), [(1, Message::Offer(new))]);
    let behind = hail(&node, older);
    node.handle_message(NOW, Side::Downstream, 3, &behind);
    assert_eq!(said(&mut node), [(3, Message::Offer(new))]);
}

#[test]
fn without_a_key_nothing_is_taken() {
    let mut node = relay(false);
    let held = node.members.held;
    node.handle_message(NOW, Side::Upstream, 1, &Message::Offer(upload(1)));
    assert_eq!((node.stats.unsigned, node.members.held), (1, held));
    assert_eq!(node.upload(), None);
    assert_eq!(said(&mut node), []);
    // Nor is the ground anybody to listen to.
    assert_eq!((node.side_of(0), node.side_of(4)), (None, None));
    let signed = relay(true);
    assert_eq!(signed.side_of(0), Some(Side::Upstream));
    assert_eq!(signed.side_of(4), Some(Side::Downstream));
}

#[test]
fn an_offer_for_other_relays_is_refused() {
    let mut node = relay(true);
    let held = node.members.held;
    let other = Mission::try_new(MissionConfig {
        tx_power_w: 1.0,
        ..paper(3)
    });
    let stray = Upload::new(&other.unwrap(), 1, paper(3)).unwrap();
    node.handle_message(NOW, Side::Upstream, 1, &Message::Offer(stray));
    assert_eq!((node.stats.mission, node.members.held), (1, held));
    node.on_ground(NOW, Side::Upstream, &Message::Offer(stray));
    assert_eq!((node.stats.mission, node.members.held), (2, held));
}

/// Two that do not take each other for neighbours, but one of them the other: offers and hails must come to an end.
#[test]
fn an_offer_of_a_node_that_is_not_taken_is_held_and_answered_once() {
    let five = Mission::try_new(paper(5)).unwrap();
    let mut node = relay_of(five, 3, true);
    let new = upload_to(&five, 1);
    assert!(node.handle_message(NOW, Side::Upstream, 1, &Message::Offer(new)));
    assert_eq!((node.members.held, node.upstream.node()), (new.stamp(), 2));
    let told = said(&mut node);
    let hails = told.iter().filter(|(to, _)| *to == 1);
    let hails: heapless::Vec<_, 8> = hails.collect();
    assert!(
        matches!(hails[..], [(1, Message::Hail(Hail { holds, .. }))] if *holds == new.stamp()),
        "{told:?}"
    );
    let stray = upload_to(&base(), 2);
    node.handle_message(NOW, Side::Upstream, 1, &Message::Offer(stray));
    assert_eq!((node.stats.mission, node.members.held), (1, new.stamp()));
}
