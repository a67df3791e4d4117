//! Relay in a view: accepted digests, stale messages, and forwarded requests.

use uav_relay::wire::digest::digest;
use uav_relay::{Duration, Event, Instant, Port, Relay, Wiring};

use super::codec::{Proposed, Said, SizedView};
use super::kinds::{FIRST, framed, one_of_each, sent};
use super::receive::{counted, relay};
use super::votes::{
    ASKS, FORMS, FRESH, a_hello, events, granted, hearing, id, long, mark, proposed, soon,
};

/// Returns an idle relay `own` that has accepted `view` of all eight relays, and its mission's digest.
fn in_view(own: u16, view: u32) -> (Relay, u16) {
    let mut relay = relay(own, 8, Wiring::Pair);
    let mission = digest(relay.mission());
    let proposal = Said::Proposal(proposed(view, (mission, 0), own - 1, 8));
    let decision = granted(view, (mission, 0), own + 1, 8);
    for (port, said) in [(Port::Upstream, &proposal), (Port::Downstream, &decision)] {
        relay.handle_bytes(Instant::ZERO, port, &framed(own, port, said));
        sent(&mut relay, Instant::ZERO);
    }
    events(&mut relay);
    assert_eq!(relay.view().bits(), view);
    (relay, mission)
}

/// Returns relay `own` of 8 in `view`, idle after the agreement on positions in it.
fn agreed_in_view(own: u16, view: u32) -> (Relay, u16) {
    let (mut relay, mission) = in_view(own, view);
    let digest = mission.wrapping_add(mark(view));
    for (kind, port) in [(0, Port::Upstream), (1, Port::Downstream)] {
        let said = &one_of_each(FIRST, digest)[kind];
        relay.handle_bytes(Instant::ZERO, port, &framed(own, port, said));
        while relay
            .poll_timeout()
            .is_some_and(|due| due < Instant::from_millis(5))
        {
            relay.handle_timeout(Instant::from_millis(5));
        }
        sent(&mut relay, Instant::from_millis(5));
    }
    assert!(events(&mut relay).contains(&Event::Converged));
    (relay, mission)
}

/// Checks that another digest means another view or mission, which a hello tells apart.
#[test]
fn passes_bear_the_digest_of_their_view_and_what_forms_views_that_of_the_mission() {
    let now = Instant::ZERO;
    for view in [id(1, 1), id(300, 7), id(4_194_303, 1000)] {
        let (relay, mission) = in_view(4, view);
        let own = mission.wrapping_add(mark(view));
        let hello = |neighbour: u16| {
            let behind = if neighbour == 3 { 5 } else { 4 };
            long(behind, hearing(1, a_hello(view, mission, neighbour, ASKS)))
        };
        for off in [0, 1, 64, 0xFFC0, 65, 0xFFBF, 0x4000] {
            let known = off == 0;
            let expected = if known {
                &["received"][..]
            } else {
                &["received", "view"]
            };
            // Answers, and completions of a renewal, come from the other side.
            for (kind, port, neighbour) in [
                (0, Port::Upstream, 3),
                (15, Port::Upstream, 3),
                (1, Port::Downstream, 5),
                (16, Port::Downstream, 5),
            ] {
                // Renewals are for relays that have agreed on their positions.
                let mut after = if known && kind == 15 {
                    agreed_in_view(4, view).0
                } else {
                    relay.clone()
                };
                let said = &one_of_each(FIRST, own.wrapping_add(off))[kind];
                after.handle_bytes(now, port, &framed(4, port, said));
                let stale = known && neighbour == 5;
                let mut expected = expected.to_vec();
                expected.extend(stale.then_some("stale"));
                assert_eq!(counted(after.stats()), expected, "{view:x}, {off}, {kind}");
                let out = soon(&mut after, now);
                if known {
                    let hellos = out
                        .iter()
                        .filter(|(_, said)| matches!(said, Said::Hello(_)));
                    assert_eq!(hellos.count(), 0, "{out:?}");
                } else {
                    assert_eq!(out, [(port, hello(neighbour))], "{view:x}, {off}, {kind}");
                }
            }
        }
    }
}

