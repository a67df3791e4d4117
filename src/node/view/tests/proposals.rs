//! Received proposals: forwarded, or answered from the known decision.

use super::relay::{LATE, PROPOSED, REPEATED, Relay, all, came, id};
use crate::node::context::{Decided, Effects};
use crate::wire::message::Message;

#[test]
fn a_proposal_is_handed_on_with_one_voice_more() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    assert_eq!(relay.handle(&proposal), PROPOSED);
    let Some(Message::Proposal(handed)) = relay.onward(3) else {
        panic!("nothing is handed on")
    };
    assert_eq!((handed.view, handed.place), (id(1, 1), 2));
    assert_eq!((handed.poll.votes, handed.poll.proposer), (2, true));
    assert_eq!(relay.onward(3), None, "once");
    assert_eq!(relay.view.take_back(), None);
}

#[test]
fn the_same_again_is_answered_by_what_is_known_of_it() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    assert_eq!(relay.handle(&proposal), REPEATED);
    let busy = Message::Busy {
        sweep: id(1, 1).mark(),
    };
    assert_eq!(relay.view.take_back(), Some(busy));
    let decision = relay.decision(id(1, 1), Some(all(id(1, 1))));
    let granted = came(Decided::Granted {
        relays: 4,
        lease_left: 0,
    });
    assert_eq!(relay.handle(&decision), granted);
    for again in [false, true] {
        if again {
            assert_eq!(relay.handle(&proposal), REPEATED);
        }
        let Some(Message::Decision(back)) = relay.view.take_back() else {
            panic!("nothing is handed back")
        };
        assert_eq!((back.place, back.view), (2, Some(all(id(1, 1)))));
    }
    assert_eq!(relay.handle(&decision), Effects::STALE);
}

#[test]
fn a_newer_one_takes_the_place_of_one_that_is_not_decided() {
    let mut relay = Relay::second();
    for view in [id(1, 1), id(1, 3), id(2, 1)] {
        let proposal = relay.proposal(view);
        assert_eq!(relay.handle(&proposal), PROPOSED);
    }
    let old = relay.proposal(id(1, 3));
    assert_eq!(relay.handle(&old), LATE);
}

/// The leader has restarted during a proposal and has received another mission.
#[test]
fn a_proposal_of_the_same_view_with_another_mission_is_another() {
    let mut relay = Relay::second();
    let first = relay.proposal(id(1, 1));
    assert_eq!(relay.handle(&first), PROPOSED);
    assert_eq!(relay.handle(&first), REPEATED);
    relay.latest.version = 5;
    let again = relay.proposal(id(1, 1));
    assert_eq!(relay.handle(&again), LATE);
}
