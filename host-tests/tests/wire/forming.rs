//! Formation of a chain frame by frame: hellos, proposal, decision, and refusals.

use host_tests::fixtures::{NETWORK, paper};
use uav_relay::wire::digest::digest;
use uav_relay::{
    Duration, Event, Identity, Instant, Mission, Port, Relay, Settings, ViewId, Wiring,
};

use super::codec::{Call, Decided, Proposed, Said, SizedView};
use super::kinds::{framed, sent};
use super::receive::{counted, relay};
use super::votes::*;

#[test]
fn a_proposal_goes_through_three_relays_and_the_decision_back() {
    let mut chain: Vec<Relay> = (1..=3).map(|own| relay(own, 3, Wiring::Pair)).collect();
    let [head, middle, tail] = &mut chain[..] else {
        panic!("three relays");
    };
    let mission = digest(head.mission());
    let now = Instant::ZERO;
    // A view is requested: the head, which has no predecessor, proposes the first one.
    let hello = a_hello(0, mission, 1, FORMS | READY);
    head.handle_bytes(now, Port::Downstream, &framed(1, Port::Downstream, &hello));
    let view = id(1, 1);
    let proposal = |place| Said::Proposal(proposed(view, (mission, 0), place, 3));
    let decision = |place| granted(view, (mission, 0), place, 3);
    assert_eq!(soon(head, now), [(Port::Downstream, proposal(1))]);
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(only(middle, now), (Port::Downstream, proposal(2)));
    assert_eq!(middle.view(), ViewId::LOADED, "not before it is decided");
    // The proposal is repeated while its result is unknown.
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    let busy = Said::Busy { number: mark(view) };
    assert_eq!(only(middle, now), (Port::Upstream, busy));
    tail.handle_bytes(now, Port::Upstream, &between(2, 3, &proposal(2)));
    assert_eq!(only(tail, now), (Port::Upstream, decision(3)));
    middle.handle_bytes(now, Port::Downstream, &between(3, 2, &decision(3)));
    assert_eq!(only(middle, now), (Port::Upstream, decision(2)));
    // The answer was lost and is repeated.
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(only(middle, now), (Port::Upstream, decision(2)));
    head.handle_bytes(now, Port::Downstream, &between(2, 1, &decision(2)));
    for (relay, index) in [head, middle, tail].into_iter().zip(1..) {
        assert_eq!((relay.view().bits(), relay.index()), (view, index));
        assert_eq!(relay.stats().views, 1);
        assert_eq!(relay.lease(), None, "nothing to hold yet");
        assert_eq!(events(relay), [Event::ViewAccepted]);
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
        // The decision has fewer relays than the proposal has passed.
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
    waiting.handle_bytes(
        now,
        Port::Downstream,
        &framed(4, Port::Downstream, &decision),
    );
    assert_eq!(waiting.stats().stale, 1);
}

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

/// Returns the decision on a proposal.
fn decided_by(last: &mut Relay, proposal: Proposed) -> Decided {
    let now = Instant::ZERO;
    let proposal = Said::Proposal(proposal);
    last.handle_bytes(now, Port::Upstream, &framed(20, Port::Upstream, &proposal));
    match only(last, now) {
        (Port::Upstream, Said::Decision(decided)) => decided,
        other => panic!("{other:?}"),
    }
}

/// Checks the quorum: more than half of the earlier view's members, or half with its proposer.
#[test]
fn more_than_half_is_a_chain_and_half_of_it_with_its_proposer() {
    for quorum in [true, false] {
        let (last, mission) = last_of_20(quorum);
        for relays in 1..=20 {
            for votes in 0..=relays {
                for proposer in [false, true] {
                    // The view is newer than the last relay's own, which is no member of it.
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
                        reached: 12,
                        // A missing member may hold the earlier view for as long.
                        usable_in: if all { 0 } else { 77 },
                    };
                    assert_eq!(decided, expected, "{votes} of {relays}, {proposer}");
                    let (event, view) = if enough {
                        (Event::ViewAccepted, id(9, 1))
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

/// Checks that a member adds its vote, and its own lease if that is shorter.
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
        assert_eq!(decided.usable_in, lease_left.min(RELIED));
    }
}

/// Checks that an accepted view, which may have been agreed on, is decided again.
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
    // The relay has accepted that view by this proposal too, and reports it unless a later acceptance is reported.
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
    // The leader continues with the next proposal.
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
        reached: 8,
        usable_in: 40,
    });
    head.handle_bytes(
        now,
        Port::Downstream,
        &framed(1, Port::Downstream, &decision),
    );
    assert_eq!(head.view(), ViewId::LOADED);
    assert_eq!(counted(head.stats()), ["received"]);
    // All have accepted the view, so its members decide on the next one; this relay does not vote.
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
