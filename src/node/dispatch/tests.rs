//! Tests of one relay: received messages, and its replies and events.

use crate::event::{Event, NodeEvent};
#[cfg(feature = "departures")]
use crate::guard::{self, Guard};
use crate::mission::tests::paper;
use crate::mission::{Interference, Interferer, Mission, MissionConfig};
use crate::node::Node;
#[cfg(feature = "departures")]
use crate::place::Placement;
use crate::settings::{Identity, Settings, Wiring};
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::view::{View, ViewId};
use crate::wire::auth::{Auth, Key};
use crate::wire::digest::MissionId;
#[cfg(feature = "departures")]
use crate::wire::message::Orders;
use crate::wire::message::{Hello, Message, Poll, Proposal};
use crate::wire::upload::Upload;

pub(super) const NOW: Instant = Instant::from_millis(10_000);

pub(super) fn base() -> Mission {
    Mission::try_new(paper(3)).unwrap()
}

pub(super) fn upload(version: u16) -> Upload {
    upload_to(&base(), version)
}

pub(super) fn upload_to(base: &Mission, version: u16) -> Upload {
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

/// Test helper: returns relay 2 of a chain of 3, which signs its frames if `signs` is true.
pub(super) fn relay(signs: bool) -> Node {
    relay_of(base(), 2, signs)
}

pub(super) fn relay_of(mission: Mission, index: u16, signs: bool) -> Node {
    let settings = Settings {
        wiring: Wiring::Shared,
        auth: signs.then_some(Auth {
            key: Key::new([1; 32]),
            epoch: 1,
        }),
        ..Settings::default()
    };
    let identity = Identity { network: 1, index };
    let mut node = Node::new(&mission, identity, &settings, 1, Instant::ZERO);
    node.begin(identity, 1, Instant::ZERO);
    // Discards the first messages, which the relay sends without a request.
    node.handle_timeout(NOW);
    sent_messages(&mut node);
    node
}

pub(super) fn sent_messages(node: &mut Node) -> heapless::Vec<(u16, Message), 8> {
    let mut said = heapless::Vec::new();
    while let Some((_, to, message)) = node.poll_message(NOW) {
        if let Message::Claim(_) = message {
            continue;
        }
        let known = matches!(
            message,
            Message::Hello(_)
                | Message::Proposal(_)
                | Message::Offer { .. }
                | Message::Heartbeat { .. }
        );
        assert!(known, "{message:?}");
        said.push((to, message)).unwrap();
    }
    said
}

/// Returns a hello of a node that has selected relay 2, and has stored the mission `holds`.
pub(super) fn hello(node: &Node, holds: MissionId) -> Message {
    Message::Hello(Hello {
        mission: node.member.digest,
        latest_view: ViewId::LOADED,
        neighbour: 2,
        requests_reply: false,
        requests_view: false,
        fresh: false,
        ready: true,
        behind: 1,
        hears: 0x0F,
        latest_mission: holds,
        active: true,
        active_in_view: false,
        refused: false,
        outside: false,
        offer_number: 9,
    })
}

const LENGTH: usize = Upload::LENGTH;

/// Identifier of the first view that relay 1 proposes: view number 1, proposer 1.
const FIRST: ViewId = ViewId::from_bits(1 << 10 | 1);

fn proposal(mission_id: MissionId) -> Message {
    Message::Proposal(Proposal {
        mission_id,
        proposed_view: FIRST,
        place: 1,
        poll: Poll {
            votes: 1,
            proposer: true,
            ..Poll::of(View {
                id: ViewId::LOADED,
                relays: 3,
            })
        },
    })
}

/// Returns a valid mission offer to `node`. It repeats the number of a hello that `node` sends at `NOW`.
fn offer(node: &mut Node, upload: Upload) -> Message {
    let offer_number = node.layers.update.next_hello_nonce(NOW, &node.member);
    Message::Offer {
        upload,
        offer_number,
    }
}

/// Returns a mission offer that repeats the number `offer_number` of a hello.
fn offered(upload: Upload, offer_number: u16) -> Message {
    Message::Offer {
        upload,
        offer_number,
    }
}

#[test]
fn a_relay_without_the_mission_forwards_no_proposal() {
    let mut node = relay(true);
    let held = node.layers.update.latest();
    let known = hello(&node, held);
    node.handle_message(NOW, Side::Upstream, 1, &known);
    assert_eq!(sent_messages(&mut node), []);
    node.handle_message(NOW, Side::Upstream, 1, &proposal(upload(1).id()));
    assert_eq!((node.stats().view, node.stats().mission), (1, 0));
    let said = sent_messages(&mut node);
    assert!(
        matches!(said[..], [(1, Message::Hello(Hello { latest_mission: holds, .. }))] if holds == held),
        "{said:?}"
    );
}

#[test]
fn the_mission_is_offered_before_the_proposal() {
    let mut node = relay(true);
    let (old, new) = (node.layers.update.latest(), upload(1));
    let said_now = offer(&mut node, new);
    node.handle_message(NOW, Side::Upstream, 1, &said_now);
    assert_eq!(node.layers.update.latest(), new.id());
    assert_ne!(node.member.active, new.id());
    // An offer must answer a hello, so relay 2 requests a hello.
    let told = sent_messages(&mut node);
    assert!(
        matches!(
            told[..],
            [
                (1, Message::Hello(Hello { latest_mission: holds, active: false, .. })),
                (3, Message::Hello(Hello { requests_reply: true, .. })),
            ] if holds == new.id()
        ),
        "{told:?}"
    );
    let behind = hello(&node, old);
    node.handle_message(NOW, Side::Downstream, 3, &behind);
    assert_eq!(sent_messages(&mut node), [(3, offered(new, 9))]);
    // A proposal also waits for the offer.
    node.handle_message(NOW, Side::Upstream, 1, &proposal(new.id()));
    assert_eq!(sent_messages(&mut node), [(3, offered(new, 9))]);
    // Relay 3 reports the mission.
    let holds = hello(&node, new.id());
    node.handle_message(NOW, Side::Downstream, 3, &holds);
    let told = sent_messages(&mut node);
    assert!(
        matches!(told[..], [(3, Message::Proposal(Proposal { mission_id, place: 2, .. }))] if mission_id == new.id()),
        "{told:?}"
    );
}

#[test]
fn a_relay_offers_a_newer_mission_or_reports_its_own() {
    let mut node = relay(true);
    let (older, newer) = (node.layers.update.latest(), upload(2).id());
    let ahead = hello(&node, newer);
    node.handle_message(NOW, Side::Downstream, 3, &ahead);
    let told = sent_messages(&mut node);
    assert!(
        matches!(told[..], [(3, Message::Hello(Hello { latest_mission: holds, .. }))] if holds == older),
        "{told:?}"
    );
    let new = upload(1);
    node.handle_upload(NOW, &new).unwrap();
    // The mission of the neighbour is unknown. So the relay at once requests a hello, which an offer can answer.
    let told = sent_messages(&mut node);
    assert!(
        matches!(
            told[..],
            [(
                1,
                Message::Hello(Hello {
                    requests_reply: true,
                    ..
                })
            )]
        ),
        "{told:?}"
    );
    // Without a reply the offer is repeated, less and less often.
    let mut at: heapless::Vec<u64, 40> = heapless::Vec::new();
    for ms in 1..4_000 {
        let now = NOW + Duration::from_millis(ms);
        node.layers.update.handle_timeout(now);
        for side in [Side::Upstream, Side::Downstream] {
            if node.next_offer(now, side).is_some() {
                at.push(ms).unwrap();
            }
        }
    }
    assert!((120..=136).contains(&at[0]) && at.len() > 8, "{at:?}");
    assert!((240..=271).contains(&(at[4] - at[3])), "{at:?}");
    let behind = hello(&node, older);
    node.handle_message(NOW, Side::Downstream, 3, &behind);
    assert_eq!(sent_messages(&mut node), [(3, offered(new, 9))]);
}

#[test]
fn without_a_key_no_upload_is_accepted() {
    let mut node = relay(false);
    let held = node.layers.update.latest();
    let said_now = offer(&mut node, upload(1));
    node.handle_message(NOW, Side::Upstream, 1, &said_now);
    assert_eq!(
        (node.stats().unsigned, node.layers.update.latest()),
        (1, held)
    );
    assert_eq!(node.upload(), None);
    assert_eq!(sent_messages(&mut node), []);
    // Messages that claim to come from the ground are not accepted either.
    assert_eq!((node.side_of(0), node.side_of(4)), (None, None));
    let signed = relay(true);
    assert_eq!(signed.side_of(0), Some(Side::Upstream));
    assert_eq!(signed.side_of(4), Some(Side::Downstream));
}

#[test]
fn an_offer_for_other_relays_is_refused() {
    let mut node = relay(true);
    let held = node.layers.update.latest();
    let other = Mission::try_new(MissionConfig {
        tx_power_w: 1.0,
        ..paper(3)
    });
    let stray = Upload::new(&other.unwrap(), 1, paper(3)).unwrap();
    let said_now = offer(&mut node, stray);
    node.handle_message(NOW, Side::Upstream, 1, &said_now);
    assert_eq!(
        (node.stats().mission, node.layers.update.latest()),
        (1, held)
    );
    let said_now = offer(&mut node, stray);
    node.on_ground(NOW, Side::Upstream, 0, &said_now);
    assert_eq!(
        (node.stats().mission, node.layers.update.latest()),
        (2, held)
    );
}

/// Checks that an offer from a node other than the neighbour is answered by a single hello. Otherwise the exchange of
/// offers and hellos would never end.
#[test]
fn an_offer_of_an_unselected_node_is_answered_once() {
    let five = Mission::try_new(paper(5)).unwrap();
    let mut node = relay_of(five, 3, true);
    let new = upload_to(&five, 1);
    let first = offer(&mut node, new);
    assert!(node.handle_message(NOW, Side::Upstream, 1, &first));
    assert_eq!(
        (
            node.layers.update.latest(),
            node.layers.neighbours.at(Side::Upstream).node()
        ),
        (new.id(), 2)
    );
    let told = sent_messages(&mut node);
    let hellos = told.iter().filter(|(to, _)| *to == 1);
    let hellos: heapless::Vec<_, 8> = hellos.collect();
    assert!(
        matches!(hellos[..], [(1, Message::Hello(Hello { latest_mission: holds, .. }))] if *holds == new.id()),
        "{told:?}"
    );
    let stray = upload_to(&base(), 2);
    let said_now = offer(&mut node, stray);
    node.handle_message(NOW, Side::Upstream, 1, &said_now);
    assert_eq!(
        (node.stats().mission, node.layers.update.latest()),
        (1, new.id())
    );
}

/// Checks that an offer that arrives too late is answered by a hello and not stored. A new offer that repeats the nonce
/// of this hello is accepted.
#[test]
fn an_offer_that_was_withheld_is_refused_and_counted() {
    let late = |seconds: u64| {
        NOW + Settings::default().dead_after.times(2) + Duration::from_millis(1_000 * seconds)
    };
    for ground in [false, true] {
        for (now, hellos) in [(late(1), false), (late(1), true), (late(7_200), true)] {
            let mut node = relay(true);
            let held = node.layers.update.latest();
            let withheld = offer(&mut node, upload(1));
            if hellos {
                // The relay continues to send hellos. The number in the hellos has changed by then.
                let step = Settings::default().dead_after;
                node.layers
                    .update
                    .next_hello_nonce(NOW + step, &node.member);
                node.layers
                    .update
                    .next_hello_nonce(NOW + step.times(2), &node.member);
                node.layers.update.next_hello_nonce(now, &node.member);
            }
            let from = u16::from(!ground);
            assert!(node.handle_message(now, Side::Upstream, from, &withheld));
            assert_eq!((node.stats().stale, node.layers.update.latest()), (1, held));
            let mut answer = None;
            while let Some((_, to, message)) = node.poll_message(now) {
                if let Message::Hello(hello) = message
                    && to == from
                {
                    answer = Some(hello.offer_number);
                }
            }
            let fresh = offered(upload(1), answer.unwrap());
            assert_ne!(fresh, withheld);
            assert!(node.handle_message(now, Side::Upstream, from, &fresh));
            assert_eq!(
                (node.stats().stale, node.layers.update.latest()),
                (1, upload(1).id())
            );
        }
    }
}

#[test]
fn a_stored_upload_does_not_contain_the_offer_number() {
    let mut bodies = [[0; LENGTH + 2]; 2];
    for (body, answer) in bodies.iter_mut().zip([1, 0xFFFF]) {
        assert_eq!(offered(upload(3), answer).encode(body), Some(LENGTH + 2));
    }
    let mut stored = [0; LENGTH];
    assert_eq!(upload(3).encode(&mut stored), Some(LENGTH));
    assert_eq!(
        (&bodies[0][..LENGTH], &bodies[1][..LENGTH]),
        (&stored[..], &stored[..])
    );
    assert_eq!(Upload::decode(&stored), Some(upload(3)));
    assert_eq!(Upload::decode(&bodies[0][..LENGTH + 2]), None);
}

/// Returns a hello of node 1. `hears` is the bit mask of the nodes that node 1 receives.
fn hello_of(node: &Node, hears: u8) -> Message {
    let Message::Hello(hello) = hello(node, node.layers.update.latest()) else {
        unreachable!();
    };
    Message::Hello(Hello {
        requests_reply: true,
        hears,
        ..hello
    })
}

fn events(node: &mut Node) -> heapless::Vec<Event, 16> {
    core::iter::from_fn(|| node.poll_event()).collect()
}

#[test]
fn a_node_that_does_not_receive_is_reported_once() {
    let mut node = relay(false);
    events(&mut node);
    let deaf = hello_of(&node, 0);
    for round in 1..=2 {
        for times in 1..=30 {
            node.handle_message(NOW, Side::Upstream, 1, &deaf);
            let told = events(&mut node).contains(&Event::NotHeard { node: 1 });
            assert_eq!(told, times == 8, "{round} {times}");
        }
        let hears = hello_of(&node, 1);
        node.handle_message(NOW, Side::Upstream, 1, &hears);
    }
}

#[test]
fn a_loss_and_a_mission_mismatch_name_the_node() {
    let mut node = relay(false);
    let lost = events(&mut node);
    let Message::Hello(hello) = hello_of(&node, 1) else {
        unreachable!();
    };
    let other = Message::Hello(Hello {
        mission: hello.mission ^ 1,
        ..hello
    });
    node.handle_message(NOW, Side::Upstream, 1, &other);
    assert_eq!(
        events(&mut node)[..],
        [Event::MissionMismatch { node: 1 }],
        "{lost:?}"
    );
    let mut told = heapless::Vec::<Event, 16>::new();
    for seconds in 10..200 {
        node.handle_timeout(Instant::from_millis(1_000 * seconds));
        while node
            .poll_message(Instant::from_millis(1_000 * seconds))
            .is_some()
        {}
        told.extend(events(&mut node));
    }
    for (side, other) in [(Side::Upstream, 1), (Side::Downstream, 3)] {
        let lost = Event::NeighbourLost { side, node: other };
        assert_eq!(
            told.iter().filter(|event| **event == lost).count(),
            1,
            "{told:?}"
        );
    }
}

/// Checks that a spare, which waits outside of the chain, requests no view before it joins.
#[test]
#[cfg(feature = "departures")]
fn a_relay_outside_proposes_nothing() {
    let settings = Settings {
        wiring: Wiring::Shared,
        ..Settings::default()
    };
    let identity = Identity {
        network: 1,
        index: 2,
    };
    let mut node = Node::new(&base(), identity, &settings, 1, Instant::ZERO);
    node.begin(identity, 1, Instant::ZERO);
    node.wait_as_spare(Instant::ZERO);
    assert_eq!(node.departure(NOW), crate::Departure::Spare);
    for step in 0..100 {
        let now = NOW + Duration::from_millis(1_000 * step);
        node.layers.view.request.start(now);
        node.handle_timeout(now);
        assert!(!node.layers.view.request.is_pending());
        assert!(node.layers.view.outstanding().is_none() && !node.layers.view.has_no_quorum());
        sent_messages(&mut node);
    }
    node.stay(NOW + Duration::from_millis(200_000));
    assert_eq!(node.departure(NOW), crate::Departure::Member);
}

/// Checks that a motion without a common start time waits 15 s and the lead of the common start.
///
/// In chains of more than 125 relays the lead is longer than 15 s. A relay that begins alone must not be too early.
#[cfg(feature = "departures")]
#[test]
fn a_motion_waits_for_the_lead_of_a_long_chain() {
    let mut node = relay_of(Mission::try_new(paper(200)).unwrap(), 100, false);
    node.member.settings.respacing = Duration::from_millis(20_000);
    let place = |x_m: f32| Placement::on_line(x_m, 100.0);
    let mut x_m = |agreed_m: f32, after_ms: u64| {
        node.layers.round.set_agreed_place(place(agreed_m));
        node.steer(NOW + Duration::from_millis(after_ms));
        node.setpoint().unwrap().x_m
    };
    assert_eq!(x_m(500.0, 0).to_bits(), 500.0_f32.to_bits());
    // 15 s, and 4 hop times for each relay.
    let begins_ms = 15_000 + 4 * 30 * 200;
    for after_ms in [1, 15_001, begins_ms] {
        assert_eq!(x_m(600.0, after_ms).to_bits(), 500.0_f32.to_bits());
    }
    let half_m = x_m(600.0, begins_ms + 10_001);
    assert!((half_m - 550.0).abs() < 0.1, "{half_m}");
}

/// Checks that an order to leave for another relay comes before the own request to leave.
///
/// It then closes up to the relay that leaves now, instead of holding its position.
#[cfg(feature = "departures")]
#[test]
fn an_order_to_leave_comes_before_the_relays_own_request() {
    let mut node = relay(false);
    let settings = Settings {
        guard: Some(guard::tests::config()),
        ..node.member.settings
    };
    node.steering.begin(&settings, [Some(1), Some(3)], 1, NOW);
    node.leave(NOW, None);
    assert_eq!(node.departure_granted(), Some(false));
    for (ordered, expected) in [(0, 2), (3, 3), (7, 2), (2, 2), (0, 2)] {
        node.layers.lease.set_orders(Orders {
            leavers: [ordered, 0, 0, 0],
            ..Orders::NONE
        });
        node.steer(NOW);
        let leaver = node.steering.known_guard().map(Guard::leaver);
        assert_eq!(leaver, Some(expected));
    }
}

/// Checks that a second call gives the drone of a spare time to hover, as the first call does.
#[cfg(feature = "departures")]
#[test]
fn the_limit_of_a_second_call_starts_anew() {
    let settings = Settings {
        wiring: Wiring::Shared,
        guard: Some(guard::tests::config()),
        ..Settings::default()
    };
    let identity = Identity {
        network: 1,
        index: 2,
    };
    let mut node = Node::new(&base(), identity, &settings, 1, Instant::ZERO);
    node.begin(identity, 1, Instant::ZERO);
    node.wait_as_spare(Instant::ZERO);
    let call = hello(&node, node.layers.update.latest());
    // Every second, from this time on, for this time. The drone never hovers.
    let mut joins_after = |from_s: u64, most_s: u64| {
        (0..most_s).find(|after_s| {
            let now = NOW + Duration::from_millis(1_000 * (from_s + after_s));
            node.handle_timeout(now);
            node.handle_message(now, Side::Upstream, 1, &call);
            node.departure(now) == crate::Departure::Member
        })
    };
    assert_eq!(joins_after(0, 10), None);
    assert_eq!(joins_after(60, 100), Some(15));
}

/// Checks that the refusal of a ground station at any accepted distance is reported.
///
/// It is reported once a minute, and again after a frame with a new epoch.
#[test]
fn a_station_with_an_old_epoch_is_reported_at_any_distance() {
    for index in 1..=8 {
        let mut node = relay_of(Mission::try_new(paper(8)).unwrap(), index, true);
        events(&mut node);
        for (station, side) in [(0, Side::Upstream), (9, Side::Downstream)] {
            let told = |node: &mut Node, reason| {
                node.refuse(NOW, side, station, reason);
                events(node).len()
            };
            assert_eq!(told(&mut node, NodeEvent::Epoch), 1, "{index} {station}");
            assert_eq!(told(&mut node, NodeEvent::Epoch), 0, "{index} {station}");
            assert_eq!(told(&mut node, NodeEvent::Mission), 1, "{index} {station}");
            node.on_key_match(side, station);
            assert_eq!(told(&mut node, NodeEvent::Epoch), 1, "{index} {station}");
            assert_eq!(told(&mut node, NodeEvent::Mission), 0, "{index} {station}");
        }
        assert_eq!(node.refusals(NOW), [0; 2]);
    }
}

/// Checks that a relay calls a spare only with a lease, and not while it searches for its neighbour.
///
/// A neighbour that restarts as a spare is called in any case.
#[cfg(feature = "departures")]
#[test]
fn a_relay_with_a_lease_and_neighbours_calls_a_spare() {
    let mut node = relay_of(Mission::try_new(paper(5)).unwrap(), 3, false);
    let calls = |node: &Node| node.calls_to_join(Side::Downstream, 4);
    assert!(!calls(&node));
    node.layers.lease.set_until(NOW);
    assert!(calls(&node));
    node.layers.lease.set_orders(Orders {
        joiners: [5, 4, 0, 0],
        ..Orders::NONE
    });
    for ends in [false, true] {
        node.layers
            .neighbours
            .at_mut(Side::Downstream)
            .give_up(NOW, ends);
        assert_eq!(calls(&node), ends);
    }
    node.layers.lease.end();
    node.layers.lease.set_orders(Orders {
        joiners: [5, 4, 0, 0],
        ..Orders::NONE
    });
    assert!(!calls(&node));
}
