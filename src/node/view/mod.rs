//! The view change: how the chain comes to a new view of who is in it.
//!
//! A *view* is the chain as it was agreed on last: how many relays there are, and the place of each. View 0 is the chain as the
//! mission has it. Every pass bears its view in its digest, so none is taken up in another view. When a relay finds
//! somebody else beside it than in its view, or gets a pass that it cannot take part in, it asks toward the leader for a new
//! one, hop by hop, until it comes. The leader is whoever has nobody before it: it proposes the view, the proposal goes onward and
//! counts who is there, and the decision travels back.
//!
//! | what a relay finds | what it does |
//! | --- | --- |
//! | another node beside it than agreed on, which has taken it, too; or nobody | asks for a view |
//! | a pass of another view, of another incarnation of its leader, or one that comes after others which it missed | asks for a view |
//! | no pass for a while after it was switched on | asks for a view |
//! | a hello that asks, of a neighbour that knows as new a view, or has just been switched on | asks for a view |
//! | a newer mission than the one it flies | asks for a view, which flies it if all hold it |
//! | a proposal, when it is the last | decides, by the rules of [`electorate`] |
//! | the lease of its view has run out, or a view was refused | asks for a view, less and less often |
//!
//! | state | a newer proposal comes | the same again | the decision comes | nobody is after it any more, and nobody was handed it |
//! | --- | --- | --- | --- | --- |
//! | `Settled` | hand on: `Proposed` | - | stale | - |
//! | `Proposed` | hand on | say busy | hand back: `Decided` | decide: `Decided` |
//! | `Decided` | hand on: `Proposed` | hand back again | stale | - |
//!
//! While a view is proposed no pass goes on. One that was refused leaves the places where they are; its leader proposes again every
//! `probe_after`. A proposal that was handed on stays with the node that it was handed to: once another one, or nobody, is there, a
//! later one is asked for.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`electorate`] | who may decide, and what a relay has said in the votes |
//! | [`record`] | that, as it is stored |
//! | `model` | a test: all that can happen to a chain of three or four |

pub(crate) mod electorate;
#[cfg(test)]
#[cfg(not(target_os = "none"))]
mod model;
pub(crate) mod record;
#[cfg(test)]
mod tests;

use super::context::{Context, Decided, Effects, Member, Proposer};
use super::numbering::Stragglers;
use super::retransmit::{Again, Retransmit};
use super::timing::{PAUSE, earliest};
use crate::jitter::Jitter;
use crate::settings::Settings;
use crate::time::{Duration, Instant};
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal};

use electorate::{Electorate, Outcome};
use record::{RecordError, ViewRecord};

/// How far ahead of all it has heard of a view may be that a relay hears of.
const LEAP: u32 = 256;

/// Where the view change is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
enum ViewState {
    Settled,
    Proposed,
    Decided,
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
    poll: Poll,
    /// The one node that it was handed on to: were it handed to another one, too, two views could bear its name.
    handed_to: Option<u16>,
    /// The view that the decision follows, once that is known.
    pub(crate) base: View,
    /// How many have taken part in it, once that is known.
    there: u16,
    /// What was decided on, once that is known; `None` if too few are there.
    decided: Option<View>,
    lease_left: u16,
}

/// What came of a proposal.
#[derive(Clone, Copy, Debug)]
struct Verdict {
    /// How many have taken part.
    there: u16,
    /// The view that is followed.
    base: View,
    view: Option<View>,
    lease_left: u16,
}

/// What is to be sent.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
struct ViewDue {
    proposal: bool,
    decision: bool,
    busy: bool,
}

/// The view change, as one relay takes part in it.
#[derive(Clone, Debug)]
pub(crate) struct ViewChange {
    state: ViewState,
    proposed: Option<Proposed>,
    electorate: Electorate,
    /// The latest view heard of.
    newest: ViewId,
    /// Whether this relay asks for a new view, and how often it has since.
    asks: bool,
    tries: u8,
    ask_at: Option<Instant>,
    /// Whether the last decision was that too few are there.
    refused: bool,
    stragglers: Stragglers,
    retransmit: Retransmit,
    jitter: Jitter,
    due: ViewDue,
}

