//! Shared channel: reception range, and how two relays become neighbours.

use uav_relay::{Port, Wiring};

use super::bench::Bench;
use super::kinds::{FIRST, one_of_each};
use super::message::WireMessage;
use super::votes::{ASKS, FORMS, FRESH, id, loaded_hello, with_neighbours};

const AIR: Port = Port::Shared;

/// Returns relay 6 of 12 on a shared channel, and a sweep message that tests can deliver to the relay.
fn sixth() -> (Bench, WireMessage) {
    let bench = Bench::new(6, 12, Wiring::Shared);
    let sweep = one_of_each(FIRST, bench.mission)[0].clone();
    (bench, sweep)
}

/// Returns a hello whose sender has chosen the neighbour `neighbour`, and receives the nearest node.
///
/// The hello requests no answer.
fn hello_choosing(bench: &Bench, neighbour: u16) -> WireMessage {
    with_neighbours(1, 1, &loaded_hello(0, bench.mission, neighbour, 0))
}

/// Checks that a relay on a shared channel accepts hellos of the four nearest nodes on each side. Other frames of
/// nodes that are not its neighbours count as misaddressed.
#[test]
fn on_a_channel_the_four_nearest_of_each_side_are_received() {
    for sender in 0..=14_u16 {
        let (bench, sweep) = sixth();
        let heard = (1..=12).contains(&sender) && (1..=4).contains(&sender.abs_diff(6));
        let neighbour = if sender <= 6 { 5 } else { 7 };
        // The relay receives the sender's frames, unless it is too far away. It is fresh, so it is alone.
        let mask = if heard {
            1 << (sender.abs_diff(6) - 1)
        } else {
            0
        };
        let answer = with_neighbours(mask, 1, &loaded_hello(0, bench.mission, neighbour, FRESH));
        let expected = Vec::from_iter(heard.then_some((AIR, answer)));
        let mut after = bench.clone();
        let out = after.receive_from(sender, AIR, &loaded_hello(0, bench.mission, 0, ASKS));
        let counter = if heard { "received" } else { "misaddressed" };
        assert_eq!(after.counted(), [counter], "{sender}");
        if sender == neighbour {
            // The node reports no neighbour: the relay waits for its choice.
            assert_eq!(out.len(), 1);
            continue;
        }
        assert_eq!(out, expected, "{sender}");
        let mut after = bench.clone();
        let out = after.receive_from(sender, AIR, &sweep);
        assert_eq!(after.counted(), ["misaddressed"], "{sender}");
        assert_eq!(out, expected, "{sender}");
        assert_eq!(after.setpoint(), None);
    }
}

/// Checks that a relay sends nothing to a node whose hello states that the node has no neighbour.
///
/// Once this node chooses the relay as its neighbour, and knows a newer view, the relay requests a view.
#[test]
fn a_returning_neighbours_newer_view_causes_a_request() {
    for (newest, calls) in [(0, false), (id(5, 1), true)] {
        let (mut bench, _) = sixth();
        let mission = bench.mission;
        let hello = |neighbour| with_neighbours(1, 1, &loaded_hello(newest, mission, neighbour, 0));
        assert_eq!(bench.receive(AIR, &hello(0)), [], "{newest}");
        assert_eq!(bench.advance_1_ms(), [], "{newest}");
        let mut out = bench.receive(AIR, &hello(6));
        out.extend(bench.advance_1_ms());
        // The node now has a neighbour on its other side; node 5 has reported none, so this relay separates no link.
        let call = loaded_hello(newest, mission, 5, ASKS | FORMS | FRESH);
        assert_eq!(out, Vec::from_iter(calls.then_some((AIR, call))));
    }
}

/// Checks that a relay forwards no sweep message while its next neighbour has chosen another node.
///
/// The relay forwards the message once the neighbour has chosen this relay.
#[test]
fn a_pass_waits_for_a_neighbour_busy_with_another() {
    let (mut bench, sweep) = sixth();
    bench.receive(AIR, &hello_choosing(&bench.clone(), 5));
    assert_eq!(bench.receive_from(5, AIR, &sweep), []);
    assert_eq!(bench.counted(), ["received"]);
    let out = bench.receive(AIR, &hello_choosing(&bench.clone(), 6));
    assert_eq!(out.len(), 1);
    assert!(out[0].0 == AIR && out[0].1.is("Sweep"), "{out:?}");
    assert_eq!(out[0].1.number("number"), f64::from(FIRST));
}

/// Checks that a relay ignores a one-way link. A link that has worked in both directions is not ignored.
#[test]
fn a_one_way_link_is_ignored_unless_it_was_established() {
    for (linked, hears, waits) in [
        (false, 0, true),
        (false, 0b1110, true),
        (false, 1, false),
        (false, 0b1111, false),
        (true, 0, false),
        (true, 0b1110, false),
        (true, 1, false),
        (true, 0b1111, false),
    ] {
        let (mut bench, sweep) = sixth();
        if !linked {
            bench.receive(AIR, &hello_choosing(&bench.clone(), 5));
        }
        let hello = with_neighbours(hears, 1, &hello_choosing(&bench, 6));
        let mut out = bench.receive(AIR, &hello);
        out.extend(bench.receive_from(5, AIR, &sweep));
        assert_eq!(bench.counted(), ["received"]);
        let waiting = !out.iter().any(|(_, message)| message.is("Sweep"));
        assert_eq!(waiting, waits, "{linked}, {hears:b}: {out:?}");
    }
}
