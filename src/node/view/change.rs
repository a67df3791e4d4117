//! The states of the view change on one relay: a proposal comes, is handed on, and is decided.
//!
//! A proposal travels as [`Circulation`] describes; what is particular to it:
//!
//! | stage | newer proposal received | decision received | no neighbour after this relay, and not forwarded to any |
//! | --- | --- | --- | --- |
//! | `Idle` | vote, forward it: `Outstanding` | stale | - |
//! | `Outstanding` | vote, forward it | reply with it: `Completed` | decide: `Completed` |
//! | `Completed` | vote, forward it: `Outstanding` | stale | - |
//!
//! While a view is proposed no pass goes on. One that was refused leaves the places where they are; its leader proposes again after
//! `probe_after` or later ([`Asking`]), and alone not before its own vote would suffice. A proposal that was handed on stays with the node that it was handed to: once another one, or nobody, is there, a
//! later one is asked for.
//!
//! The proposal is sent onward and the decision back. What is due later is to send one of them again, or to ask for a view.

use super::asking::Asking;
use super::electorate;
use super::electorate::{Electorate, Outcome};
use super::record::{RecordError, ViewRecord};
use crate::node::circulation::{Circulation, Reply};
use crate::node::context::{Context, Decided, Effects, Member, Proposer};
use crate::node::numbering::Stragglers;
use crate::node::timing::earliest;
use crate::time::Instant;
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal};

/// How much later than all it has heard of before a relay takes a view to be on one hearing.
const LEAP: u32 = 256;

/// The view change, as one relay takes part in it.
#[derive(Clone, Debug)]
pub(crate) struct ViewChange {
    /// `Outstanding` while the decision on a proposal is awaited.
    pub(super) circulation: Circulation,
    pub(super) proposed: Option<Proposed>,
    pub(super) electorate: Electorate,
    /// The latest view heard of.
    pub(super) newest: ViewId,
    pub(crate) asking: Asking,
    /// Whether the last decision was that too few are there.
    pub(super) refused: bool,
    pub(super) stragglers: Stragglers,
}

impl ViewChange {
    /// Of a chain of so many relays, led by node `elder`.
    pub(crate) const fn new(relays: u16, elder: u16, seed: u32) -> Self {
        Self {
            electorate: Electorate::new(relays, elder),
            circulation: Circulation::new(seed),
            proposed: None,
            newest: ViewId::LOADED,
            asking: Asking::new(seed),
            refused: false,
            stragglers: Stragglers::NONE,
        }
    }

    /// What it has said, as a relay of the mission with digest `base`.
    pub(crate) const fn record(&self, base: u16) -> ViewRecord {
        ViewRecord::new(base, self.electorate)
    }

    /// Whether nothing was said or heard of a view since this relay was switched on.
    pub(crate) fn is_untouched(&self) -> bool {
        self.proposed.is_none() && self.newest == self.electorate.promised()
    }

    /// A relay that has just been switched on, `untouched` or not, has said what is in `record`. It asks for a view.
    pub(crate) fn resume(
        &mut self,
        now: Instant,
        member: &Member,
        record: &ViewRecord,
        untouched: bool,
    ) -> Result<(), RecordError> {
        let elder = self.electorate.elder;
        let electorate = record
            .electorate(member.digest, member.all, elder)
            .ok_or(RecordError::Base)?;
        let new = self.electorate == Electorate::new(member.all, elder);
        if !(new && untouched && self.is_untouched()) {
            return Err(RecordError::Begun);
        }
        self.electorate = electorate;
        self.newest = electorate.promised();
        if self.newest > ViewId::LOADED {
            self.asking.ask_anew(now);
        }
        Ok(())
    }

    /// The latest view heard of.
    pub(crate) const fn newest(&self) -> ViewId {
        self.newest
    }

    /// Somebody knows that view. Toward one far ahead it goes step by step: a single one could be the last there can be, and
    /// whoever was apart for long says it again and again.
    pub(crate) fn heard_of(&mut self, view: ViewId) {
        if view > self.newest {
            self.newest = self.newest.toward(view, LEAP);
        }
    }

    /// What was agreed on in `view`, the one accepted last, has come: all have accepted it.
    pub(crate) fn commit(&mut self, view: ViewId) {
        if self.electorate.awaits(view) {
            self.electorate.commit();
        }
    }

