//! Rules of voting on views: acceptor state, quorums, and the decision on a proposal.
//!
//! Every view has at most one successor. It is chosen by Paxos (Lamport, "Paxos made simple", 2001) among the members of the view
//! that it follows. This electorate changes from view to view as in dynamic voting (Jajodia and Mutchler, 1990).
//!
//! | message | direction | action of a relay | state |
//! | --- | --- | --- | --- |
//! | proposal | toward the last relay | promise to accept no earlier proposal; report the view accepted before | `promised`, `voted` |
//! | decision | toward the leader | accept the decided view, unless a later proposal was promised | `accepted` |
//! | pass of that view | toward the last relay | record that all members have accepted it | `agreed` |
//!
//! Every decision, also a refusal, names the view that it follows. Relays that did not know that view could not vote.
//! They can vote on the next proposal.
//!
//! The last relay decides by the poll in the proposal:
//!
//! | poll among the members of the newest view known to be agreed on | decision |
//! | --- | --- |
//! | all relays of the mission have been polled, members or not | a view of all: no other relay can hold an agreement |
//! | fewer than half of the members, or exactly half without the view's proposer | refused |
//! | a quorum, and a member has accepted a successor that may have been agreed on | the successor with the latest proposal; the leader then proposes anew from it |
//! | a quorum otherwise | a view of all polled relays |
//!
//! # Safety
//! Two decisions on the successor of one view have a member of that view in common. If the member accepts the earlier
//! decision before the later proposal arrives, it reports that decision with its vote. Otherwise it has promised the
//! later proposal and no longer accepts the earlier decision. So the earlier leader never learns that all members have
//! accepted it. Only members vote.
//!
//! # Membership
//! Each relay forwards a proposal to only one other, so a proposal takes one route. Every relay that has voted on it is
//! a member of the view that may result, whether or not it receives the decision. A relay remembers [`VOTES`] proposals
//! without a known decision, the earliest and the latest. If it has forgotten its vote for a view it cannot vote in
//! that view, but may in the next one; this is safe.
//!
//! # Requirement
//! A relay that restarts without its [`ViewRecord`](crate::ViewRecord) is a member of the initial view only, and its
//! promises are lost. Therefore relays that know no later view, including those without their records, must not form a
//! quorum of the initial view. In a chain of five of which three still fly, one lost record is too many. Together with
//! the two relays left behind this relay can decide, independently of the two that still have their records. A relay
//! that loses its record during a proposal may also forward the proposal on a second route.

use crate::node::context::{OtherLeases, tenths};
use crate::view::{View, ViewId};
use crate::wire::message::{Poll, Successor};

/// Number of undecided view proposals for which a relay remembers its vote.
pub(super) const VOTES: usize = 8;

/// Promises and votes of one relay on views (acceptor state in Paxos).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Electorate {
    /// Newest view that is known to be agreed on.
    pub(super) agreed: View,
    /// True if this relay is a member of the view `agreed`. Only a member's vote counts for the next view.
    pub(super) member: bool,
    pub(super) promised: ViewId,
    /// View that this relay has accepted, and that is not yet known to be agreed on. `None` if there is none.
    pub(super) accepted: Option<Successor>,
    /// Proposals that this relay has voted on and that can still become agreed views, latest first.
    pub(super) voted: [ViewId; VOTES],
    /// Node number of the leader before any view change. If the initial view splits into two halves, the half with this
    /// node has the quorum.
    pub(super) initial_leader: u16,
}

impl Electorate {
    /// Creates the initial voting state for a chain of `relays` relays.
    pub(crate) const fn new(relays: u16, initial_leader: u16) -> Self {
        Self {
            agreed: View {
                id: ViewId::LOADED,
                relays,
            },
            member: true,
            promised: ViewId::LOADED,
            accepted: None,
            voted: [ViewId::LOADED; VOTES],
            initial_leader,
        }
    }

    /// Returns the latest view proposal that this relay has promised. This relay accepts no earlier proposal (Paxos).
    pub(crate) const fn promised(&self) -> ViewId {
        self.promised
    }

    #[cfg(test)]
    pub(crate) const fn agreed(&self) -> View {
        self.agreed
    }

    /// Votes on the view `proposal`, and returns the votes so far. `None` if this relay has already promised `proposal`
    /// or a later view.
    ///
    /// `received` has the votes of the relays that voted before this one; `None` at the proposer. `other_leases` has
    /// the remaining times of the other relays' leases.
    pub(crate) fn vote(
        &mut self,
        node: u16,
        proposal: ViewId,
        received: Option<Poll>,
        other_leases: OtherLeases,
    ) -> Option<Poll> {
        if proposal <= self.promised {
            return None;
        }
        self.promised = proposal;
        self.remember(proposal);
        let received = received.unwrap_or(Poll::of(self.agreed));
        if received.agreed.id > self.agreed.id {
            self.learn(received.agreed);
        }
        let newer = self.agreed.id > received.agreed.id;
        let before = if newer {
            // The earlier voters did not know the newer view, so they voted as nodes that are not its members.
            Poll::of(self.agreed)
        } else {
            received
        };
        let successor = match (before.successor, self.accepted) {
            (Some(received), Some(own)) if received.proposal >= own.proposal => Some(received),
            (received, own) => own.or(received),
        };
        let proposer = match self.agreed.id {
            ViewId::LOADED => self.initial_leader,
            view => view.proposer(),
        };
        let mut poll = Poll {
            successor,
            ..before
        };
        if self.member {
            // A poll with more votes than members would be rejected by its receivers.
            poll.votes = poll.votes.saturating_add(1).min(poll.agreed.relays);
            poll.proposer |= proposer == node;
            poll.lease_left = poll.lease_left.min(tenths(other_leases.lease_left));
            poll.earlier_lease_left = poll
                .earlier_lease_left
                .min(other_leases.earlier_lease_tenths(self.agreed.id));
        }
        Some(poll)
    }

