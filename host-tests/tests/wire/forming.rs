//! Formation of a chain frame by frame: hellos, proposal, decision, and refusals.

use host_tests::fixtures::paper;
use serde_json::json;
use uav_relay::{Event, Port, Settings, ViewId, Wiring};

use super::bench::Bench;
use super::kinds::one_of_each;
use super::message::WireMessage;
use super::votes::*;

#[test]
fn a_proposal_passes_three_relays_and_the_decision_returns() {
    let mut chain = [1, 2, 3].map(|own| Bench::new(own, 3, Wiring::Pair));
    let [head, middle, tail] = &mut chain;
    let (up, down) = (Port::Upstream, Port::Downstream);
    let mission = head.mission;
    let view = id(1, 1);
    let proposal = |place| proposed(view, (mission, 0), place, 3);
    let decision = |place| granted(view, (mission, 0), place, 3);
    // A view is requested: the head, which has no predecessor, proposes the first one.
    let mut out = head.receive(down, &loaded_hello(0, mission, 1, FORMS | READY));
    out.extend(head.advance_1_ms());
    assert_eq!(out, [(down, proposal(1))]);
    assert_eq!(middle.receive(up, &proposal(1)), [(down, proposal(2))]);
    assert_eq!(middle.view(), ViewId::LOADED, "not before it is decided");
    // The proposal is repeated while its result is unknown.
    let busy = &one_of_each(mark(view), mission)[2];
    assert_eq!(middle.receive(up, &proposal(1)), [(up, busy.clone())]);
    assert_eq!(tail.receive(up, &proposal(2)), [(up, decision(3))]);
    assert_eq!(middle.receive(down, &decision(3)), [(up, decision(2))]);
    // The answer was lost and is repeated.
    assert_eq!(middle.receive(up, &proposal(1)), [(up, decision(2))]);
    head.receive(down, &decision(2));
    for (bench, index) in chain.iter_mut().zip(1..) {
        assert_eq!((bench.view().bits(), bench.index()), (view, index));
        assert_eq!(bench.stats().views, 1);
        assert_eq!(bench.lease(), None, "nothing to hold yet");
        assert_eq!(bench.events(), [Event::ViewAccepted]);
        assert_eq!(bench.stats().rejected(), 0);
    }
}

#[test]
fn a_decision_that_is_not_awaited_is_stale() {
    let mut waiting = Bench::new(4, 8, Wiring::Pair);
    let (view, of) = (id(2, 1), (waiting.mission, 0));
    waiting.receive(Port::Upstream, &proposed(view, of, 3, 8));
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
        assert_eq!(after.receive(Port::Downstream, &decision), []);
        assert_eq!(after.counted(), ["received", "stale"], "{decision:?}");
        assert_eq!(after.view(), ViewId::LOADED);
    }
    let decision = granted(view, of, 5, 5);
    waiting.receive(Port::Downstream, &decision);
    let (agreed, relays) = (waiting.view().bits(), waiting.mission().relays());
    assert_eq!((agreed, relays), (view, 5));
    waiting.receive(Port::Downstream, &decision);
    assert_eq!(waiting.stats().stale, 1);
}

fn last_of_20(quorum: bool) -> Bench {
    let settings = Settings {
        quorum,
        ..Settings::default()
    };
    Bench::with(paper(20), 20, settings)
}

/// Returns the decision with which the last relay, `last`, answers a proposal of a view.
fn decided_by(last: &mut Bench, proposal: &WireMessage) -> WireMessage {
    let mut out = last.receive(Port::Upstream, proposal);
    let (port, message) = out.pop().unwrap();
    assert!(out.is_empty() && port == Port::Upstream && message.is("Decision"));
    message
}

/// Checks that a quorum is over half of the earlier view's members, or half with the view's proposer. A view is the
/// agreed membership of the chain. The view's proposer must be among the half that votes.
#[test]
fn a_quorum_is_over_half_or_half_with_the_proposer() {
    for quorum in [true, false] {
        let last = last_of_20(quorum);
        let of = (last.mission, 0);
        let proposal = proposed(id(9, 1), of, 11, 20);
        for relays in 1..=20 {
            for votes in 0..=relays {
                for proposer in [false, true] {
                    // The earlier view, 8, is newer than the last relay's own view. The last relay is not its member.
                    let proposal = proposal.with(json!({
                        "agreed_view": id(8, 3), "agreed_relays": relays, "votes": votes,
                        "lease_left_ds": 77, "proposer": proposer,
                    }));
                    let mut last = last.clone();
                    let decided = decided_by(&mut last, &proposal);
                    let enough = 2 * votes + u16::from(proposer) > relays || !quorum;
                    let (event, view, decision) = if enough {
                        (Event::ViewAccepted, id(9, 1), granted(id(9, 1), of, 12, 12))
                    } else {
                        (Event::NoQuorum, 0, refused(id(9, 1), of, 12, 12))
                    };
                    // If a vote is missing, its member may rely on the earlier view for the rest of its lease.
                    let left = if votes == relays { 0 } else { 77 };
                    let expected = decision.with(json!({
                        "base_view": id(8, 3), "base_relays": relays, "usable_in_ds": left,
                    }));
                    assert_eq!(decided, expected, "{votes} of {relays}, {proposer}");
                    assert_eq!(last.events(), [event]);
                    assert_eq!(last.view().bits(), view);
                }
            }
        }
    }
}

