//! How a chain forms anew, frame by frame: hellos, a proposal through three relays, the decision back, and what is refused.

use host_tests::fixtures::{NETWORK, paper};
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::Header;
use uav_relay::{
    Duration, Event, Identity, Instant, Mission, Phase, Port, Relay, Settings, ViewId, Wiring,
};

use super::codec::{Call, Decided, Greeting, Proposed, Said, SizedView, plain, wire};
use super::kinds::{FIRST, framed, one_of_each, sent};
use super::receive::{counted, relay};

pub(crate) const ASKS: u8 = 1;
pub(crate) const FORMS: u8 = 2;
pub(crate) const FRESH: u8 = 4;
pub(crate) const READY: u8 = 8;
pub(crate) const FLIES: u8 = 16;

/// What node `sender` says to node `destination`, on network 7.
pub(crate) fn between(sender: u16, destination: u16, said: &Said) -> Vec<u8> {
    let header = Header {
        network: NETWORK,
        sender,
        destination,
        counter: 0,
    };
    wire(&plain(header, &said.body()))
}

/// The view of that number which `node` proposes.
pub(crate) const fn id(number: u32, node: u16) -> u32 {
    number << 10 | node as u32
}

/// What a view adds to the digest of the mission that it flies.
pub(crate) fn mark(view: u32) -> u16 {
    let low = view & 0xFFFF;
    let (top, next) = (view >> 24, view >> 16 & 0xFF);
    u16::try_from((low + (next << 8) + top) & 0xFFFF).unwrap()
}

/// How long a relay that has just been switched on may be relied on, in tenths of a second: for `dead_after`.
pub(crate) const RELIED: u16 = 150;

/// What the relay at `place` hands on of a proposal of `view`, where all up to there have just been switched on and are members of
/// the chain of `relays` as it was loaded.
pub(crate) fn proposed(view: u32, of: (u16, u16), place: u16, relays: u16) -> Proposed {
    Proposed {
        call: Call { of, view, place },
        agreed: SizedView { id: 0, relays },
        votes: place,
        lease_left: RELIED,
        rest: 0,
        proposer: true,
        successor: None,
    }
}

/// The decision for the view that was proposed, of so many relays, whose places are to be taken at once.
pub(crate) fn granted(view: u32, of: (u16, u16), place: u16, relays: u16) -> Said {
    Said::Decision(Decided {
        call: Call { of, view, place },
        base: SizedView { id: 0, relays },
        view: Some(SizedView { id: view, relays }),
        there: relays,
        lease_left: 0,
    })
}

/// The decision that `there` of eight relays are too few.
pub(crate) fn refused(view: u32, of: (u16, u16), place: u16, there: u16) -> Said {
    Said::Decision(Decided {
        call: Call { of, view, place },
        base: SizedView { id: 0, relays: 8 },
        view: None,
        there,
        lease_left: 0,
    })
}

/// The hello of a node that hears nobody, flies the mission that was loaded before flight, and has no other.
pub(crate) fn a_hello(newest: u32, mission: u16, neighbour: u16, flags: u8) -> Said {
    Said::Hello(Greeting {
        mission,
        neighbour,
        behind: 1,
        newest,
        holds: (mission, 0),
        nonce: 0,
        hears: 0,
        flags: flags | FLIES,
    })
}

/// The same hello of a node that hears these, bit 0 for the nearest.
pub(crate) fn hearing(hears: u8, said: Said) -> Said {
    match said {
        Said::Hello(greeting) => Said::Hello(Greeting { hears, ..greeting }),
        other => other,
    }
}

/// The same hello of a node from which so many relays hang together on, itself included.
pub(crate) fn long(behind: u16, said: Said) -> Said {
    match said {
        Said::Hello(greeting) => Said::Hello(Greeting { behind, ..greeting }),
        other => other,
    }
}

/// What a relay with a key says, but for the number of a hello, which is never 0 there.
pub(crate) fn unnumbered(mut said: Said) -> Said {
    if let Said::Hello(greeting) = &mut said {
        assert_ne!(greeting.nonce, 0);
        greeting.nonce = 0;
    }
    said
}

/// What `relay` sends at `now` or a millisecond later.
pub(crate) fn soon(relay: &mut Relay, now: Instant) -> Vec<(Port, Said)> {
    let mut out = sent(relay, now);
    let later = now + Duration::from_millis(1);
    relay.handle_timeout(later);
    out.extend(sent(relay, later));
    out
}