    /// Returns true if `proposal` has no quorum with the vote of node `node` alone. The call computes this vote, but
    /// does not record it.
    pub(super) fn lacks_quorum_alone(
        &self,
        node: u16,
        proposal: ViewId,
        all: u16,
        other_leases: OtherLeases,
    ) -> bool {
        let mut copy = *self;
        let poll = copy.vote(node, proposal, None, other_leases);
        poll.is_some_and(|poll| decide(&poll, proposal, 1, all).is_none())
    }

    /// Records the vote on the view `proposal`. If the list of eight votes is full, the four earliest votes and the
    /// four latest ones, including the new vote, remain.
    fn remember(&mut self, proposal: ViewId) {
        let full = self.voted.last() != Some(&ViewId::LOADED);
        let moves = if full { VOTES / 2 } else { VOTES };
        let mut next = proposal;
        for kept in self.voted.iter_mut().take(moves) {
            next = core::mem::replace(kept, next);
        }
    }

    /// Records that `view` is known to be agreed on, and drops earlier votes and the accepted view.
    fn learn(&mut self, view: View) {
        self.member = self.voted.contains(&view.id);
        self.agreed = view;
        self.accepted = None;
        self.forget(|voted| voted <= view.id);
    }

    /// Removes the votes on proposals for which `is_decided` returns true. Such proposals can no longer become views.
    fn forget(&mut self, is_decided: impl Fn(ViewId) -> bool) {
        let mut kept = [ViewId::LOADED; VOTES];
        let voted = self.voted.iter().filter(|voted| !is_decided(**voted));
        for (kept, voted) in kept.iter_mut().zip(voted) {
            *kept = *voted;
        }
        self.voted = kept;
    }

    /// Accepts the decision on `proposal`; returns false if this relay has promised a later proposal. `view` is the
    /// decided view; `None` for a refusal. `base` is the agreed view that the decided view replaces.
    pub(crate) fn accept(&mut self, proposal: ViewId, base: View, view: Option<View>) -> bool {
        if proposal != self.promised || base.id < self.agreed.id {
            return false;
        }
        if base.id > self.agreed.id {
            self.learn(base);
        }
        if let Some(view) = view {
            self.accepted = Some(Successor { proposal, view });
        }
        if view.is_none_or(|view| view.id != proposal) {
            // The proposal itself can no longer become a view.
            self.forget(|voted| voted == proposal);
        }
        true
    }

    /// Records that the last accepted view is agreed on, because all its members have accepted it.
    pub(crate) fn commit(&mut self) {
        if let Some(accepted) = self.accepted {
            self.learn(accepted.view);
        }
    }

    /// Returns true if this relay was polled in `view`, which is agreed on or can still become agreed.
    pub(super) fn is_polled_in(&self, view: ViewId) -> bool {
        self.voted.contains(&view) || self.member && self.agreed.id == view
    }

    /// Returns true if this relay has accepted `view`, but does not know yet that the view is agreed on.
    pub(crate) fn awaits(&self, view: ViewId) -> bool {
        self.accepted
            .is_some_and(|accepted| accepted.view.id == view)
    }
}

/// Returns the waiting time before relays may use positions of the next view, in tenths of a second. It is the
/// remaining time of the leases stated in the votes `poll`, at most `most`. If it is unknown, it is `most`.
pub(crate) fn remaining_wait(poll: &Poll, most: u16) -> u16 {
    let all = poll.votes == poll.agreed.relays;
    let lease_left = if all { 0 } else { poll.lease_left };
    poll.earlier_lease_left.max(lease_left).min(most)
}

/// Returns the view decided on `proposal` with the votes `poll`; `None` without a quorum. `relays` is the number of
/// relays that the proposal has reached, and `all` the number of relays in the mission.
pub(crate) fn decide(poll: &Poll, proposal: ViewId, relays: u16, all: u16) -> Option<View> {
    let whole = View {
        id: proposal,
        relays,
    };
    if relays == all {
        return Some(whole);
    }
    // If the members split into two equal halves, the half with the view's proposer counts as the larger.
    let weight = 2 * u32::from(poll.votes) + u32::from(poll.proposer);
    if weight <= u32::from(poll.agreed.relays) {
        return None;
    }
    let successor = poll.successor.map(|successor| successor.view);
    Some(successor.unwrap_or(whole))
}

#[cfg(test)]
impl Electorate {
    /// Returns true if this relay has voted on `proposal` and does not know the decision yet.
    pub(super) fn has_voted(&self, proposal: ViewId) -> bool {
        self.voted.contains(&proposal)
    }

    /// Test helper: disables the quorum rule, a fault that the model check must find.
    pub(super) fn count_everybody(&mut self) {
        self.commit();
        self.member = true;
    }
}

#[cfg(test)]
mod tests;