    /// The proposal whose decision is awaited.
    pub(crate) fn awaited(&self) -> Option<Proposed> {
        self.proposed.filter(|_| self.circulation.is_outstanding())
    }

    /// The last proposal that was taken part in.
    pub(crate) const fn proposed(&self) -> Option<Proposed> {
        self.proposed
    }

    /// This relay's place from the leader on, from 1, and how many there are, as it was counted last.
    pub(crate) fn counted(&self) -> Option<(u16, u16)> {
        let proposed = self.proposed?;
        Some((proposed.place, proposed.there.max(proposed.place)))
    }

    /// Whether this relay is in a part of the chain that is too small.
    pub(crate) const fn has_no_quorum(&self) -> bool {
        self.refused
    }

    /// The relay that the proposal was handed on to is not there any more: what comes of it can not be known. A later one can be.
    pub(super) fn abandon(&mut self, context: &Context<'_>, proposal: ViewId) {
        if self.newest <= proposal
            && let Some(later) = proposal.next_by(context.member.node)
        {
            self.heard_of(later);
        }
        self.asking.ask_anew(context.now);
    }

    /// Gives up the proposal under way and asks for a view, as after a restart with the record.
    pub(crate) fn leave(&mut self, now: Instant) {
        self.proposed = None;
        self.circulation.withdraw();
        self.asking.ask_anew(now);
    }