/// Checks passes of another view from a neighbour with equal mission: the relay requests a new view.
#[test]
fn a_pass_of_another_view_has_the_relay_ask_for_one() {
    let now = Instant::ZERO;
    let view = id(2, 1);
    let (mut relay, mission) = in_view(4, view);
    let own = mission.wrapping_add(mark(view));
    for (port, from) in [(Port::Upstream, 4), (Port::Downstream, 4)] {
        let hello = a_hello(0, mission, from, 0);
        relay.handle_bytes(now, port, &framed(4, port, &hello));
    }
    sent(&mut relay, now);
    for (kind, port, calls) in [
        (0, Port::Upstream, true),
        (8, Port::Upstream, true),
        (15, Port::Upstream, true),
        (1, Port::Downstream, false),
        (16, Port::Downstream, false),
    ] {
        let mut after = relay.clone();
        let said = &one_of_each(FIRST, own.wrapping_add(1))[kind];
        after.handle_bytes(now, port, &framed(4, port, said));
        let called = soon(&mut after, now).iter().any(|(port, said)| {
            *port == Port::Upstream
                && matches!(said, Said::Hello(hello) if hello.flags & FORMS != 0)
        });
        assert_eq!(called, calls, "{said:?}");
    }
}

#[test]
fn heartbeats_bear_the_digest_of_the_mission_in_every_view() {
    let view = id(7, 1);
    let (mut relay, mission) = in_view(4, view);
    for (mission, expected) in [(mission, 0), (mission.wrapping_add(mark(view)), 1)] {
        let beat = Said::Heartbeat {
            mission,
            request: 0,
            reply: 0,
        };
        relay.handle_bytes(
            Instant::ZERO,
            Port::Upstream,
            &framed(4, Port::Upstream, &beat),
        );
        assert_eq!(relay.stats().mission, expected);
    }
}

#[test]
fn a_late_proposal_of_an_old_view_changes_nothing_and_a_leader_that_insists_hears_of_the_newest() {
    let (mut relay, mission) = in_view(4, id(5, 2));
    let mut now = Instant::ZERO;
    let of = (mission, 0);
    // View 5 from another place than before.
    for (nth, view, place) in [(1, id(5, 2), 2), (2, id(5, 1), 3), (3, id(3, 9), 3)] {
        let proposal = Said::Proposal(proposed(view, of, place, 8));
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
        assert_eq!(soon(&mut relay, now), []);
        now = now + Duration::from_millis(1);
        assert_eq!((relay.stats().stale, relay.view().bits()), (nth, id(5, 2)));
        assert_eq!((relay.index(), relay.mission().relays()), (4, 8));
        assert_eq!(events(&mut relay), []);
    }
    let proposal = Said::Proposal(proposed(id(4, 1), of, 3, 8));
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
    let hello = long(5, hearing(1, a_hello(id(6, 4), mission, 3, ASKS | FORMS)));
    assert_eq!(soon(&mut relay, now), [(Port::Upstream, hello)]);
    assert_eq!((relay.stats().stale, relay.view().bits()), (4, id(5, 2)));
}

#[test]
fn a_hello_that_calls_goes_on_toward_the_leader_unless_it_is_of_an_older_view() {
    let now = Instant::ZERO;
    let view = id(3, 2);
    let (relay, mission) = in_view(4, view);
    for (newest, fresh, calls) in [
        (view, false, true),
        (id(3, 3), false, true),
        (id(4, 1), false, true),
        (id(3, 1), false, false),
        (id(2, 9), false, false),
        (0, false, false),
        (0, true, true),
    ] {
        let mut after = relay.clone();
        let flags = FORMS | if fresh { FRESH } else { 0 };
        let hello = a_hello(newest, mission, 4, flags);
        after.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, &hello));
        let known = newest.max(view);
        let on = long(5, hearing(1, a_hello(known, mission, 3, ASKS | FORMS)));
        let expected = calls.then_some((Port::Upstream, on));
        assert_eq!(
            soon(&mut after, now),
            expected.into_iter().collect::<Vec<_>>(),
            "{newest:x} {fresh}"
        );
    }
}

