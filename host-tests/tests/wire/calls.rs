//! Requests for a view, and their end.

use uav_relay::wire::digest::digest;
use uav_relay::{Duration, Event, Instant, Phase, Port, ViewId, Wiring};

use super::codec::{Proposed, Said};
use super::kinds::{FIRST, framed, one_of_each, sent};
use super::receive::{counted, relay};

use super::votes::*;

/// Checks the middle of a part without a quorum. It holds, returns the decision, and requests nothing more.
#[test]
fn a_part_that_is_cut_off_stops_calling() {
    let mut relay = relay(4, 8, Wiring::Pair);
    let mission = digest(relay.mission());
    let mut now = Instant::ZERO;
    // The relay requests a view because it has missed earlier passes.
    let sweep = &one_of_each(FIRST + 1, mission)[0];
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, sweep));
    // The relay is fresh, so no others are connected behind it.
    let calls = a_hello(0, mission, 3, ASKS | FORMS | FRESH);
    let calls = long(1, hearing(1, calls));
    assert_eq!(soon(&mut relay, now), [(Port::Upstream, calls)]);
    now = now + Duration::from_millis(1);
    let (view, of) = (id(1, 1), (mission, 0));
    let proposal = Said::Proposal(proposed(view, of, 1, 8));
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
    sent(&mut relay, now);
    let too_few = |place| refused(view, of, place, 3);
    relay.handle_bytes(
        now,
        Port::Downstream,
        &framed(4, Port::Downstream, &too_few(3)),
    );
    assert_eq!(only(&mut relay, now), (Port::Upstream, too_few(2)));
    assert_eq!(events(&mut relay), [Event::NoQuorum]);
    assert_eq!((relay.view(), relay.setpoint()), (ViewId::LOADED, None));
    for _ in 0..200 {
        now = relay.poll_timeout().unwrap();
        relay.handle_timeout(now);
        for (_, said) in sent(&mut relay, now) {
            assert!(matches!(said, Said::Heartbeat { .. }), "{said:?}");
        }
    }
    assert!(now > Instant::from_millis(60_000));
}

/// Checks a leader without a quorum: it proposes again after `probe_after`, doubled with each refusal.
#[test]
fn a_leader_whose_part_is_cut_off_holds_and_proposes_again_and_again() {
    let mut head = relay(1, 8, Wiring::Pair);
    let mission = digest(head.mission());
    let mut now = Instant::ZERO;
    let hello = a_hello(0, mission, 1, FORMS | READY);
    head.handle_bytes(now, Port::Downstream, &framed(1, Port::Downstream, &hello));
    soon(&mut head, now);
    for number in 1..=6_u32 {
        let since = now;
        let too_few = refused(id(number, 1), (mission, 0), 2, 2);
        head.handle_bytes(
            now,
            Port::Downstream,
            &framed(1, Port::Downstream, &too_few),
        );
        assert_eq!(head.phase(), Phase::NoQuorum);
        head.restart(now);
        assert_eq!(
            (head.phase(), soon(&mut head, now)),
            (Phase::NoQuorum, vec![])
        );
        let mut turns = 0..10_000;
        let proposal = loop {
            assert!(turns.next().is_some(), "{number}: no proposal");
            now = head.poll_timeout().unwrap();
            head.handle_timeout(now);
            let out = sent(&mut head, now);
            // Its neighbour answers; alone the leader would propose nothing.
            for (port, said) in &out {
                if let Said::Heartbeat {
                    mission,
                    request: ask,
                    ..
                } = said
                {
                    let answer = Said::Heartbeat {
                        mission: *mission,
                        request: 0,
                        reply: *ask,
                    };
                    head.handle_bytes(now, *port, &framed(1, *port, &answer));
                }
            }
            let proposal = out
                .into_iter()
                .find(|(_, said)| matches!(said, Said::Proposal(_)));
            if let Some(proposal) = proposal {
                break proposal;
            }
        };
        let wait = now.since(since).as_micros();
        let least = 5_000_000 << (number - 1).min(3);
        assert!(
            (least..=least / 8 * 9 + 2).contains(&wait),
            "{number}: {wait}"
        );
        let left = 15_000_000_u64.saturating_sub(now.as_micros());
        let next = Proposed {
            lease_left: u16::try_from(left.div_ceil(100_000)).unwrap(),
            ..proposed(id(number + 1, 1), (mission, 0), 1, 8)
        };
        assert_eq!(proposal, (Port::Downstream, Said::Proposal(next)));
    }
}

#[test]
fn a_hello_is_answered_by_a_hello_if_it_asks_for_one() {
    let now = Instant::ZERO;
    for (asks, newest) in [(false, 0), (true, 0), (true, id(6, 2))] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let mission = digest(relay.mission());
        let flags = if asks { ASKS } else { 0 };
        let hello = a_hello(newest, mission, 4, flags);
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &hello));
        let out = soon(&mut relay, now);
        let answer = long(1, hearing(1, a_hello(newest, mission, 3, FRESH)));
        let expected = asks.then_some((Port::Upstream, answer));
        assert_eq!(out, expected.into_iter().collect::<Vec<_>>());
        assert_eq!(counted(relay.stats()), ["received"]);
    }
}

/// Checks that a view number far ahead is approached in steps. It could be the last possible one.
#[test]
fn a_view_far_ahead_is_reached_step_by_step() {
    let now = Instant::ZERO;
    for (number, reached) in [(255, 255), (256, 256), (257, 256), (4_194_303, 256)] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let mission = digest(relay.mission());
        let newest = id(number, 2);
        let hello = a_hello(newest, mission, 4, ASKS);
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &hello));
        let known = id(reached, 2);
        let answer = long(1, hearing(1, a_hello(known, mission, 3, FRESH)));
        assert_eq!(
            soon(&mut relay, now),
            [(Port::Upstream, answer)],
            "{number}"
        );
    }
}

#[test]
fn more_relays_than_the_mission_has_are_stale() {
    let now = Instant::ZERO;
    for place in [1, 7, 8, 9, 999, 1000] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let mission = digest(relay.mission());
        let (view, of) = (id(1, 1), (mission, 0));
        let proposal = Said::Proposal(Proposed {
            votes: place.min(8),
            ..proposed(view, of, place, 8)
        });
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
        if place > 7 {
            assert_eq!(counted(relay.stats()), ["received", "stale"], "{place}");
            assert_eq!(sent(&mut relay, now), []);
            continue;
        }
        assert_eq!(counted(relay.stats()), ["received"], "{place}");
        assert_eq!(sent(&mut relay, now).len(), 1);
        let decision = granted(view, of, place + 1, 9);
        relay.handle_bytes(
            now,
            Port::Downstream,
            &framed(4, Port::Downstream, &decision),
        );
        assert_eq!(counted(relay.stats()), ["received", "stale"], "{place}");
        assert_eq!(relay.mission().relays(), 8);
    }
}
