//! Tests of the voting rules, for different orders of proposals and decisions.

extern crate std;

use std::vec::Vec;

use super::{Electorate, OtherLeases, VOTES, decide};
use crate::time::Duration;
use crate::view::{View, ViewId};
use crate::wire::message::{Poll, Successor};

const fn left(lease_left: u16) -> OtherLeases {
    OtherLeases {
        lease_left: Duration::from_millis(100 * lease_left as u64),
        ..OtherLeases::NONE
    }
}

fn id(number: u32, node: u32) -> ViewId {
    ViewId::from_bits(number << 10 | node)
}

fn count(nodes: &[u16]) -> u16 {
    u16::try_from(nodes.len()).unwrap()
}

/// Voting states (Paxos acceptors) of nodes 1 to N.
struct Chain(Vec<Electorate>);

impl Chain {
    fn of(relays: u16) -> Self {
        Self((0..relays).map(|_| Electorate::new(relays, 1)).collect())
    }

    /// Delivers the decision for `view` to the relay with list index `at`. Returns true if the relay accepts it.
    fn accept(&mut self, at: usize, view: View) -> bool {
        let base = self.0[at].agreed();
        self.0[at].accept(view.id, base, Some(view))
    }

    /// Returns the votes on `proposal` after it has visited `nodes` in this order.
    fn poll(&mut self, nodes: &[u16], proposal: ViewId) -> Poll {
        let mut told = None;
        for &node in nodes {
            let electorate = &mut self.0[usize::from(node) - 1];
            told = electorate.vote(node, proposal, told, left(0));
            assert!(told.is_some(), "node {node}");
        }
        told.unwrap()
    }

    /// Returns the view decided on `proposal` after it has visited `nodes` in this order. `None` without a quorum. The
    /// last `accept` nodes of `nodes` receive the decision.
    fn propose(&mut self, nodes: &[u16], proposal: ViewId, accept: usize) -> Option<View> {
        let poll = self.poll(nodes, proposal);
        let outcome = decide(
            &poll,
            proposal,
            count(nodes),
            u16::try_from(self.0.len()).unwrap(),
        );
        if let Some(view) = outcome {
            for &node in nodes.iter().rev().take(accept) {
                assert!(self.0[usize::from(node) - 1].accept(proposal, poll.agreed, Some(view)));
            }
            if accept == nodes.len() {
                self.0[usize::from(nodes[0]) - 1].commit();
            }
        }
        outcome
    }

    fn knows(&self, node: u16) -> (View, bool) {
        let electorate = self.0[usize::from(node) - 1];
        (electorate.agreed(), electorate.member)
    }
}

/// Returns a view of `relays` relays, which node `node` proposed with the view number `number`.
fn view(number: u32, node: u32, relays: u16) -> View {
    let id = id(number, node);
    View { id, relays }
}

/// Checks that a part of a chain decides on a view only if that part is a quorum. All parts of chains of up to seven
/// relays are tested. A quorum is more than half of the relays, or half with the initial leader.
#[test]
fn more_than_half_or_half_with_the_initial_leader_decide() {
    for relays in 1..=7_u16 {
        for part in 1..1_u32 << relays {
            let nodes: Vec<u16> = (1..=relays)
                .filter(|node| part >> (node - 1) & 1 == 1)
                .collect();
            let outcome = Chain::of(relays).propose(&nodes, id(1, 1), 0);
            let there = count(&nodes);
            let most = 2 * there > relays || 2 * there == relays && nodes[0] == 1;
            assert_eq!(outcome.is_some(), most, "{nodes:?} of {relays}");
            if most {
                assert_eq!(outcome, Some(view(1, 1, there)));
            }
            // Two parts of a chain never both decide on a view.
            let rest = ((1 << relays) - 1) & !part;
            let rest: Vec<u16> = (1..=relays)
                .filter(|node| rest >> (node - 1) & 1 == 1)
                .collect();
            if most && !rest.is_empty() {
                let other = Chain::of(relays).propose(&rest, id(1, 2), 0);
                assert_eq!(other, None);
            }
        }
    }
}