impl ViewChange {
    /// Of a chain of so many relays, led by node `elder`.
    pub(crate) const fn new(relays: u16, elder: u16, seed: u32) -> Self {
        Self {
            electorate: Electorate::new(relays, elder),
            state: ViewState::Settled,
            proposed: None,
            newest: ViewId::LOADED,
            asks: false,
            tries: 0,
            ask_at: None,
            refused: false,
            stragglers: Stragglers::NONE,
            retransmit: Retransmit::new(seed),
            jitter: Jitter::new(seed),
            due: ViewDue {
                proposal: false,
                decision: false,
                busy: false,
            },
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
            self.asks = true;
            self.ask_at = Some(now + PAUSE);
        }
        Ok(())
    }

    /// The latest view heard of.
    pub(crate) const fn newest(&self) -> ViewId {
        self.newest
    }

    /// Somebody knows that view. One too far ahead is not believed: it could be the last there can be.
    pub(crate) fn heard_of(&mut self, view: ViewId) {
        let near = view.number() <= self.newest.number().saturating_add(LEAP);
        if view > self.newest && near {
            self.newest = view;
        }
    }

    /// What was agreed on in `view`, the one accepted last, has come: all have accepted it.
    pub(crate) fn commit(&mut self, view: ViewId) {
        if self.electorate.awaits(view) {
            self.electorate.commit();
        }
    }

    /// Whether this relay asks for a new view.
    pub(crate) const fn asks(&self) -> bool {
        self.asks
    }

    /// Asks for a new view, from now on until it comes.
    pub(crate) fn ask(&mut self, now: Instant) {
        if !self.asks {
            self.asks = true;
            self.tries = 0;
            self.ask_at = Some(now + PAUSE);
        }
    }

    /// The same at once, however often it has asked in vain: something new has come to be known.
    pub(crate) fn ask_anew(&mut self, now: Instant) {
        self.asks = false;
        self.ask(now);
    }

    /// Something has come to be certain: if it asks, it asks anew at once.
    pub(crate) fn hasten(&mut self, now: Instant) {
        if self.asks {
            self.tries = 0;
            self.ask_at = Some(now + PAUSE);
        }
    }