pub(crate) fn events(relay: &mut Relay) -> Vec<Event> {
    std::iter::from_fn(|| relay.poll_event()).collect()
}

/// The one message that `relay` sends at `now`.
pub(crate) fn only(relay: &mut Relay, now: Instant) -> (Port, Said) {
    let mut out = sent(relay, now);
    let said = out.pop().unwrap();
    assert!(out.is_empty(), "{out:?}");
    said
}

#[test]
fn a_proposal_goes_through_three_relays_and_the_decision_back() {
    let mut chain: Vec<Relay> = (1..=3).map(|own| relay(own, 3, Wiring::Pair)).collect();
    let [head, middle, tail] = &mut chain[..] else {
        panic!("three relays");
    };
    let mission = digest(head.mission());
    let now = Instant::ZERO;
    // Somebody wants a view: the head, whom nobody is before, proposes the first one.
    let hello = a_hello(0, mission, 1, FORMS | READY);
    head.handle_bytes(now, Port::Downstream, &framed(1, Port::Downstream, &hello));
    let view = id(1, 1);
    let proposal = |place| Said::Proposal(proposed(view, (mission, 0), place, 3));
    let decision = |place| granted(view, (mission, 0), place, 3);
    assert_eq!(soon(head, now), [(Port::Downstream, proposal(1))]);
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(only(middle, now), (Port::Downstream, proposal(2)));
    assert_eq!(middle.view(), ViewId::LOADED, "not before it is decided");
    // It comes again: what has become of it is not known yet.
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    let busy = Said::Busy { number: mark(view) };
    assert_eq!(only(middle, now), (Port::Upstream, busy));
    tail.handle_bytes(now, Port::Upstream, &between(2, 3, &proposal(2)));
    assert_eq!(only(tail, now), (Port::Upstream, decision(3)));
    middle.handle_bytes(now, Port::Downstream, &between(3, 2, &decision(3)));
    assert_eq!(only(middle, now), (Port::Upstream, decision(2)));
    // The answer was lost: it is given again.
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(only(middle, now), (Port::Upstream, decision(2)));
    head.handle_bytes(now, Port::Downstream, &between(2, 1, &decision(2)));
    for (relay, index) in [head, middle, tail].into_iter().zip(1..) {
        assert_eq!((relay.view().bits(), relay.index()), (view, index));
        assert_eq!(relay.stats().views, 1);
        assert_eq!(relay.lease(), None, "nothing to hold yet");
        assert_eq!(events(relay), [Event::Reformed]);
        assert_eq!(relay.stats().rejected(), 0);
    }
}

#[test]
fn a_decision_that_is_not_awaited_is_stale() {
    let now = Instant::ZERO;
    let mut waiting = relay(4, 8, Wiring::Pair);
    let mission = digest(waiting.mission());
    let (view, of) = (id(2, 1), (mission, 0));
    let proposal = Said::Proposal(proposed(view, of, 3, 8));
    waiting.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
    sent(&mut waiting, now);
    for (decided, place, relays) in [
        (view, 4, 8),
        (view, 6, 8),
        (id(1, 1), 5, 8),
        (id(3, 1), 5, 8),
        (id(2, 2), 5, 8),
        // Fewer than it has come through so far.
        (view, 5, 4),
        (view, 5, 1),
    ] {
        let mut after = waiting.clone();
        let decision = granted(decided, of, place, relays);
        after.handle_bytes(
            now,
            Port::Downstream,
            &framed(4, Port::Downstream, &decision),
        );
        assert_eq!(
            counted(after.stats()),
            ["received", "stale"],
            "{decision:?}"
        );
        assert_eq!(after.view(), ViewId::LOADED);
        assert_eq!(sent(&mut after, now), []);
    }
    let decision = granted(view, of, 5, 5);
    waiting.handle_bytes(
        now,
        Port::Downstream,
        &framed(4, Port::Downstream, &decision),
    );
    assert_eq!(
        (waiting.view().bits(), waiting.mission().relays()),
        (view, 5)
    );
    // Once more.
    waiting.handle_bytes(
        now,
        Port::Downstream,
        &framed(4, Port::Downstream, &decision),
    );
    assert_eq!(waiting.stats().stale, 1);
}

