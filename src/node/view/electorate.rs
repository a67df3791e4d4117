//! Who may decide on the next view, and what keeps two parts of a chain from deciding on one each.
//!
//! Every view has at most one successor. It is agreed on as a value is in Paxos (Lamport, "Paxos made simple", 2001), by the members of
//! the view that it follows; the size of that electorate changes from view to view as in dynamic voting (Jajodia and Mutchler, 1990).
//!
//! | step | on the way | what a relay does | kept |
//! | --- | --- | --- | --- |
//! | proposal | onward | promises to accept no earlier proposal, and says what it accepted before | `promised` |
//! | decision | back | accepts the view that was decided on, unless it has promised more since | `accepted`, `votes` |
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

/// Proposals that a relay remembers to have taken part in while it does not know what came of them.
const VOTES: usize = 8;

/// What one relay has said in the votes on views, and knows of them.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Electorate {
    /// The newest view that it knows to be agreed on, and whether it is a member.
    agreed: View,
    member: bool,
    promised: ViewId,
    /// The successor of `agreed` that it has accepted, and does not know to be agreed on.
    accepted: Option<Successor>,
    /// The proposals after `agreed` that it has taken part in: it is a member of the views that come of them.
    votes: heapless::Vec<ViewId, VOTES>,
    /// The node whose half of the chain as it was loaded is the larger.
    elder: u16,
}

/// For how long what was agreed on may be held elsewhere, in tenths of a second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Held {
    /// By members of its view that rely on this relay.
    pub(crate) lease_left: u16,
    /// By members of views before `view`; `None` as long as they may not have accepted that.
    pub(crate) view: ViewId,
    pub(crate) rest: Option<u16>,
}

impl Held {
    fn rest_of(&self, view: ViewId) -> u16 {
        if view == ViewId::LOADED {
            0
        } else {
            let known = self.rest.filter(|_| view == self.view);
            known.unwrap_or(u16::MAX)
        }
    }
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
            votes: heapless::Vec::new(),
            elder,
        }
    }

    /// The largest proposal that it has taken part in.
    pub(crate) const fn promised(&self) -> ViewId {
        self.promised
    }

    /// Takes part in `proposal`, which has gathered `told` so far, if it has promised no later one; what is gathered with it.
    ///
    /// `held` is for how long what was agreed on may be held elsewhere, as far as this relay knows.
    pub(crate) fn vote(
        &mut self,
        node: u16,
        proposal: ViewId,
        told: Option<Poll>,
        held: Held,
    ) -> Option<Poll> {
        if proposal <= self.promised {
            return None;
        }
        self.promised = proposal;
        if self.votes.is_full() {
            // Of the oldest one it is the most likely that nothing came.
            self.votes.rotate_left(1);
            self.votes.pop();
        }
        _ = self.votes.push(proposal);
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
            poll.lease_left = poll.lease_left.min(held.lease_left);
            poll.rest = poll.rest.min(held.rest_of(self.agreed.id));
        }
        Some(poll)
    }

    /// `view` is known to be agreed on.
    fn learn(&mut self, view: View) {
        self.member = self.votes.contains(&view.id);
        self.votes.retain(|vote| *vote > view.id);
        self.agreed = view;
        self.accepted = None;
    }

    /// What was decided on `proposal`, a view that follows `base` or none, is accepted, unless this relay has promised more since; whether
    /// it is.
    pub(crate) fn accept(&mut self, proposal: ViewId, base: View, view: Option<View>) -> bool {
        if proposal != self.promised || base.id < self.agreed.id {
            return false;
        }
        if base.id > self.agreed.id {
            self.learn(base);
        }
        if let Some(view) = view {
            // No other of the proposals so far can be agreed on any more.
            self.votes.retain(|vote| *vote == view.id);
            self.accepted = Some(Successor { proposal, view });
        } else {
            self.votes.retain(|vote| *vote != proposal);
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

/// How long the places of a view that follows are not to be taken, in tenths of a second; `most` where nobody knows.
pub(crate) fn rest(poll: &Poll, most: u16) -> u16 {
    let all = poll.votes == poll.agreed.relays;
    let lease_left = if all { 0 } else { poll.lease_left };
    poll.rest.max(lease_left).min(most)
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