    /// A proposal or a decision from the neighbour before or after, of a mission that this relay holds.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let all = context.member.all;
        match message {
            // A chain has no more relays than its mission.
            Message::Proposal(proposal) if proposal.place < all => {
                self.on_proposal(context, proposal)
            }
            // What is decided on follows its base, and this relay has proposed nothing later.
            Message::Decision(decision)
                if decision.view.is_none_or(|view| {
                    let is_own = view.id.proposer() == context.member.node;
                    let is_known = !is_own || view.id <= decision.proposal;
                    decision.base.id < view.id && is_known && view.relays <= all
                }) =>
            {
                self.on_decision(context, decision)
            }
            _ => Effects::STALE,
        }
    }

    fn on_proposal(&mut self, context: &Context<'_>, proposal: &Proposal) -> Effects {
        self.heard_of(proposal.view);
        let again = self.proposed.is_some_and(|known| {
            known.view == proposal.view
                && known.mission_id == proposal.mission_id
                && known.place == proposal.place.saturating_add(1)
        });
        let from = Effects {
            proposed_by: Some(Proposer::Neighbour),
            ..Effects::NONE
        };
        if again {
            let path = context.path(proposal.place);
            self.circulation.on_duplicate(context.now, path);
            return Effects {
                repeated: true,
                ..from
            };
        }
        let told = Some(proposal.poll);
        let effects = self.propose(
            context,
            proposal.view,
            proposal.mission_id,
            proposal.place,
            told,
        );
        if let Some(effects) = effects {
            return Effects {
                proposed_by: from.proposed_by,
                ..effects
            };
        }
        // Late, or from a leader that has missed something.
        if self.stragglers.one_more() {
            // Whoever proposes has to take a later one.
            if let Some(later) = self.newest.next_by(context.member.node) {
                self.heard_of(later);
            }
            return Effects {
                proposed_by: from.proposed_by,
                ..Effects::FOREIGN
            };
        }
        Effects {
            stale: true,
            ..from
        }
    }

    /// A proposal has come through `place` relays before this one; `None` if a later one has.
    pub(super) fn propose(
        &mut self,
        context: &Context<'_>,
        view: ViewId,
        mission_id: MissionId,
        place: u16,
        told: Option<Poll>,
    ) -> Option<Effects> {
        let node = context.member.node;
        let poll = self.electorate.vote(node, view, told, context.held)?;
        // However far ahead it is, this relay has had part in it.
        self.newest = self.newest.max(view);
        self.stragglers = Stragglers::NONE;
        self.proposed = Some(Proposed {
            view,
            mission_id,
            place: place.saturating_add(1),
            poll,
            handed_to: None,
            base: poll.agreed,
            there: 0,
            decided: None,
            lease_left: 0,
        });
        self.circulation.start(context.now);
        let effects = if context.end {
            self.decide(context)
        } else {
            Effects::NONE
        };
        Some(Effects {
            view_proposed: true,
            ..effects
        })
    }

    /// The chain ends here: if a proposal has come so far, everybody is counted.
    pub(crate) fn decide(&mut self, context: &Context<'_>) -> Effects {
        let Some(proposed) = self.awaited() else {
            return Effects::NONE;
        };
        if proposed.handed_to.is_some() {
            self.abandon(context, proposed.view);
            return Effects::NONE;
        }
        let Proposed {
            view, place, poll, ..
        } = proposed;
        let outcome = if context.member.settings.quorum {
            electorate::decide(&poll, view, place, context.member.all)
        } else {
            Outcome::View(View {
                id: view,
                relays: place,
            })
        };
        let lease_left = if place == context.member.all {
            0
        } else {
            electorate::rest(&poll, context.longest_lease())
        };
        let decided = match outcome {
            Outcome::Refused => None,
            Outcome::View(view) => Some(view),
        };
        let conclusion = Conclusion {
            there: place,
            base: poll.agreed,
            view: decided,
            lease_left,
        };
        self.conclude(context, conclusion)
    }

    /// Somebody may be back who could not be heard.
    pub(super) fn wait_after_refusal(&mut self, context: &Context<'_>) {
        let wait = context.settings().probe_after;
        self.asking.ask_after_refusal(context.now, wait);
    }

    fn on_decision(&mut self, context: &Context<'_>, decision: &Decision) -> Effects {
        match self.awaited() {
            Some(proposed)
                if proposed.view == decision.proposal
                    && proposed.mission_id == decision.mission_id
                    && proposed.place.saturating_add(1) == decision.place
                    && decision.there > proposed.place
                    && decision.view.is_none_or(|view| {
                        view.id != proposed.view || view.relays > proposed.place
                    }) =>
            {
                let conclusion = Conclusion {
                    there: decision.there,
                    base: decision.base,
                    view: decision.view,
                    lease_left: decision.lease_left,
                };
                self.conclude(context, conclusion)
            }
            _ => Effects::STALE,
        }
    }

    fn conclude(&mut self, context: &Context<'_>, conclusion: Conclusion) -> Effects {
        let Conclusion {
            there,
            base,
            view: decided,
            lease_left,
        } = conclusion;
        let Some(proposed) = &mut self.proposed else {
            return Effects::NONE;
        };
        let holds = [context.latest, context.member.active].contains(&proposed.mission_id);
        if !holds {
            // A newer mission has taken its place since: the others come to hold that one, too.
            return Effects::FOREIGN;
        }
        let proposal = proposed.view;
        if !self.electorate.accept(proposal, base, decided) {
            // It is the decision on a proposal of the same number by another node with the number of the proposer.
            self.abandon(context, proposal);
            return Effects::STALE;
        }
        let taught = base.id > proposed.poll.agreed.id;
        proposed.base = base;
        proposed.there = there;
        proposed.decided = decided;
        proposed.lease_left = lease_left;
        let leads = proposed.place == 1;
        if leads && decided.is_some() {
            // So have all the others.
            self.electorate.commit();
        }
        self.refused = decided.is_none();
        let path = context.path(proposed.place.saturating_sub(1));
        self.circulation.complete(context.now, path);
        self.asking.stop();
        if leads && decided.is_none() {
            // Who has heard of a newer view only now has a voice at once.
            if taught {
                self.asking.ask_anew(context.now);
            } else {
                self.wait_after_refusal(context);
            }
        }
        let came = match decided {
            Some(view) if view.id == proposal => Decided::Granted {
                relays: view.relays,
                lease_left,
            },
            Some(_) => Decided::Earlier,
            None => Decided::Refused,
        };
        Effects {
            decided: Some(came),
            ..Effects::NONE
        }
    }
}

impl ViewChange {
    /// What could not be said to the neighbour after can be now.
    pub(crate) fn resend(&mut self) {
        self.circulation.resend();
    }

    /// Whether the proposal is to be sent onward, to node `to`; it is taken for sent then.
    pub(crate) fn take_onward(&mut self, context: &Context<'_>, to: u16) -> Option<Message> {
        let proposal = self.awaited()?.view;
        if !self.circulation.poll_forward() {
            return None;
        }
        let proposed = self.proposed.as_mut()?;
        if *proposed.handed_to.get_or_insert(to) != to {
            self.abandon(context, proposal);
            return None;
        }
        let proposed = *proposed;
        let path = context.path(context.member.all);
        self.circulation.await_result(context.now, path);
        Some(Message::Proposal(Proposal {
            mission_id: proposed.mission_id,
            view: proposed.view,
            place: proposed.place,
            poll: proposed.poll,
        }))
    }

