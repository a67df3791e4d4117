//! Who may decide on the next view, and what keeps two parts of a chain from deciding on one each.
//!
//! Every view has at most one successor. It is agreed on as a value is in Paxos (Lamport, "Paxos made simple", 2001), by the members of
//! the view that it follows; the size of that electorate changes from view to view as in dynamic voting (Jajodia and Mutchler, 1990).
//!
//! | step | on the way | what a relay does | kept |
//! | --- | --- | --- | --- |
//! | proposal | onward | promises to accept no earlier proposal, and says what it accepted before | `promised` |
//! | decision | back | accepts the view that was decided on, unless it has promised more since | `accepted` |
//! | a pass of that view | onward | knows that all accepted it | `agreed` |
//!
//! The last relay decides by what the proposal has gathered, the poll:
//!
//! | the poll of the newest view that anybody there knows to be agreed on | decision |
//! | --- | --- |
//! | not more than half of its members, nor half with the one that proposed it | refused |
//! | enough, and a member has accepted a successor that may have been agreed on | that one again, of the latest proposal; the leader proposes anew from there |
//! | enough otherwise | a view of all that are there |
//!
//! *Why there are no two.* Two decisions on the successor of one view have a member of it in common. The later proposal comes to that
//! member after it has accepted the earlier decision, and is told of it; or before, and then the member accepts that decision no more, so that
//! the leader who waits for it never hears that all have. A relay that was no member has no voice: who has been switched on without the
//! [`ViewRecord`](crate::ViewRecord) that it left belongs to the chain as it was loaded, and to nothing that came after.

use crate::view::{View, ViewId};
use crate::wire::message::{Poll, Successor};

/// A view that this relay has accepted, and does not know to be agreed on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Accepted {
    successor: Successor,
    /// Whether it is a member.
    member: bool,
}

/// What one relay has said in the votes on views, and knows of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Electorate {
    /// The newest view that it knows to be agreed on, and whether it is a member.
    agreed: View,
    member: bool,
    promised: ViewId,
    accepted: Option<Accepted>,
    /// The node whose half of the chain as it was loaded is the larger.
    elder: u16,
}

/// What the last relay decides.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Outcome {
    Refused,
    View(View),
}

impl Electorate {
    /// Of a chain of so many relays, led by `elder`, that nothing has happened to.
    pub(crate) const fn new(relays: u16, elder: u16) -> Self {
        Self {
            agreed: View {
                id: ViewId::LOADED,
                relays,
            },
            member: true,
            promised: ViewId::LOADED,
            accepted: None,
            elder,
        }
    }

    /// The largest proposal that it has taken part in.
    pub(crate) const fn promised(&self) -> ViewId {
        self.promised
    }

    /// The newest view that it knows to be agreed on.
    pub(crate) const fn agreed(&self) -> View {
        self.agreed
    }

    /// Takes part in `proposal`, which has gathered `told` so far, if it has promised no later one; what is gathered with it.
    ///
    /// `lease_left` is how long members of its view that are elsewhere may still rely on `node`, in tenths of a second.
    pub(crate) fn vote(
        &mut self,
        node: u16,
        proposal: ViewId,
        told: Option<Poll>,
        lease_left: u16,
    ) -> Option<Poll> {
        if proposal <= self.promised {
            return None;
        }
        self.promised = proposal;
        let told = told.unwrap_or(Poll::of(self.agreed));
        if told.agreed.id > self.agreed.id {
            self.learn(told.agreed);
        }
        let newer = self.agreed.id > told.agreed.id;
        let before = if newer {
            // Who has voted so far was no member, as far as it knows.
            Poll::of(self.agreed)
        } else {
            told
        };
        let own = self.accepted.map(|accepted| accepted.successor);
        let successor = match (before.successor, own) {
            (Some(told), Some(own)) if told.proposal >= own.proposal => Some(told),
            (told, own) => own.or(told),
        };
        let proposer = match self.agreed.id {
            ViewId::LOADED => self.elder,
            view => view.proposer(),
        };
        let mut poll = Poll {
            successor,
            ..before
        };
        if self.member {
            // No more than there are, whatever was told: nobody would read that.
            poll.votes = poll.votes.saturating_add(1).min(poll.agreed.relays);
            poll.proposer |= proposer == node;
            poll.lease_left = poll.lease_left.min(lease_left);
        }
        Some(poll)
    }

    /// `view` is known to be agreed on.
    fn learn(&mut self, view: View) {
        let accepted = self
            .accepted
            .filter(|accepted| accepted.successor.view.id == view.id);
        self.member = accepted.is_some_and(|accepted| accepted.member);
        self.agreed = view;
        self.accepted = None;
    }

    /// Accepts what was decided on `proposal`, unless it has promised a later one; whether it has.
    pub(crate) fn accept(&mut self, proposal: ViewId, view: View) -> bool {
        if proposal != self.promised {
            return false;
        }
        let known = self
            .accepted
            .is_some_and(|accepted| accepted.successor.view.id == view.id && accepted.member);
        self.accepted = Some(Accepted {
            successor: Successor { proposal, view },
            member: view.id == proposal || known,
        });
        true
    }

    /// What it has accepted last is known to be accepted by all.
    pub(crate) fn commit(&mut self) {
        if let Some(accepted) = self.accepted {
            self.learn(accepted.successor.view);
        }
    }

    /// Whether it has accepted `view`, and does not know that all have.
    pub(crate) fn awaits(&self, view: ViewId) -> bool {
        self.accepted
            .is_some_and(|accepted| accepted.successor.view.id == view)
    }
}

/// The decision on `proposal`, which has come through `relays`, by the `poll` of them.
pub(crate) fn decide(poll: &Poll, proposal: ViewId, relays: u16) -> Outcome {
    // Of two halves the one with the proposer is the larger.
    let there = 2 * u32::from(poll.votes) + u32::from(poll.proposer);
    if there <= u32::from(poll.agreed.relays) {
        return Outcome::Refused;
    }
    Outcome::View(poll.successor.map_or(
        View {
            id: proposal,
            relays,
        },
        |successor| successor.view,
    ))
}
