//! Requests for a membership view, and when a relay stops sending them.

use serde_json::json;
use uav_relay::{Event, Instant, Phase, Port, ViewId, Wiring};

use super::bench::Bench;
use super::kinds::{FIRST, beat, one_of_each};
use super::votes::*;

/// Checks that a relay without a quorum has no setpoint and requests no further membership view.
///
/// The relay has neighbours on both sides, so that it also forwards the decision that refuses the view.
#[test]
fn a_part_without_quorum_stops_requesting_views() {
    let mut bench = Bench::new(4, 8, Wiring::Pair);
    // The relay requests a view because it has missed earlier passes.
    let sweep = &one_of_each(FIRST + 1, bench.mission)[0];
    // The relay is fresh, so no others are connected behind it.
    let calls = with_neighbours(
        1,
        1,
        &loaded_hello(0, bench.mission, 3, ASKS | FORMS | FRESH),
    );
    assert_eq!(bench.receive(Port::Upstream, sweep), []);
    assert_eq!(bench.advance_1_ms(), [(Port::Upstream, calls)]);
    let (view, of) = (id(1, 1), (bench.mission, 0));
    bench.receive(Port::Upstream, &proposed(view, of, 1, 8));
    let too_few = |place| refused(view, of, place, 3);
    let out = bench.receive(Port::Downstream, &too_few(3));
    assert_eq!(out, [(Port::Upstream, too_few(2))]);
    assert_eq!(bench.events(), [Event::NoQuorum]);
    assert_eq!((bench.view(), bench.setpoint()), (ViewId::LOADED, None));
    for _ in 0..200 {
        for (_, message) in bench.advance_to_timeout() {
            assert!(message.is("Heartbeat"), "{message:?}");
        }
    }
    assert!(bench.now > Instant::from_millis(60_000));
}

/// Checks that a leader without a quorum proposes again, after ever longer waits. The first wait is `probe_after`.
/// Each refusal doubles the wait, up to eight times `probe_after`.
#[test]
fn a_leader_without_quorum_proposes_at_growing_intervals() {
    let mut head = Bench::new(1, 8, Wiring::Pair);
    let mission = head.mission;
    head.receive(
        Port::Downstream,
        &loaded_hello(0, mission, 1, FORMS | READY),
    );
    head.advance_1_ms();
    for number in 1..=6_u32 {
        let since = head.now;
        let too_few = refused(id(number, 1), (mission, 0), 2, 2);
        assert_eq!(head.receive(Port::Downstream, &too_few), []);
        assert_eq!(head.phase(), Phase::NoQuorum);
        let now = head.now;
        head.restart(now);
        assert_eq!(
            (head.phase(), head.advance_1_ms()),
            (Phase::NoQuorum, vec![])
        );
        let mut turns = 0..10_000;
        let proposal = loop {
            assert!(turns.next().is_some(), "{number}: no proposal");
            let out = head.advance_to_timeout();
            // Its neighbour answers; alone the leader would propose nothing.
            for (port, message) in out.iter().filter(|(_, message)| message.is("Heartbeat")) {
                let asked = message.number("request") as u16;
                head.receive(*port, &beat(mission, 0, asked));
            }
            if let Some(proposal) = out.into_iter().find(|(_, message)| message.is("Proposal")) {
                break proposal;
            }
        };
        let wait = head.now.since(since).as_micros();
        let least = 5_000_000 << (number - 1).min(3);
        let waits = least..=least / 8 * 9 + 2;
        assert!(waits.contains(&wait), "{number}: {wait}");
        let left = 15_000_000_u64.saturating_sub(head.now.as_micros());
        let next = proposed(id(number + 1, 1), (mission, 0), 1, 8);
        let next = next.with(json!({ "lease_left_ds": left.div_ceil(100_000) }));
        assert_eq!(proposal, (Port::Downstream, next));
    }
}

/// Checks that a hello is answered by another hello only if it requests an answer.
///
/// If a hello reports a far later membership view, the view number in the answer is at most 4096 above the relay's own.
#[test]
fn a_hello_is_answered_by_a_hello_on_request() {
    for (asks, newest, known) in [
        (false, 0, 0),
        (true, 0, 0),
        (true, id(6, 2), id(6, 2)),
        (true, id(255, 2), id(255, 2)),
        (true, id(4_096, 2), id(4_096, 2)),
        (true, id(4_097, 2), id(4_096, 2)),
        (true, id(4_194_303, 2), id(4_096, 2)),
    ] {
        let mut bench = Bench::new(4, 8, Wiring::Pair);
        let mission = bench.mission;
        let flags = if asks { ASKS } else { 0 };
        let mut out = bench.receive(Port::Upstream, &loaded_hello(newest, mission, 4, flags));
        out.extend(bench.advance_1_ms());
        let answer = with_neighbours(1, 1, &loaded_hello(known, mission, 3, FRESH));
        let expected = asks.then_some((Port::Upstream, answer));
        assert_eq!(out, expected.into_iter().collect::<Vec<_>>());
        assert_eq!(bench.counted(), ["received"]);
    }
}

#[test]
fn more_relays_than_the_mission_has_are_stale() {
    for place in [1, 7, 8, 9, 999, 1000] {
        let mut bench = Bench::new(4, 8, Wiring::Pair);
        let (view, of) = (id(1, 1), (bench.mission, 0));
        let out = bench.receive(Port::Upstream, &proposed(view, of, place, 8));
        if place > 7 {
            assert_eq!(bench.counted(), ["received", "stale"], "{place}");
            assert_eq!(out, []);
            continue;
        }
        assert_eq!(bench.counted(), ["received"], "{place}");
        assert_eq!(out.len(), 1);
        bench.receive(Port::Downstream, &granted(view, of, place + 1, 9));
        assert_eq!(bench.counted(), ["received", "stale"], "{place}");
        assert_eq!(bench.mission().relays(), 8);
    }
}