/// Checks that an accepted view counts only after a pass or renewal in it: all have then accepted it.
#[test]
fn a_view_counts_once_something_that_was_begun_in_it_has_come() {
    let now = Instant::ZERO;
    let view = id(3, 2);
    let (relay, mission) = in_view(4, view);
    let own = mission.wrapping_add(mark(view));
    let accepted = SizedView {
        id: view,
        relays: 8,
    };
    for begun in [None, Some(0), Some(15)] {
        let mut after = relay.clone();
        if let Some(kind) = begun {
            let said = &one_of_each(FIRST, own)[kind];
            after.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, said));
            sent(&mut after, now);
        }
        let told = proposed(id(4, 1), (mission, 0), 3, 8);
        let proposal = framed(4, Port::Upstream, &Said::Proposal(told));
        after.handle_bytes(now, Port::Upstream, &proposal);
        let expected = if begun.is_some() {
            Proposed {
                agreed: accepted,
                votes: 1,
                proposer: false,
                ..proposed(id(4, 1), (mission, 0), 4, 8)
            }
        } else {
            Proposed {
                successor: Some((view, accepted)),
                ..proposed(id(4, 1), (mission, 0), 4, 8)
            }
        };
        let on = (Port::Downstream, Said::Proposal(expected));
        assert_eq!(sent(&mut after, now), [on], "{begun:?}");
    }
}

/// Checks lease renewals: the next one grants the lease, and its expiry causes a view request.
#[test]
fn a_lease_is_granted_by_the_next_pulse_and_runs_out() {
    let view = id(3, 2);
    let (mut relay, mission) = agreed_in_view(4, view);
    let own = mission.wrapping_add(mark(view));
    let pulse = |number| Said::Pulse {
        number,
        view_digest: own,
        lease: 160,
    };
    let pulsed = |number, done| Said::Pulsed {
        number,
        view_digest: own,
        done,
    };
    let at = Instant::from_millis;
    let hear = |relay: &mut Relay, ms, port, said: &Said| {
        relay.handle_bytes(at(ms), port, &framed(4, port, said));
        sent(relay, at(ms))
    };
    let (up, down) = (Port::Upstream, Port::Downstream);
    assert_eq!(hear(&mut relay, 10, up, &pulse(9)), [(down, pulse(9))]);
    assert_eq!(
        hear(&mut relay, 15, up, &pulse(9)),
        [(up, pulsed(9, false))]
    );
    assert_eq!(hear(&mut relay, 20, down, &pulsed(9, false)), []);
    assert_eq!(relay.stats().repeated, 1);
    assert_eq!(
        hear(&mut relay, 30, down, &pulsed(9, true)),
        [(up, pulsed(9, true))]
    );
    assert_eq!(hear(&mut relay, 35, up, &pulse(9)), [(up, pulsed(9, true))]);
    assert_eq!(
        relay.lease(),
        None,
        "the others may not have taken part yet"
    );
    // Other messages are stale.
    for (port, said) in [
        (up, pulse(8)),
        (down, pulsed(9, true)),
        (down, pulsed(8, true)),
    ] {
        let before = relay.stats().stale;
        assert_eq!(hear(&mut relay, 40, port, &said), []);
        assert_eq!(relay.stats().stale, before + 1, "{said:?}");
    }
    assert_eq!(hear(&mut relay, 50, up, &pulse(10)), [(down, pulse(10))]);
    assert_eq!(
        relay.lease(),
        Some(at(10 + 16_000)),
        "from when it was handed on"
    );
    // A renewal out of sequence grants no lease.
    assert_eq!(hear(&mut relay, 60, up, &pulse(50)), [(down, pulse(50))]);
    assert_eq!(relay.lease(), Some(at(16_010)));
    let mut now = at(60);
    while relay.lease().is_some() {
        now = relay.poll_timeout().unwrap();
        relay.handle_timeout(now);
        sent(&mut relay, now);
    }
    assert_eq!(now, at(16_010));
    assert!(events(&mut relay).contains(&Event::LeaseLapsed));
    let calls = soon(&mut relay, now).iter().any(|(port, said)| {
        *port == up && matches!(said, Said::Hello(hello) if hello.flags & FORMS != 0)
    });
    assert!(calls, "it asks for a view");
}
