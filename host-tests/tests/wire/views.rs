//! A relay in a view of the chain: which digests it takes, what is over for it, and whose call it hands on.

use uav_relay::wire::digest::digest;
use uav_relay::{Instant, Port, Relay, Wiring};

use super::codec::Said;
use super::forming::{ASKS, FORMS, FRESH, READY, a_hello, events, forming, soon};
use super::receive::{counted, relay};
use super::sequence::{FIRST, framed, one_of_each, sent};

/// Relay `own` of 8 with its part in view `view`, which relay 3 has handed it as one of eight; it has nothing to say.
fn in_view(own: u16, view: u16) -> (Relay, u16) {
    let mut relay = relay(own, 8, Wiring::Pair);
    let mission = digest(relay.mission());
    let proposal = Said::Proposal(forming(view, mission, [own - 1, 8, 0], 1));
    let count = Said::Decision(forming(view, mission, [own + 1, 8, 0], 0));
    for (port, said) in [(Port::Upstream, &proposal), (Port::Downstream, &count)] {
        relay.handle_bytes(Instant::ZERO, port, &framed(own, port, said));
        sent(&mut relay, Instant::ZERO);
    }
    events(&mut relay);
    assert_eq!(relay.view(), view);
    (relay, mission)
}

#[test]
fn passes_bear_the_digest_of_their_view_and_what_forms_views_that_of_the_mission() {
    let now = Instant::ZERO;
    for view in [1, 300] {
        let (relay, mission) = in_view(4, view);
        let own = mission.wrapping_add(view);
        for (off, expected) in [
            (0, &["received"][..]),
            (1, &["received", "view"]),
            (64, &["received", "view"]),
            (0xFFC0, &["received", "view"]),
            (65, &["mission", "received"]),
            (0xFFBF, &["mission", "received"]),
        ] {
            let mut after = relay.clone();
            let sweep = &one_of_each(FIRST, own.wrapping_add(off))[0];
            after.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, sweep));
            assert_eq!(counted(after.stats()), expected, "view {view}, {off}");
            let calls = after.stats().view == 1;
            let hellos = soon(&mut after, now);
            let hellos = hellos.iter().filter(|(port, said)| {
                let forms = matches!(said, Said::Hello(hello) if hello.flags & FORMS != 0);
                *port == Port::Upstream && forms
            });
            assert_eq!(hellos.count() > 0, calls, "view {view}, {off}");
            // An answer calls for nothing: whoever gave it gets a hello, and with that the number of the view.
            let mut after = relay.clone();
            let verdict = &one_of_each(FIRST, own.wrapping_add(off))[1];
            after.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, verdict));
            let said = soon(&mut after, now);
            if calls {
                let hello = a_hello(view, mission, 5, READY);
                assert_eq!(said, [(Port::Downstream, hello)]);
            } else {
                assert_eq!(said, []);
            }
        }
    }
}

#[test]
fn heartbeats_bear_the_digest_of_the_mission_in_every_view() {
    let (mut relay, mission) = in_view(4, 7);
    for (mission, expected) in [(mission, 0), (mission.wrapping_add(7), 1)] {
        let beat = Said::Heartbeat {
            mission,
            answer: false,
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
    let (mut relay, mission) = in_view(4, 5);
    let now = Instant::ZERO;
    for (nth, number) in [(1, 5), (2, 3), (3, 4)] {
        // Number 5 from another place than the one it was agreed with.
        let proposal = Said::Proposal(forming(number, mission, [2, 8, 0], 1));
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
        assert_eq!(soon(&mut relay, now), []);
        assert_eq!((relay.stats().stale, relay.view()), (nth, 5));
        assert_eq!((relay.index(), relay.mission().relays()), (4, 8));
        assert_eq!(events(&mut relay), []);
    }
    let proposal = Said::Proposal(forming(4, mission, [3, 8, 0], 1));
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
    let hello = a_hello(6, mission, 3, ASKS | FORMS | READY);
    assert_eq!(soon(&mut relay, now), [(Port::Upstream, hello)]);
    assert_eq!((relay.stats().stale, relay.view()), (4, 5));
}

#[test]
fn a_hello_that_calls_goes_on_toward_the_leader_unless_it_is_of_an_older_view() {
    let now = Instant::ZERO;
    let (relay, mission) = in_view(4, 3);
    for (newest, fresh, calls) in [
        (3, false, true),
        (4, false, true),
        (2, false, false),
        (0, false, false),
        (0, true, true),
    ] {
        let mut after = relay.clone();
        let flags = FORMS | if fresh { FRESH } else { 0 };
        let hello = a_hello(newest, mission, 4, flags);
        after.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, &hello));
        let known = newest.max(3);
        let on = a_hello(known, mission, 3, ASKS | FORMS | READY);
        let expected = calls.then_some((Port::Upstream, on));
        assert_eq!(
            soon(&mut after, now),
            expected.into_iter().collect::<Vec<_>>(),
            "{newest} {fresh}"
        );
    }
}
