//! Leaders: who proposes, and abandoned proposals.

use super::relay::{FROM, LATE, Relay, came, id};
use crate::node::context::{Decided, Effects};
use crate::node::numbering::SUSPICIOUS;
use crate::wire::message::{Message, Proposal};

#[test]
fn who_has_lost_the_one_after_it_decides_what_nobody_was_handed() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let granted = came(Decided::Granted {
        relays: 2,
        lease_left: 0,
    });
    assert_eq!(relay.ends(), granted);
    assert_eq!(relay.ends(), Effects::NONE, "once");
}

#[test]
fn what_was_handed_on_is_given_up_where_nobody_is_after_it_any_more() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    relay.onward(3).unwrap();
    for _ in 0..3 {
        assert_eq!(relay.ends(), Effects::NONE);
        assert!(relay.view.asking.asks());
        assert_eq!(relay.view.newest(), id(2, 2), "one number more, once");
    }
    // A later proposal may end here.
    let later = relay.proposal(id(3, 1));
    assert!(relay.handle(&later).decided.is_some());
}

/// Regression test: two views had one identifier when only relay 1 had lost relay 2. They were relays 1 to 3, and 1 and 4.
#[test]
fn a_proposal_is_handed_to_one_node_alone() {
    let mut relay = Relay::new(1);
    let began = relay.leads();
    assert!(began.began && began.view_proposed);
    relay.onward(2).unwrap();
    relay.view.resend();
    assert_eq!(relay.onward(4), None);
    assert!(relay.view.asking.asks());
    relay.view.resend();
    assert!(relay.onward(2).is_some(), "it may be back");
    // A later proposal may be forwarded to the other node.
    let mut later = relay.leads();
    for _ in 0..4 {
        if later.began {
            break;
        }
        later = relay.leads();
    }
    assert!(later.began);
    assert!(
        matches!(relay.onward(4), Some(Message::Proposal(Proposal { view, .. })) if view > id(1, 1))
    );
}

#[test]
fn a_leader_that_is_refused_stays_and_asks_again_later() {
    let mut relay = Relay::second();
    relay.end = true;
    assert_eq!(relay.leads().decided, Some(Decided::Refused));
    assert!(relay.view.has_no_quorum() && relay.view.asking.asks());
    assert!(!relay.view.electorate.has_voted(relay.view.newest()));
    let again = relay.view.asking.next_timeout().unwrap();
    assert!(again >= relay.now + relay.member.settings.probe_after);
}

#[test]
fn a_leader_proposes_after_all_it_has_heard_of_and_one_at_a_time() {
    let mut relay = Relay::new(1);
    relay.view.heard_of(id(7, 3));
    assert!(relay.leads().began);
    assert_eq!(relay.view.newest(), id(8, 1));
    assert!(!relay.leads().began, "it is under way");
    relay.view.heard_of(id(8, 2));
    assert!(relay.leads().began);
    assert_eq!(relay.view.newest(), id(9, 1));
    // A view far ahead is approached in steps.
    for number in [265, 521, 777, 1000, 1000] {
        relay.view.heard_of(id(1000, 3));
        assert_eq!(relay.view.newest(), id(number, 3));
    }
}

/// Checks that a relay alone for hours uses one view number, not one every five seconds.
#[test]
fn a_leader_that_is_alone_and_was_refused_asks_itself_before_it_proposes_again() {
    let mut relay = Relay::second();
    relay.end = true;
    assert_eq!(relay.leads().decided, Some(Decided::Refused));
    let newest = relay.view.newest();
    for _ in 0..1_000 {
        assert_eq!(relay.leads(), Effects::NONE);
        assert!(relay.view.has_no_quorum() && relay.view.asking.asks());
    }
    assert_eq!(relay.view.newest(), newest);
    // With a successor the poll may have another result.
    relay.end = false;
    let began = (0..8).any(|_| relay.leads().began);
    assert!(began && relay.view.newest() > newest);
}

#[test]
fn who_has_missed_something_is_told_after_some_late_proposals() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(3, 1));
    relay.handle(&proposal);
    let late = relay.proposal(id(2, 1));
    for _ in 1..SUSPICIOUS {
        assert_eq!(relay.handle(&late), LATE);
    }
    let foreign = Effects {
        proposed_by: FROM.proposed_by,
        ..Effects::FOREIGN
    };
    assert_eq!(relay.handle(&late), foreign);
    assert_eq!(relay.view.newest(), id(4, 2));
}