/// Relay 20 of 20, the last.
fn last_of_20(quorum: bool) -> (Relay, u16) {
    let mission = Mission::try_new(paper(20)).unwrap();
    let identity = Identity {
        network: NETWORK,
        index: 20,
    };
    let settings = Settings {
        quorum,
        ..Settings::default()
    };
    let relay = Relay::new(mission, identity, settings, 1, Instant::ZERO).unwrap();
    let mission = digest(relay.mission());
    (relay, mission)
}

/// What it decides on a proposal that says this.
fn decided_by(last: &mut Relay, proposal: Proposed) -> Decided {
    let now = Instant::ZERO;
    let proposal = Said::Proposal(proposal);
    last.handle_bytes(now, Port::Upstream, &framed(20, Port::Upstream, &proposal));
    match only(last, now) {
        (Port::Upstream, Said::Decision(decided)) => decided,
        other => panic!("{other:?}"),
    }
}

/// It takes more than half of the members of the view before, or half of them with the one that proposed it; who is there beside them
/// does not matter.
#[test]
fn more_than_half_is_a_chain_and_half_of_it_with_its_proposer() {
    for quorum in [true, false] {
        let (last, mission) = last_of_20(quorum);
        for relays in 1..=20 {
            for votes in 0..=relays {
                for proposer in [false, true] {
                    // A view that is newer than the one that the last relay knows itself, which is no member of it.
                    let proposal = Proposed {
                        agreed: SizedView {
                            id: id(8, 3),
                            relays,
                        },
                        votes,
                        lease_left: 77,
                        proposer,
                        ..proposed(id(9, 1), (mission, 0), 11, 20)
                    };
                    let mut last = last.clone();
                    let decided = decided_by(&mut last, proposal);
                    let enough = 2 * votes + u16::from(proposer) > relays || !quorum;
                    let all = votes == relays;
                    let expected = Decided {
                        call: Call {
                            place: 12,
                            ..proposal.call
                        },
                        base: proposal.agreed,
                        view: enough.then_some(SizedView {
                            id: id(9, 1),
                            relays: 12,
                        }),
                        there: 12,
                        // Somebody who is not here may hold the view before for as long.
                        lease_left: if all { 0 } else { 77 },
                    };
                    assert_eq!(decided, expected, "{votes} of {relays}, {proposer}");
                    let (event, view) = if enough {
                        (Event::Reformed, id(9, 1))
                    } else {
                        (Event::NoQuorum, 0)
                    };
                    assert_eq!(events(&mut last), [event]);
                    assert_eq!(last.view().bits(), view);
                }
            }
        }
    }
}

/// A member of the view agreed on adds its voice, and the time for which it may be relied on where that is less.
#[test]
fn a_member_adds_its_voice() {
    let (last, mission) = last_of_20(true);
    for (votes, lease_left) in [(10, 30), (10, 400), (9, 30)] {
        let proposal = Proposed {
            votes,
            lease_left,
            proposer: false,
            ..proposed(id(9, 2), (mission, 0), 10, 20)
        };
        let decided = decided_by(&mut last.clone(), proposal);
        let view = SizedView {
            id: id(9, 2),
            relays: 11,
        };
        assert_eq!(
            decided.view,
            (votes == 10).then_some(view),
            "11 of 20 or 10"
        );
        assert_eq!(decided.lease_left, lease_left.min(RELIED));
    }
}

