//! Relay in a view: accepted digests, stale messages, and forwarded requests.

use serde_json::json;
use uav_relay::{Event, Instant, Port, Wiring};

use super::bench::Bench;
use super::kinds::{FIRST, beat, one_of_each};
use super::message::WireMessage;
use super::votes::*;

const UP: Port = Port::Upstream;
const DOWN: Port = Port::Downstream;

/// Returns relay 4, idle, after it accepted membership view `view` of all eight relays.
///
/// Also returns the digest that messages along the chain have in this view.
fn in_view(view: u32) -> (Bench, u16) {
    let mut bench = Bench::new(4, 8, Wiring::Pair);
    let of = (bench.mission, 0);
    bench.receive(UP, &proposed(view, of, 3, 8));
    bench.receive(DOWN, &granted(view, of, 5, 8));
    bench.events();
    assert_eq!(bench.view().bits(), view);
    let own = bench.mission.wrapping_add(mark(view));
    (bench, own)
}

/// Returns relay 4 in membership view `view`, idle after an agreement on positions.
///
/// Also returns the digest that messages along the chain have in this view.
fn agreed_in_view(view: u32) -> (Bench, u16) {
    let (mut bench, own) = in_view(view);
    let at = Instant::from_millis(5);
    for (kind, port) in [(0, UP), (1, DOWN)] {
        bench.receive(port, &one_of_each(FIRST, own)[kind]);
        while bench.poll_timeout().is_some_and(|due| due < at) {
            bench.handle_timeout(at);
        }
    }
    bench.now = at;
    bench.sent();
    assert!(bench.events().contains(&Event::Converged));
    (bench, own)
}

/// Checks that a relay accepts messages along the chain only with the digest of its membership view.
///
/// The same holds for lease renewals. The relay answers messages with another digest by a hello.
#[test]
fn passes_have_the_digest_of_their_view() {
    for view in [id(1, 1), id(300, 7), id(4_194_303, 1000)] {
        let (bench, own) = in_view(view);
        let (agreed, _) = agreed_in_view(view);
        let hello = |neighbour: u16| {
            let behind = if neighbour == 3 { 5 } else { 4 };
            with_neighbours(
                1,
                behind,
                &loaded_hello(view, bench.mission, neighbour, ASKS),
            )
        };
        for off in [0, 1, 64, 0xFFC0, 65, 0xFFBF, 0x4000] {
            let known = off == 0;
            // Answers, and completions of a renewal, come from the other side.
            for (kind, port, neighbour) in [(0, UP, 3), (15, UP, 3), (1, DOWN, 5), (16, DOWN, 5)] {
                // Renewals are for relays that have agreed on their positions.
                let mut after = if known && kind == 15 {
                    agreed.clone()
                } else {
                    bench.clone()
                };
                let kinds = one_of_each(FIRST, own.wrapping_add(off));
                let mut out = after.receive(port, &kinds[kind]);
                out.extend(after.advance_1_ms());
                let expected = match (known, neighbour) {
                    (true, 5) => &["received", "stale"][..],
                    (true, _) => &["received"],
                    (false, _) => &["received", "view"],
                };
                assert_eq!(after.counted(), expected, "{view:x}, {off}, {kind}");
                if known {
                    assert!(
                        !out.iter().any(|(_, message)| message.is("Hello")),
                        "{out:?}"
                    );
                } else {
                    assert_eq!(out, [(port, hello(neighbour))], "{view:x}, {off}, {kind}");
                }
            }
        }
    }
}

/// Checks that a relay requests a new membership view when it receives a sweep message of another view.
///
/// Both views are of the same mission.
#[test]
fn a_pass_of_another_view_causes_a_view_request() {
    let (mut bench, own) = in_view(id(2, 1));
    for port in [UP, DOWN] {
        bench.receive(port, &loaded_hello(0, bench.mission, 4, 0));
    }
    for (kind, port, calls) in [
        (0, UP, true),
        (8, UP, true),
        (15, UP, true),
        (1, DOWN, false),
        (16, DOWN, false),
    ] {
        let mut after = bench.clone();
        let message = &one_of_each(FIRST, own.wrapping_add(1))[kind];
        let mut out = after.receive(port, message);
        out.extend(after.advance_1_ms());
        assert_eq!(requests_view(&out), calls, "{message:?}");
    }
}

fn requests_view(out: &[(Port, WireMessage)]) -> bool {
    let asks = |message: &WireMessage| message.is("Hello") && message.has(FORMS);
    out.iter()
        .any(|(port, message)| *port == UP && asks(message))
}

#[test]
fn heartbeats_have_the_digest_of_the_mission_in_every_view() {
    let (mut bench, own) = in_view(id(7, 1));
    for (mission, expected) in [(bench.mission, 0), (own, 1)] {
        bench.receive(UP, &beat(mission, 0, 0));
        assert_eq!(bench.stats().mission, expected);
    }
}