/// Checks that a member of the earlier membership view adds its vote to a proposal.
///
/// If the member's own remaining lease is shorter than the remaining lease in the proposal, the member lowers the
/// value in the proposal.
#[test]
fn a_member_adds_its_vote() {
    let last = last_of_20(true);
    for (votes, lease_left) in [(10, 30), (10, 400), (9, 30)] {
        let proposal = proposed(id(9, 2), (last.mission, 0), 10, 20).with(json!({
            "votes": votes, "lease_left_ds": lease_left, "proposer": false,
        }));
        let decided = decided_by(&mut last.clone(), &proposal);
        let accepted = if votes == 10 {
            json!({ "view": id(9, 2), "relays": 11 })
        } else {
            json!(null)
        };
        let expected = decided.with(json!({
            "accepted": accepted, "usable_in_ds": lease_left.min(RELIED),
        }));
        assert_eq!(decided, expected, "11 of 20 or 10");
    }
}

/// Checks that the last relay decides for an earlier view if relays may have agreed on it already.
///
/// The view of the latest accepted proposal is proposed again, as in Paxos. A view is the agreed membership of the
/// chain.
#[test]
fn a_possibly_decided_view_is_proposed_again() {
    let mut last = last_of_20(true);
    let of = (last.mission, 0);
    // View (4, 3), of relay 3: the proposal in which it was accepted, and its number of relays.
    let successor = |proposal: u32, relays: u16| json!({ "proposal": proposal, "view": id(4, 3), "relays": relays });
    let accepts = |decided: &WireMessage, relays: u16| {
        let accepted = json!({ "view": id(4, 3), "relays": relays });
        assert_eq!(*decided, decided.with(json!({ "accepted": accepted })));
    };
    let proposal =
        proposed(id(9, 1), of, 11, 20).with(json!({ "successor": successor(id(6, 2), 17) }));
    accepts(&decided_by(&mut last, &proposal), 17);
    assert_eq!((last.view(), last.events()), (ViewId::LOADED, vec![]));
    // The relay has also accepted that view in proposal (9, 1). It reports this unless the new proposal reports an
    // acceptance that is as late or later.
    for (told, relays) in [
        (json!(null), 17),
        (successor(id(8, 2), 9), 17),
        (successor(id(9, 1), 9), 9),
        (successor(id(9, 2), 8), 8),
    ] {
        let proposal = proposed(id(10, 1), of, 11, 20).with(json!({ "successor": told }));
        accepts(&decided_by(&mut last.clone(), &proposal), relays);
    }
}

/// Checks that a leader continues if its proposal ends in a decision for an earlier membership view.
///
/// The leader must then send its next proposal.
#[test]
fn a_leader_continues_after_an_earlier_view_is_decided() {
    let mut head = Bench::new(1, 8, Wiring::Pair);
    let of = (head.mission, 0);
    head.receive(
        Port::Downstream,
        &loaded_hello(id(1, 2), head.mission, 1, FORMS | READY),
    );
    head.advance_1_ms();
    let before = json!({ "view": id(1, 2), "relays": 7 });
    let decision =
        refused(id(2, 1), of, 2, 8).with(json!({ "accepted": before, "usable_in_ds": 40 }));
    let mut out = head.receive(Port::Downstream, &decision);
    assert_eq!(head.view(), ViewId::LOADED);
    assert_eq!(head.counted(), ["received"]);
    // All members have accepted the earlier view, so they decide on the next one. This relay has no vote.
    let next = proposed(id(3, 1), of, 1, 8).with(json!({
        "agreed_view": id(1, 2), "agreed_relays": 7, "votes": 0, "lease_left_ds": u16::MAX,
        "earlier_lease_left_ds": u16::MAX, "proposer": false,
    }));
    out.extend(head.advance_1_ms());
    assert_eq!(out, [(Port::Downstream, next)]);
}