    /// What is to be sent back; it is taken for sent then.
    pub(crate) fn take_back(&mut self) -> Option<Message> {
        let proposed = self.proposed?;
        Some(match self.circulation.poll_reply()? {
            Reply::Result => Message::Decision(Decision {
                mission_id: proposed.mission_id,
                proposal: proposed.view,
                place: proposed.place,
                there: proposed.there,
                base: proposed.base,
                view: proposed.decided,
                lease_left: proposed.lease_left,
            }),
            Reply::InProgress => Message::Busy {
                sweep: proposed.view.mark(),
            },
        })
    }

    /// A message is said to have arrived: whether it is the proposal.
    pub(crate) fn on_busy(&mut self, context: &Context<'_>, number: u16) -> bool {
        let known = self
            .awaited()
            .is_some_and(|proposed| proposed.view.mark() == number);
        if known {
            let path = context.path(context.member.all);
            self.circulation.on_in_progress(context.now, path);
        }
        known
    }
}

impl ViewChange {
    /// `leads` tells whether nobody is before this relay, `fresh` whether nothing has come to it since it was switched on.
    pub(crate) fn handle_timeout(
        &mut self,
        context: &Context<'_>,
        leads: bool,
        fresh: bool,
    ) -> Effects {
        let hop_time = context.settings().hop_time;
        let resent = self.circulation.handle_timeout(context.now, hop_time);
        let effects = if self.asking.is_due(context.now) {
            self.ask_again(context, leads, fresh)
        } else {
            Effects::NONE
        };
        Effects { resent, ..effects }
    }

    /// It has not come yet, or it is time to ask for a place in the chain.
    fn ask_again(&mut self, context: &Context<'_>, leads: bool, fresh: bool) -> Effects {
        let settings = &context.member.settings;
        if !self.asking.take_due(context.now, fresh, settings) {
            return Effects::NONE;
        }
        if !leads {
            return Effects {
                ask: true,
                ..Effects::NONE
            };
        }
        let under_way = self.awaited().is_some_and(|proposed| {
            proposed.view >= self.newest && proposed.mission_id == context.latest
        });
        let newest = self.newest.max(self.electorate.promised());
        let next = newest.next_by(context.member.node);
        let Some(view) = next.filter(|_| !under_way) else {
            return Effects::NONE;
        };
        // A number is spent where something may come of it.
        let Member { node, all, .. } = *context.member;
        let alone = self.refused && context.end && context.settings().quorum;
        if alone
            && self
                .electorate
                .is_refused_alone(node, view, all, context.held)
        {
            self.wait_after_refusal(context);
            return Effects::NONE;
        }
        self.heard_of(view);
        let Some(effects) = self.propose(context, view, context.latest, 0, None) else {
            return Effects::NONE;
        };
        Effects {
            began: true,
            proposed_by: Some(Proposer::Itself),
            ..effects
        }
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.asking.next_timeout(), self.circulation.next_timeout())
    }
}

/// A proposal, as one relay sees it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Proposed {
    /// The new view.
    pub(crate) view: ViewId,
    /// The mission that it is to fly.
    pub(crate) mission_id: MissionId,
    /// This relay's place in it, from 1 at the leader.
    pub(crate) place: u16,
    /// What it has gathered, this relay's voice included.
    pub(super) poll: Poll,
    /// The one node that it was handed on to: were it handed to another one, too, two views could bear its name.
    pub(super) handed_to: Option<u16>,
    /// The view that the decision follows, once that is known.
    pub(crate) base: View,
    /// How many have taken part in it, once that is known.
    pub(super) there: u16,
    /// What was decided on, once that is known; `None` if too few are there.
    pub(super) decided: Option<View>,
    pub(super) lease_left: u16,
}

/// What came of a proposal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conclusion {
    /// How many have taken part.
    pub(super) there: u16,
    /// The view that is followed.
    pub(super) base: View,
    pub(super) view: Option<View>,
    pub(super) lease_left: u16,
}