    /// Whether it is time to ask.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.ask_at.is_some_and(|at| at <= now)
    }

    /// The first pass should have come by `at`; if it has not, a view is asked for.
    pub(crate) const fn await_first(&mut self, at: Instant) {
        self.ask_at = Some(at);
    }

    /// The proposal whose decision is awaited.
    pub(crate) fn awaited(&self) -> Option<Proposed> {
        self.proposed.filter(|_| self.state == ViewState::Proposed)
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
    fn abandon(&mut self, context: &Context<'_>, proposal: ViewId) {
        if self.newest <= proposal
            && let Some(later) = proposal.next_by(context.member.node)
        {
            self.heard_of(later);
        }
        self.ask_anew(context.now);
    }

    /// A proposal or a decision from the neighbour before or after, of a mission that this relay holds.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let all = context.member.all;
        match message {
            // A chain has no more relays than its mission.
            Message::Proposal(proposal) if proposal.place < all => {
                self.on_proposal(context, proposal)
            }
            Message::Decision(decision) if decision.view.is_none_or(|view| view.relays <= all) => {
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
            if self.state == ViewState::Proposed {
                self.due.busy = true;
                let hop_time = context.settings().hop_time;
                self.retransmit.came_again(context.now, hop_time);
            } else {
                self.due.decision = true;
                let way = context.way(proposal.place);
                self.retransmit.asked(context.now, way);
            }
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
    fn propose(
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
        self.state = ViewState::Proposed;
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
        self.retransmit.begin();
        self.due = ViewDue::default();
        let effects = if context.end {
            self.decide(context)
        } else {
            self.due.proposal = true;
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
        let verdict = Verdict {
            there: place,
            base: poll.agreed,
            view: decided,
            lease_left,
        };
        self.conclude(context, verdict)
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
                let verdict = Verdict {
                    there: decision.there,
                    base: decision.base,
                    view: decision.view,
                    lease_left: decision.lease_left,
                };
                self.conclude(context, verdict)
            }
            _ => Effects::STALE,
        }
    }

    fn conclude(&mut self, context: &Context<'_>, verdict: Verdict) -> Effects {
        let Verdict {
            there,
            base,
            view: decided,
            lease_left,
        } = verdict;
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
        self.state = ViewState::Decided;
        self.refused = decided.is_none();
        let way = context.way(proposed.place.saturating_sub(1));
        self.retransmit.answered(context.now, way);
        self.due = ViewDue {
            decision: !leads,
            ..ViewDue::default()
        };
        self.asks = false;
        self.ask_at = None;
        if leads && decided.is_none() {
            // Somebody may be back who could not be heard. Who has heard of a newer view only now has a voice at once.
            self.asks = true;
            let wait = if taught {
                PAUSE
            } else {
                context.member.settings.probe_after
            };
            self.ask_at = Some(context.now + self.jitter.spread(wait));
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

    /// A message is said to have arrived: whether it is the proposal.
    pub(crate) fn on_busy(&mut self, context: &Context<'_>, number: u16) -> bool {
        let known = self
            .awaited()
            .is_some_and(|proposed| proposed.view.mark() == number);
        if known {
            let way = context.way(context.member.all);
            self.retransmit.arrived(context.now, way);
        }
        known
    }

    /// What could not be said to the neighbour after can be now.
    pub(crate) fn resend(&mut self) {
        self.due.proposal |= self.state == ViewState::Proposed;
    }

    /// `leads` tells whether nobody is before this relay, `fresh` whether nothing has come to it since it was switched on.
    pub(crate) fn handle_timeout(
        &mut self,
        context: &Context<'_>,
        leads: bool,
        fresh: bool,
    ) -> Effects {
        let mut resent = false;
        let hop_time = context.settings().hop_time;
        match self.retransmit.take_due(context.now, hop_time) {
            Some(Again::Onward) if self.state == ViewState::Proposed => {
                self.due.proposal = true;
                resent = true;
            }
            Some(Again::Back) => self.due.decision = true,
            _ => {}
        }
        let effects = if self.is_due(context.now) {
            self.ask_at = None;
            self.ask_again(context, leads, fresh)
        } else {
            Effects::NONE
        };
        Effects { resent, ..effects }
    }

    /// It has not come yet, or it is time to ask for a place in the chain.
    fn ask_again(&mut self, context: &Context<'_>, leads: bool, fresh: bool) -> Effects {
        if !self.asks {
            if !fresh {
                return Effects::NONE;
            }
            self.asks = true;
            self.tries = 0;
        }
        self.ask_at = Some(context.now + self.patience(&context.member.settings));
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

    /// How long to wait before asking again: twice as long each time, up to `probe_after`.
    fn patience(&mut self, settings: &Settings) -> Duration {
        let wait = settings.hop_time.times(8 << self.tries.min(12));
        self.tries = self.tries.saturating_add(1);
        wait.min(settings.probe_after)
    }

    /// Whether the proposal is to be sent onward, to node `to`; it is taken for sent then.
    pub(crate) fn take_onward(&mut self, context: &Context<'_>, to: u16) -> Option<Message> {
        let proposal = self.awaited()?.view;
        if !core::mem::take(&mut self.due.proposal) {
            return None;
        }
        let proposed = self.proposed.as_mut()?;
        if *proposed.handed_to.get_or_insert(to) != to {
            self.abandon(context, proposal);
            return None;
        }
        let proposed = *proposed;
        let way = context.way(context.member.all);
        self.retransmit.sent(context.now, way);
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
        if core::mem::take(&mut self.due.decision) && self.state != ViewState::Proposed {
            return Some(Message::Decision(Decision {
                mission_id: proposed.mission_id,
                proposal: proposed.view,
                place: proposed.place,
                there: proposed.there,
                base: proposed.base,
                view: proposed.decided,
                lease_left: proposed.lease_left,
            }));
        }
        core::mem::take(&mut self.due.busy).then_some(Message::Busy {
            sweep: proposed.view.mark(),
        })
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.ask_at, self.retransmit.next_timeout())
    }
}