/// Checks that a late proposal of an old membership view changes nothing. A leader that proposes an old view again is
/// informed about the newest view.
#[test]
fn a_late_proposal_of_an_old_view_changes_nothing() {
    let (mut bench, _) = in_view(id(5, 2));
    let of = (bench.mission, 0);
    // View 5 from another place than before.
    for (nth, view, place) in [(1, id(5, 2), 2), (2, id(5, 1), 3), (3, id(3, 9), 3)] {
        assert_eq!(bench.receive(UP, &proposed(view, of, place, 8)), []);
        assert_eq!(bench.advance_1_ms(), []);
        assert_eq!((bench.stats().stale, bench.view().bits()), (nth, id(5, 2)));
        assert_eq!((bench.index(), bench.mission().relays()), (4, 8));
        assert_eq!(bench.events(), []);
    }
    let mut out = bench.receive(UP, &proposed(id(4, 1), of, 3, 8));
    out.extend(bench.advance_1_ms());
    let hello = with_neighbours(
        1,
        5,
        &loaded_hello(id(6, 4), bench.mission, 3, ASKS | FORMS),
    );
    assert_eq!(out, [(UP, hello)]);
    assert_eq!((bench.stats().stale, bench.view().bits()), (4, id(5, 2)));
}

#[test]
fn a_view_request_is_forwarded_unless_its_view_is_older() {
    let view = id(3, 2);
    let (bench, _) = in_view(view);
    for (newest, fresh, calls) in [
        (view, false, true),
        (id(3, 3), false, true),
        (id(4, 1), false, true),
        (id(3, 1), false, false),
        (id(2, 9), false, false),
        (0, false, false),
        (0, true, true),
    ] {
        let mut after = bench.clone();
        let flags = FORMS | if fresh { FRESH } else { 0 };
        let mut out = after.receive(DOWN, &loaded_hello(newest, bench.mission, 4, flags));
        out.extend(after.advance_1_ms());
        let known = newest.max(view);
        let on = with_neighbours(1, 5, &loaded_hello(known, bench.mission, 3, ASKS | FORMS));
        let expected = Vec::from_iter(calls.then_some((UP, on)));
        assert_eq!(out, expected, "{newest:x} {fresh}");
    }
}

/// Checks that an accepted membership view counts as agreed only after the first message of this view.
///
/// The message is a sweep along the chain or a lease renewal. Both are sent only once all members have accepted the
/// view.
#[test]
fn a_view_counts_after_its_first_pass_or_renewal() {
    let view = id(3, 2);
    let (bench, own) = in_view(view);
    let of = (bench.mission, 0);
    let on = proposed(id(4, 1), of, 4, 8);
    let accepted = json!({ "proposal": view, "view": view, "relays": 8 });
    let accepted = on.with(json!({ "successor": accepted }));
    let counts = on.with(json!({ "agreed_view": view, "votes": 1, "proposer": false }));
    for (begun, expected) in [
        (None, accepted),
        (Some(0), counts.clone()),
        (Some(15), counts),
    ] {
        let mut after = bench.clone();
        if let Some(kind) = begun {
            after.receive(UP, &one_of_each(FIRST, own)[kind]);
        }
        let out = after.receive(UP, &proposed(id(4, 1), of, 3, 8));
        assert_eq!(out, [(DOWN, expected)], "{begun:?}");
    }
}

/// Checks that the second lease renewal grants a lease. When the lease expires, the relay requests a new membership
/// view.
#[test]
fn a_lease_is_granted_by_the_next_renewal_and_runs_out() {
    let (mut bench, own) = agreed_in_view(id(3, 2));
    let kinds = one_of_each(FIRST, own);
    let pulse = |number: u16| kinds[15].with(json!({ "number": number, "lease_ds": 160 }));
    let pulsed =
        |number: u16, done: bool| kinds[16].with(json!({ "number": number, "done": done }));
    let at = Instant::from_millis;
    let mut hears = |ms, port, message: &WireMessage, expected: &[(Port, WireMessage)]| {
        bench.now = at(ms);
        assert_eq!(
            bench.receive(port, message),
            expected,
            "{ms} ms: {message:?}"
        );
        (bench.lease(), bench.stats().stale, bench.stats().repeated)
    };
    hears(10, UP, &pulse(9), &[(DOWN, pulse(9))]);
    hears(15, UP, &pulse(9), &[(UP, pulsed(9, false))]);
    let (_, _, repeated) = hears(20, DOWN, &pulsed(9, false), &[]);
    assert_eq!(repeated, 1);
    hears(30, DOWN, &pulsed(9, true), &[(UP, pulsed(9, true))]);
    let (lease, stale, _) = hears(35, UP, &pulse(9), &[(UP, pulsed(9, true))]);
    assert_eq!(lease, None, "the others may not have taken part yet");
    // Other messages are stale.
    for (nth, port, message) in [
        (1, UP, pulse(8)),
        (2, DOWN, pulsed(9, true)),
        (3, DOWN, pulsed(8, true)),
    ] {
        assert_eq!(hears(40, port, &message, &[]).1, stale + nth, "{message:?}");
    }
    let (lease, ..) = hears(50, UP, &pulse(10), &[(DOWN, pulse(10))]);
    assert_eq!(lease, Some(at(10 + 16_000)), "from when it was forwarded");
    // A renewal out of sequence grants no lease.
    let (lease, ..) = hears(60, UP, &pulse(50), &[(DOWN, pulse(50))]);
    assert_eq!(lease, Some(at(16_010)));
    let mut out = Vec::new();
    while bench.lease().is_some() {
        out = bench.advance_to_timeout();
    }
    assert_eq!(bench.now, at(16_010));
    assert!(bench.events().contains(&Event::LeaseLapsed));
    out.extend(bench.advance_1_ms());
    assert!(requests_view(&out), "{out:?}");
}