#[test]
fn only_members_of_the_view_decide() {
    let mut chain = Chain::of(5);
    let first = chain.propose(&[1, 2, 3], id(1, 1), 3);
    assert_eq!(first, Some(view(1, 1, 3)));
    // Three of the five relays vote, but only one of them is among the view's three members.
    let others = chain.propose(&[3, 4, 5], id(2, 3), 3);
    assert_eq!(others, Some(view(1, 1, 3)), "it may be agreed on");
    let next = chain.propose(&[3, 4, 5], id(3, 3), 3);
    assert_eq!(next, None);
    assert_eq!(
        [3, 4, 5].map(|node| chain.knows(node).1),
        [true, false, false]
    );
    // Two of the view's three members vote.
    let members = chain.propose(&[1, 2], id(4, 1), 2);
    assert_eq!(members, Some(view(4, 1, 2)));
}

#[test]
fn of_a_split_view_the_half_with_its_proposer_decides() {
    for (part, goes_on) in [(&[3, 4][..], true), (&[1, 2], false), (&[2, 3], true)] {
        let mut chain = Chain::of(4);
        // Node 3 proposes, and the other nodes receive the decision in one of two ways.
        let view = view(1, 3, 4);
        for (electorate, node) in chain.0.iter_mut().zip(1..) {
            electorate.vote(node, view.id, None, left(0)).unwrap();
            assert!(electorate.accept(view.id, electorate.agreed(), Some(view)));
            electorate.commit();
        }
        let outcome = chain.propose(part, id(2, 1), 0);
        assert_eq!(outcome.is_some(), goes_on, "{part:?}");
    }
}

#[test]
fn a_view_that_may_be_agreed_on_is_decided_again() {
    let mut chain = Chain::of(3);
    // Only the last relay has received the decision.
    assert_eq!(chain.propose(&[1, 2, 3], id(1, 1), 1), Some(view(1, 1, 3)));
    assert_eq!(chain.propose(&[2, 3], id(2, 2), 2), Some(view(1, 1, 3)));
    assert_eq!(
        chain.knows(2).0.id,
        id(1, 1),
        "all there have accepted it now"
    );
    // A relay that has voted for the view is a member, whether or not it has received the decision.
    assert_eq!(chain.propose(&[2, 3], id(3, 2), 2), Some(view(3, 2, 2)));
}

/// Checks that a proposal that reaches all relays is accepted even if most have lost their votes. Otherwise a chain
/// could not fly again after most relays restarted.
#[test]
fn all_relays_of_the_mission_are_always_a_view() {
    let mut chain = Chain::of(3);
    assert_eq!(chain.propose(&[1, 2, 3], id(1, 1), 1), Some(view(1, 1, 3)));
    for at in [0, 1] {
        chain.0[at] = Electorate::new(3, 1);
    }
    assert_eq!(chain.propose(&[1, 2, 3], id(2, 1), 3), Some(view(2, 1, 3)));
    assert_eq!(chain.propose(&[1, 2], id(3, 1), 2), Some(view(3, 1, 2)));
}

#[test]
fn of_two_accepted_proposals_the_later_is_decided_again() {
    for accepted_first in [1, 3] {
        let mut chain = Chain::of(4);
        let early = Successor {
            proposal: id(1, 1),
            view: view(1, 1, 3),
        };
        let late = Successor {
            proposal: id(2, 2),
            view: view(2, 2, 2),
        };
        chain.0[0].promised = late.proposal;
        let (first, last) = if accepted_first == 1 {
            (early, late)
        } else {
            (late, early)
        };
        chain.0[0].accepted = Some(first);
        chain.0[2].accepted = Some(last);
        assert_eq!(chain.propose(&[1, 2, 3], id(3, 1), 0), Some(late.view));
    }
}

#[test]
fn a_promise_excludes_earlier_decisions() {
    let mut chain = Chain::of(3);
    assert_eq!(chain.propose(&[1, 2, 3], id(2, 1), 0), Some(view(2, 1, 3)));
    // The second relay has promised a later proposal and ignores earlier ones.
    chain.poll(&[2], id(3, 2));
    let view = view(2, 1, 3);
    assert!(!chain.accept(1, view));
    assert!(chain.accept(2, view));
    for old in [id(1, 3), id(2, 1), id(3, 1), id(3, 2)] {
        assert_eq!(chain.0[1].vote(2, old, None, left(0)), None, "{old:?}");
    }
    assert!(chain.0[1].vote(2, id(3, 3), None, left(0)).is_some());
}

#[test]
fn the_next_proposal_spreads_the_agreed_view() {
    let mut chain = Chain::of(4);
    chain.propose(&[1, 2, 3], id(1, 1), 3);
    let poll = chain.poll(&[1, 2, 3, 4], id(2, 1));
    assert_eq!(
        (poll.agreed.id, poll.votes, poll.proposer),
        (id(1, 1), 3, true)
    );
    assert_eq!(
        [1, 2, 3, 4].map(|node| chain.knows(node).1),
        [true, true, true, false]
    );
    assert_eq!(chain.knows(4).0, poll.agreed);
}

