//! Shared channel: reception range, and how two relays become neighbours.

use uav_relay::wire::digest::digest;
use uav_relay::{Duration, Instant, Port, Relay, Wiring};

use super::codec::Said;
use super::kinds::{FIRST, one_of_each, sent};
use super::receive::{counted, relay};
use super::votes::{ASKS, FORMS, FRESH, a_hello, between, hearing, id, long, soon};

/// Checks hellos from up to four nodes away; other frames of strangers count as misaddressed.
#[test]
fn on_a_shared_channel_the_four_nearest_on_each_side_are_heard() {
    let now = Instant::ZERO;
    for sender in 0..=14_u16 {
        let mut near = relay_of_12(6);
        let mission = digest(near.mission());
        let hello = a_hello(0, mission, 0, ASKS);
        near.handle_bytes(now, Port::Shared, &between(sender, 6, &hello));
        let heard = (1..=12).contains(&sender) && (1..=4).contains(&sender.abs_diff(6));
        let neighbour = if sender <= 6 { 5 } else { 7 };
        // The relay receives the sender's frames, unless it is too far away.
        let mask = if heard {
            1 << (sender.abs_diff(6) - 1)
        } else {
            0
        };
        // The relay is fresh, so it is alone.
        let answer = |from| long(1, hearing(mask, a_hello(0, mission, from, FRESH)));
        if heard {
            assert_eq!(counted(near.stats()), ["received"], "{sender}");
        } else {
            assert_eq!(counted(near.stats()), ["misaddressed"], "{sender}");
        }
        let out = sent(&mut near, now);
        let own = if sender == neighbour {
            // The node reports no neighbour: the relay waits for its choice.
            assert_eq!(out.len(), 1);
            continue;
        } else {
            answer(neighbour)
        };
        let expected = heard.then_some((Port::Shared, own));
        assert_eq!(out, expected.into_iter().collect::<Vec<_>>(), "{sender}");

        let mut near = relay_of_12(6);
        let sweep = &one_of_each(FIRST, mission)[0];
        near.handle_bytes(now, Port::Shared, &between(sender, 6, sweep));
        assert_eq!(counted(near.stats()), ["misaddressed"], "{sender}");
        let expected = heard.then_some((Port::Shared, answer(neighbour)));
        assert_eq!(
            sent(&mut near, now),
            expected.into_iter().collect::<Vec<_>>(),
            "{sender}"
        );
        assert_eq!(near.setpoint(), None);
    }
}

fn relay_of_12(own: u16) -> Relay {
    relay(own, 12, Wiring::Shared)
}

/// Checks a neighbour that reports no neighbour: messages wait until it chooses this relay again.
#[test]
fn a_neighbour_that_comes_back_with_a_newer_view_has_the_relay_call() {
    let now = Instant::ZERO;
    for (newest, calls) in [(0, false), (id(5, 1), true)] {
        let mut relay = relay_of_12(6);
        let mission = digest(relay.mission());
        let hello = |neighbour| hearing(1, a_hello(newest, mission, neighbour, 0));
        relay.handle_bytes(now, Port::Shared, &between(7, 6, &hello(0)));
        assert!(soon(&mut relay, now).is_empty(), "{newest}");
        let now = now + Duration::from_millis(1);
        relay.handle_bytes(now, Port::Shared, &between(7, 6, &hello(6)));
        // The node now has a neighbour on its other side; node 5 has reported none, so this relay separates no link.
        let flags = ASKS | FORMS | FRESH;
        let call = long(1, a_hello(newest, mission, 5, flags));
        let expected = calls.then_some((Port::Shared, call));
        assert_eq!(
            soon(&mut relay, now),
            expected.into_iter().collect::<Vec<_>>()
        );
    }
}

/// Checks that a pending pass is held while the neighbour has chosen another node. The pass is repeated afterwards.
#[test]
fn a_pass_waits_for_a_neighbour_that_takes_another() {
    let now = Instant::ZERO;
    let mut relay = relay_of_12(6);
    let mission = digest(relay.mission());
    let hello = |neighbour| hearing(1, a_hello(0, mission, neighbour, 0));
    relay.handle_bytes(now, Port::Shared, &between(7, 6, &hello(5)));
    let sweep = &one_of_each(FIRST, mission)[0];
    relay.handle_bytes(now, Port::Shared, &between(5, 6, sweep));
    assert_eq!(counted(relay.stats()), ["received"]);
    assert_eq!(sent(&mut relay, now), []);
    relay.handle_bytes(now, Port::Shared, &between(7, 6, &hello(6)));
    let out = sent(&mut relay, now);
    assert!(
        matches!(
            &out[..],
            [(Port::Shared, Said::Sweep(sweep))] if sweep.number == FIRST
        ),
        "{out:?}"
    );
}

/// Checks that a one-way link is ignored, and that losses do not break an established one.
#[test]
fn a_neighbour_that_does_not_hear_the_relay_is_not_linked_but_stays_so() {
    let now = Instant::ZERO;
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
        let mut relay = relay_of_12(6);
        let mission = digest(relay.mission());
        let says = |neighbour, hears| {
            let hello = hearing(hears, a_hello(0, mission, neighbour, 0));
            between(7, 6, &hello)
        };
        if !linked {
            relay.handle_bytes(now, Port::Shared, &says(5, 1));
        }
        relay.handle_bytes(now, Port::Shared, &says(6, hears));
        let sweep = &one_of_each(FIRST, mission)[0];
        relay.handle_bytes(now, Port::Shared, &between(5, 6, sweep));
        assert_eq!(counted(relay.stats()), ["received"]);
        let out = sent(&mut relay, now);
        let waiting = !out.iter().any(|(_, said)| matches!(said, Said::Sweep(_)));
        assert_eq!(waiting, waits, "{linked}, {hears:b}: {out:?}");
    }
}
