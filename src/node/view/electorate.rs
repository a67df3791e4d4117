//! Who may decide on the next view, and what keeps two parts of a chain from deciding on one each.
//!
//! Every view has at most one successor. It is agreed on as a value is in Paxos (Lamport, "Paxos made simple", 2001), by the members of
//! the view that it follows; the size of that electorate changes from view to view as in dynamic voting (Jajodia and Mutchler, 1990).
//!
//! | step | on the way | what a relay does | kept |
//! | --- | --- | --- | --- |
//! | proposal | onward | promises to accept no earlier proposal, and says what it accepted before | `promised`, `voted` |
//! | decision | back | accepts the view that was decided on, unless it has promised more since | `accepted` |
//! | a pass of that view | onward | knows that all accepted it | `agreed` |
//!
//! A decision names the view that it follows, also one that refuses: those before who did not know it had no voice, and have one next time.
//!
//! The last relay decides by what the proposal has gathered, the poll:
//!
//! | the poll of the newest view that anybody there knows to be agreed on | decision |
//! | --- | --- |
//! | all relays of the mission are there, members or not | a view of them all: nobody else could hold anything |
//! | not more than half of its members, nor half with the one that proposed it | refused |
//! | enough, and a member has accepted a successor that may have been agreed on | that one again, of the latest proposal; the leader proposes anew from there |
//! | enough otherwise | a view of all that are there |
//!
//! *Why there are no two.* Two decisions on the successor of one view have a member of it in common. The later proposal comes to that
//! member after it has accepted the earlier decision, and is told of it; or before, and then the member accepts that decision no more, so that
//! the leader who waits for it never hears that all have. A relay that was no member has no voice.
//!
//! *Who is a member.* A proposal is handed on by each relay to one other alone, so it goes one way, and who has taken part in it is in the
//! view that may come of it, whether or not it hears the decision. Of the proposals that it has heard no decision of a relay remembers
//! [`VOTES`], the earliest and the latest. One that is in a view and has forgotten so is safe, and has no voice until the next one.
//!
//! *What it takes.* Who has been switched on without the [`ViewRecord`](crate::ViewRecord) that it left belongs to the chain as it was
//! loaded, and to nothing that came after. So no promise holds that it gave: those who know of no view but the first must not be a
//! quorum of that, those who have forgotten among them. In a chain of five, where three fly on, one that forgets is enough, with the two
//! that were left behind: they decide beside the two of three that remember. One that forgets in the midst of a proposal may also hand the
//! same one on another way.

use crate::node::timing::tenths;
use crate::time::Duration;
use crate::view::{View, ViewId};
use crate::wire::message::{Poll, Successor};

/// How many proposals of which it has not heard the decision a relay remembers.
pub(super) const VOTES: usize = 8;

/// What one relay has said in the votes on views, and knows of them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Electorate {
    /// The newest view that it knows to be agreed on, and whether it is a member.
    pub(super) agreed: View,
    pub(super) member: bool,
    pub(super) promised: ViewId,
    /// A view that it has accepted, and does not know to be agreed on.
    pub(super) accepted: Option<Successor>,
    /// Proposals that it has taken part in, and that may become views: then it is a member. The latest first.
    pub(super) voted: [ViewId; VOTES],
    /// The node whose half of the chain as it was loaded is the larger.
    pub(super) elder: u16,
}

/// For how long what was agreed on may be held elsewhere.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Held {
    /// By members of its view that rely on this relay.
    pub(crate) lease_left: Duration,
    /// By members of views before `view`; `None` as long as they may not have accepted that.
    pub(crate) view: ViewId,
    pub(crate) rest: Option<Duration>,
}

impl Held {
    #[cfg(test)]
    pub(super) const NONE: Self = Self {
        lease_left: Duration::from_micros(0),
        view: ViewId::LOADED,
        rest: Some(Duration::from_micros(0)),
    };

    fn rest_of(self, view: ViewId) -> u16 {
        if view == ViewId::LOADED {
            0
        } else {
            let known = self.rest.filter(|_| view == self.view);
            known.map_or(u16::MAX, tenths)
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
            voted: [ViewId::LOADED; VOTES],
            elder,
        }
    }

    /// The largest proposal that it has taken part in.
    pub(crate) const fn promised(&self) -> ViewId {
        self.promised
    }

    /// The newest view that it knows to be agreed on.
    #[cfg(test)]
    pub(crate) const fn agreed(&self) -> View {
        self.agreed
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
        self.remember(proposal);
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
            // No more than there are, whatever was told: nobody would read that.
            poll.votes = poll.votes.saturating_add(1).min(poll.agreed.relays);
            poll.proposer |= proposer == node;
            poll.lease_left = poll.lease_left.min(tenths(held.lease_left));
            poll.rest = poll.rest.min(held.rest_of(self.agreed.id));
        }
        Some(poll)
    }

    /// Whether `proposal` of relay `node` would be refused, were it alone of `all`. Nothing is said by asking.
    pub(super) fn is_refused_alone(
        &self,
        node: u16,
        proposal: ViewId,
        all: u16,
        held: Held,
    ) -> bool {
        let mut asked = *self;
        let poll = asked.vote(node, proposal, None, held);
        poll.is_some_and(|poll| decide(&poll, proposal, 1, all) == Outcome::Refused)
    }

    /// It has taken part in `proposal`. Where there is no room for more the earliest ones stay: once some have accepted a view, the
    /// later proposals that come to them bring that one again.
    fn remember(&mut self, proposal: ViewId) {
        let full = self.voted.last() != Some(&ViewId::LOADED);
        let moves = if full { VOTES / 2 } else { VOTES };
        let mut next = proposal;
        for kept in self.voted.iter_mut().take(moves) {
            next = core::mem::replace(kept, next);
        }
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

    /// Accepts what was decided on `proposal`, a view that follows `base` or none, unless this relay has promised more since; whether
    /// it has.
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
            // Nothing new has come of it, and nothing will.
            self.forget(|voted| voted == proposal);
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

/// The decision on `proposal`, which has come through `relays` of `all`, by the `poll` of them.
pub(crate) fn decide(poll: &Poll, proposal: ViewId, relays: u16, all: u16) -> Outcome {
    let whole = View {
        id: proposal,
        relays,
    };
    if relays == all {
        return Outcome::View(whole);
    }
    // Of two halves the one with the proposer is the larger.
    let there = 2 * u32::from(poll.votes) + u32::from(poll.proposer);
    if there <= u32::from(poll.agreed.relays) {
        return Outcome::Refused;
    }
    let successor = poll.successor.map(|successor| successor.view);
    Outcome::View(successor.unwrap_or(whole))
}

#[cfg(test)]
impl Electorate {
    /// As it was before there was an electorate: what is decided on is agreed on, and whoever is there has a voice.
    pub(super) fn count_everybody(&mut self) {
        self.commit();
        self.member = true;
    }

    /// Whether it has taken part in `proposal`, which may become a view.
    pub(super) fn has_voted(&self, proposal: ViewId) -> bool {
        self.voted.contains(&proposal)
    }
}

#[cfg(test)]
mod tests;