/// Checks that a relay that does not know the newest view has no vote. Relay 2 does not know the view and votes first.
/// Relay 3 knows the view and votes later.
#[test]
fn a_relay_that_does_not_know_the_view_has_no_vote() {
    let mut chain = Chain::of(3);
    chain.propose(&[1, 2, 3], id(1, 1), 3);
    chain.0[2].commit();
    let poll = chain.poll(&[2, 3], id(2, 2));
    assert_eq!((poll.agreed.id, poll.votes), (id(1, 1), 1));
    assert_eq!(decide(&poll, id(2, 2), 2, 4), None);
}

#[test]
fn commit_applies_to_the_last_accepted_view() {
    let mut chain = Chain::of(3);
    assert_eq!(chain.propose(&[1, 2, 3], id(1, 1), 2), Some(view(1, 1, 3)));
    assert!(chain.0[1].awaits(id(1, 1)) && !chain.0[0].awaits(id(1, 1)));
    chain.0[0].commit();
    assert_eq!(
        chain.knows(1).0.id,
        ViewId::LOADED,
        "it has accepted nothing"
    );
    chain.0[1].commit();
    assert_eq!(chain.knows(2).0.id, id(1, 1));
    assert!(!chain.0[1].awaits(id(1, 1)));
}

#[test]
fn only_members_may_be_relied_on() {
    let mut chain = Chain::of(3);
    let poll = chain.0[1].vote(2, id(1, 1), None, left(70)).unwrap();
    let poll = chain.0[2].vote(3, id(1, 1), Some(poll), left(40)).unwrap();
    assert_eq!(poll.lease_left, 40);
    chain.0[0].member = false;
    let poll = chain.0[0].vote(1, id(1, 1), Some(poll), left(10)).unwrap();
    assert_eq!((poll.lease_left, poll.votes), (40, 2));
}

/// Checks that a refused proposal is removed from the list of undecided proposals.
#[test]
fn votes_are_kept_until_their_result_is_known() {
    let mut relay = Electorate::new(3, 1);
    let view = view(1, 1, 3);
    relay.vote(2, view.id, None, left(0)).unwrap();
    for number in 2..100 {
        relay.vote(2, id(number, 2), None, left(0)).unwrap();
        let base = relay.agreed();
        assert!(relay.accept(id(number, 2), base, None));
    }
    assert!(relay.has_voted(view.id));
    for number in (100..).take(VOTES - 1) {
        relay.vote(2, id(number, 2), None, left(0)).unwrap();
    }
    assert!(relay.has_voted(view.id));
    let mut more = relay;
    for number in 200..300 {
        more.vote(2, id(number, 2), None, left(0)).unwrap();
    }
    assert!(more.has_voted(id(102, 2)) && more.has_voted(id(296, 2)));
    assert!(!more.has_voted(id(103, 2)), "one too many");
    let mut more = relay;
    let told = Poll::of(view);
    assert_eq!(
        relay
            .vote(2, id(200, 3), Some(told), left(0))
            .map(|poll| poll.votes),
        Some(1),
        "the earliest stays"
    );
    more.learn(view);
    assert!(more.member);
    assert!(!more.has_voted(view.id) && more.has_voted(id(100, 2)));
}

/// Shows that two views can be in force at the same time if a relay loses its stored votes. Node 3 is a member of the
/// current view, loses its votes, and votes in the initial view.
#[test]
fn a_relay_without_its_record_may_decide_a_second_view() {
    let mut chain = Chain::of(5);
    assert_eq!(chain.propose(&[3, 4, 5], id(1, 3), 3), Some(view(1, 3, 3)));
    chain.0[2] = Electorate::new(5, 1);
    assert_eq!(chain.propose(&[1, 2, 3], id(2, 1), 3), Some(view(2, 1, 3)));
    // Two of the view's three members vote: the other two nodes.
    chain.0[3].commit();
    assert_eq!(chain.propose(&[4, 5], id(3, 4), 2), Some(view(3, 4, 2)));
    // With its record the node would have reported its view.
    let mut kept = Chain::of(5);
    assert_eq!(kept.propose(&[3, 4, 5], id(1, 3), 3), Some(view(1, 3, 3)));
    assert_eq!(kept.propose(&[1, 2, 3], id(2, 1), 3), None);
}