/// What a member has accepted may have been agreed on: it is decided on again, and nobody is in another view before the next proposal.
#[test]
fn what_may_have_been_agreed_on_is_decided_on_again() {
    let (mut last, mission) = last_of_20(true);
    let now = Instant::ZERO;
    let before = SizedView {
        id: id(4, 3),
        relays: 17,
    };
    let proposal = Proposed {
        successor: Some((id(6, 2), before)),
        ..proposed(id(9, 1), (mission, 0), 11, 20)
    };
    let decided = decided_by(&mut last, proposal);
    assert_eq!(decided.view, Some(before));
    assert_eq!((last.view(), events(&mut last)), (ViewId::LOADED, vec![]));
    // It has accepted that view, too, by this proposal, and says so from now on, if nobody says so of a later one.
    for (told, expected) in [
        (None, before),
        (
            Some((
                id(8, 2),
                SizedView {
                    relays: 9,
                    ..before
                },
            )),
            before,
        ),
        (
            Some((
                id(9, 1),
                SizedView {
                    relays: 9,
                    ..before
                },
            )),
            SizedView {
                relays: 9,
                ..before
            },
        ),
        (
            Some((
                id(9, 2),
                SizedView {
                    relays: 8,
                    ..before
                },
            )),
            SizedView {
                relays: 8,
                ..before
            },
        ),
    ] {
        let proposal = Proposed {
            successor: told,
            ..proposed(id(10, 1), (mission, 0), 11, 20)
        };
        let decided = decided_by(&mut last.clone(), proposal);
        assert_eq!(decided.view, Some(expected), "{told:?}");
    }
    // The leader proposes anew from there.
    let mut head = relay(1, 8, Wiring::Pair);
    let mission = digest(head.mission());
    let hello = a_hello(0, mission, 1, FORMS | READY);
    head.handle_bytes(now, Port::Downstream, &framed(1, Port::Downstream, &hello));
    soon(&mut head, now);
    let before = SizedView {
        id: id(1, 2),
        relays: 7,
    };
    let decision = Said::Decision(Decided {
        call: Call {
            of: (mission, 0),
            view: id(1, 1),
            place: 2,
        },
        base: SizedView { id: 0, relays: 8 },
        view: Some(before),
        there: 8,
        lease_left: 40,
    });
    head.handle_bytes(
        now,
        Port::Downstream,
        &framed(1, Port::Downstream, &decision),
    );
    assert_eq!(head.view(), ViewId::LOADED);
    assert_eq!(counted(head.stats()), ["received"]);
    // All have accepted it now, so it was agreed on: its members decide on the next one, and this relay is none of them, as it was
    // not in the proposal of it.
    let next = Proposed {
        agreed: before,
        votes: 0,
        lease_left: u16::MAX,
        rest: u16::MAX,
        proposer: false,
        ..proposed(id(2, 1), (mission, 0), 1, 8)
    };
    let now = now + Duration::from_millis(1);
    assert_eq!(
        soon(&mut head, now),
        [(Port::Downstream, Said::Proposal(next))]
    );
}

/// The middle of a part that is too small to go on: it holds, hands that back, and asks for nothing any more.
#[test]
fn a_part_that_is_cut_off_stops_calling() {
    let mut relay = relay(4, 8, Wiring::Pair);
    let mission = digest(relay.mission());
    let mut now = Instant::ZERO;
    // It calls: it has missed a beginning.
    let sweep = &one_of_each(FIRST + 1, mission)[0];
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, sweep));
    // Fresh: nothing hangs together from it on yet.
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

/// Somebody may be back who could not be heard: its leader proposes again every `probe_after` and up to an eighth more.
#[test]
fn a_leader_whose_part_is_cut_off_holds_and_proposes_again_and_again() {
    let mut head = relay(1, 8, Wiring::Pair);
    let mission = digest(head.mission());
    let mut now = Instant::ZERO;
    let hello = a_hello(0, mission, 1, FORMS | READY);
    head.handle_bytes(now, Port::Downstream, &framed(1, Port::Downstream, &hello));
    soon(&mut head, now);
    for number in 1..=5 {
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
        let proposal = loop {
            now = head.poll_timeout().unwrap();
            head.handle_timeout(now);
            let out = sent(&mut head, now);
            let proposal = out
                .into_iter()
                .find(|(_, said)| matches!(said, Said::Proposal(_)));
            if let Some(proposal) = proposal {
                break proposal;
            }
        };
        let wait = now.since(since).as_micros();
        assert!((5_000_000..=5_625_002).contains(&wait), "{wait}");
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

/// A view far ahead of all that were heard of is not believed: it could be the last there can be.
#[test]
fn a_view_too_far_ahead_is_not_heard_of() {
    let now = Instant::ZERO;
    for (number, believed) in [(256, true), (257, false), (4_194_303, false)] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let mission = digest(relay.mission());
        let newest = id(number, 2);
        let hello = a_hello(newest, mission, 4, ASKS);
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &hello));
        let known = if believed { newest } else { 0 };
        let answer = long(1, hearing(1, a_hello(known, mission, 3, FRESH)));
        assert_eq!(
            soon(&mut relay, now),
            [(Port::Upstream, answer)],
            "{number}"
        );
    }
}

/// No chain has more relays than its mission, and no relay says what none would read.
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
