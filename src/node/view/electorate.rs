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

/// How many proposals of which it has not heard the decision a relay remembers.
const VOTES: usize = 8;

/// What one relay has said in the votes on views, and knows of them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Electorate {
    /// The newest view that it knows to be agreed on, and whether it is a member.
    agreed: View,
    member: bool,
    promised: ViewId,
    /// A view that it has accepted, and does not know to be agreed on.
    accepted: Option<Successor>,
    /// Proposals that it has taken part in, and that may become views: then it is a member. The latest first.
    voted: [ViewId; VOTES],
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
            voted: [ViewId::LOADED; VOTES],
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
        self.voted.rotate_right(1);
        if let Some(latest) = self.voted.first_mut() {
            *latest = proposal;
        }
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
        let successor = match (before.successor, self.accepted) {
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
            poll.votes = poll.votes.saturating_add(1);
            poll.proposer |= proposer == node;
            poll.lease_left = poll.lease_left.min(lease_left);
        }
        Some(poll)
    }

    /// `view` is known to be agreed on.
    fn learn(&mut self, view: View) {
        self.member = self.voted.contains(&view.id);
        self.agreed = view;
        self.accepted = None;
        self.forget(|voted| voted <= view.id);
    }

    /// Forgets that it has taken part in proposals that will be no views any more.
    fn forget(&mut self, over: impl Fn(ViewId) -> bool) {
        let mut kept = [ViewId::LOADED; VOTES];
        let voted = self.voted.iter().filter(|voted| !over(**voted));
        for (kept, voted) in kept.iter_mut().zip(voted) {
            *kept = *voted;
        }
        self.voted = kept;
    }

    /// No new view has come of `proposal`, and none will.
    pub(crate) fn withdraw(&mut self, proposal: ViewId) {
        self.forget(|voted| voted == proposal);
    }

    /// Accepts what was decided on `proposal`, unless it has promised a later one; whether it has.
    pub(crate) fn accept(&mut self, proposal: ViewId, view: View) -> bool {
        if proposal != self.promised {
            return false;
        }
        self.accepted = Some(Successor { proposal, view });
        if view.id != proposal {
            self.withdraw(proposal);
        }
        true
    }

    /// What it has accepted last is known to be accepted by all.
    pub(crate) fn commit(&mut self) {
        if let Some(accepted) = self.accepted {
            self.learn(accepted.view);
        }
    }

    /// Whether it has accepted `view`, and does not know that all have.
    pub(crate) fn awaits(&self, view: ViewId) -> bool {
        self.accepted
            .is_some_and(|accepted| accepted.view.id == view)
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

#[cfg(test)]
impl Electorate {
    /// As it was before there was an electorate: what is decided on is agreed on, and whoever is there has a voice.
    pub(crate) fn count_everybody(&mut self) {
        self.commit();
        self.member = true;
    }

    /// Whether it has a voice on the successor of the view that it knows to be agreed on.
    pub(crate) const fn is_member(&self) -> bool {
        self.member
    }
}
