//! Decisions, and which relays accept them.

use super::relay::{PROPOSED, Relay, all, came, id};
use crate::node::circulation::Stage;
use crate::node::context::{Decided, Effects, News};
use crate::node::view::change::Proposed;
use crate::node::view::electorate::{Electorate, Held};
use crate::view::View;
use crate::wire::message::{Decision, Message, Successor};

#[test]
fn what_is_promised_keeps_an_earlier_decision_from_being_accepted() {
    let mut relay = Relay::second();
    for view in [id(1, 1), id(2, 1)] {
        let proposal = relay.proposal(view);
        relay.handle(&proposal);
    }
    let early = relay.decision(id(1, 1), Some(all(id(1, 1))));
    assert_eq!(relay.handle(&early), Effects::STALE);
    assert!(!relay.view.electorate.awaits(id(1, 1)));
    assert_eq!(relay.view.circulation.stage(), Stage::Outstanding);
}

#[test]
fn a_decision_is_of_the_relay_that_the_proposal_went_on_to() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let Message::Decision(decision) = relay.decision(id(1, 1), Some(all(id(1, 1)))) else {
        return;
    };
    let small = View {
        id: id(1, 1),
        relays: 2,
    };
    let strays = [
        Decision {
            place: 2,
            ..decision
        },
        Decision {
            place: 4,
            ..decision
        },
        Decision {
            proposal: id(1, 3),
            ..decision
        },
        Decision {
            view: Some(small),
            ..decision
        },
    ];
    for stray in strays {
        let stray = Message::Decision(stray);
        assert_eq!(relay.handle(&stray), Effects::STALE, "{stray:?}");
    }
    assert_eq!(relay.view.circulation.stage(), Stage::Outstanding);
}

#[test]
fn the_last_one_decides() {
    let mut relay = Relay::new(4);
    let Message::Proposal(mut proposal) = relay.proposal(id(1, 1)) else {
        return;
    };
    proposal.place = 3;
    proposal.poll.votes = 3;
    let granted = Effects {
        news: Some(News::Decided(Decided::Granted {
            relays: 4,
            lease_left: 0,
        })),
        ..PROPOSED
    };
    assert_eq!(relay.handle(&Message::Proposal(proposal)), granted);
    assert!(relay.view.electorate.awaits(id(1, 1)));
    // The first pass shows that all relays have accepted it.
    relay.view.commit(id(1, 1));
    assert_eq!(relay.view.electorate.agreed(), all(id(1, 1)));
    relay.view.commit(id(1, 1));
    assert_eq!(relay.view.electorate.agreed(), all(id(1, 1)));
}

#[test]
fn an_earlier_view_is_accepted_and_the_leader_proposes_anew_from_there() {
    let mut relay = Relay::new(1);
    relay.leads();
    relay.onward(2).unwrap();
    let earlier = View {
        id: id(1, 1),
        relays: 3,
    };
    // This relay has proposed the view itself and has not received the decision.
    let first = relay.view.electorate.promised();
    assert_eq!(first, earlier.id);
    relay.view.heard_of(id(2, 3));
    relay.now = relay.view.asking.next_timeout().unwrap();
    assert!(relay.leads().began);
    let second = relay.view.electorate.promised();
    assert!(second > id(2, 3));
    let decision = relay.decision(second, Some(earlier));
    assert_eq!(relay.handle(&decision), came(Decided::Earlier));
    assert_eq!(relay.view.electorate.agreed(), earlier);
    assert!(relay.view.electorate.member);
    assert_eq!(relay.view.take_back(), None, "nobody is before it");
    assert!(relay.leads().began);
}

/// Regression test: relays near the leader that did not know the newest view were refused for good.
#[test]
fn a_refusal_says_which_view_was_agreed_on() {
    let view = View {
        id: id(1, 1),
        relays: 3,
    };
    let voted = |mut electorate: Electorate, node| {
        electorate.vote(node, view.id, None, Held::NONE).unwrap();
        let base = electorate.agreed();
        assert!(electorate.accept(view.id, base, Some(view)));
        electorate
    };
    let [mut second, mut third] = [2, 3].map(Relay::new);
    second.view.electorate = voted(second.view.electorate, 2);
    third.view.electorate = voted(third.view.electorate, 3);
    third.view.commit(view.id);
    third.end = true;
    second.view.heard_of(view.id);
    let mut refused = 0;
    for round in 0..2 {
        assert!(second.leads().began);
        let proposal = second.onward(3).unwrap();
        let effects = third.handle(&proposal);
        let Some(Message::Decision(back)) = third.view.take_back() else {
            panic!("nothing is handed back")
        };
        if effects.news == Some(News::Decided(Decided::Refused)) {
            refused += 1;
            assert_eq!((back.base, back.view), (view, None));
        }
        let decided = second.handle(&Message::Decision(back)).news;
        if round == 0 {
            assert_eq!(decided, Some(News::Decided(Decided::Refused)));
            assert_eq!(second.view.electorate.agreed(), view);
        } else {
            // Two of its three members are polled, now that both know the view.
            assert!(matches!(
                decided,
                Some(News::Decided(Decided::Granted { relays: 2, .. }))
            ));
        }
    }
    assert_eq!(refused, 1);
}

#[test]
fn a_decision_is_of_the_mission_that_was_proposed() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let decision = relay.decision(id(1, 1), Some(all(id(1, 1))));
    let Message::Decision(mut other) = decision.clone() else {
        return;
    };
    other.mission_id.version = 5;
    assert_eq!(relay.handle(&Message::Decision(other)), Effects::STALE);
    let granted = came(Decided::Granted {
        relays: 4,
        lease_left: 0,
    });
    assert_eq!(relay.handle(&decision), granted);
}

/// A newer mission has replaced the proposed one, which can not be flown any more.
#[test]
fn who_has_lost_the_mission_has_no_part_in_its_view() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let decision = relay.decision(id(1, 1), Some(all(id(1, 1))));
    relay.latest.version = 5;
    assert_eq!(relay.handle(&decision), Effects::FOREIGN);
    assert_eq!(relay.view.circulation.stage(), Stage::Outstanding);
    assert!(matches!(
        relay.view.proposed,
        Some(Proposed { decided: None, .. })
    ));
    assert!(!relay.view.electorate.awaits(id(1, 1)));
}

#[test]
fn a_successor_that_was_accepted_is_told_of_and_decided_on_again() {
    let mut relay = Relay::new(4);
    let first = all(id(1, 1));
    relay
        .view
        .electorate
        .vote(4, first.id, None, Held::NONE)
        .unwrap();
    let base = relay.view.electorate.agreed();
    assert!(relay.view.electorate.accept(first.id, base, Some(first)));
    let Message::Proposal(mut proposal) = relay.proposal(id(2, 1)) else {
        return;
    };
    proposal.place = 2;
    proposal.poll.votes = 2;
    let decided = relay.handle(&Message::Proposal(proposal)).news;
    assert_eq!(decided, Some(News::Decided(Decided::Earlier)));
    let poll = relay.view.proposed.unwrap().poll;
    assert_eq!(
        poll.successor,
        Some(Successor {
            proposal: first.id,
            view: first,
        })
    );
    assert!(relay.view.electorate.awaits(first.id));
}
