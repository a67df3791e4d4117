//! The view change: how the chain comes to a new view of who is in it.
//!
//! A *view* is the chain as it was agreed on last: how many relays there are, and the place of each. View 0 is the chain as the
//! mission has it. Every pass bears its view's number in its digest, so none is taken up in another view. When a relay finds
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
//! | a proposal, when it is the last | decides: more than half of the view before, or half with its leader, are a chain |
//!
//! | state | a newer proposal comes | the same again | the decision comes | nobody is after it any more |
//! | --- | --- | --- | --- | --- |
//! | `Settled` | hand on: `Proposed` | - | stale | - |
//! | `Proposed` | hand on | say busy | hand back: `Decided` | decide: `Decided` |
//! | `Decided` | hand on: `Proposed` | hand back again | stale | - |
//! | `NoQuorum` (leader) | hand on: `Proposed` | - | stale | - |
//!
//! While a view is proposed no pass goes on. One that was decided against leaves the places where they are.

use super::context::{Context, Decided, Effects, Proposer};
use super::numbering::Stragglers;
use super::retransmit::{Retransmit, Trip};
use super::timing::{PAUSE, earliest};
use crate::settings::Settings;
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, PriorView, Proposal};

/// Where the view change is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum ViewState {
    Settled,
    Proposed,
    Decided,
    NoQuorum,
}

/// A proposal, as one relay sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proposed {
    /// Number of the new view.
    pub(crate) view: u16,
    /// The mission that it is to fly.
    pub(crate) mission_id: MissionId,
    /// This relay's place in it, from 1 at the leader.
    pub(crate) place: u16,
    /// The newest view that a relay up to this one has agreed to.
    before: PriorView,
    /// How many relays there are, once that is known; `None` if too few.
    relays: Option<u16>,
}

/// What is to be sent.
#[derive(Clone, Copy, Debug, Default)]
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
    /// The largest number of a view heard of.
    newest: u16,
    /// Whether this relay asks for a new view, and how often it has since.
    asks: bool,
    tries: u8,
    ask_at: Option<Instant>,
    stragglers: Stragglers,
    retransmit: Retransmit,
    due: ViewDue,
}

impl ViewChange {
    pub(crate) const fn new(seed: u32) -> Self {
        Self {
            state: ViewState::Settled,
            proposed: None,
            newest: 0,
            asks: false,
            tries: 0,
            ask_at: None,
            stragglers: Stragglers::NONE,
            retransmit: Retransmit::new(seed),
            due: ViewDue {
                proposal: false,
                decision: false,
                busy: false,
            },
        }
    }

    /// The largest number of a view heard of.
    pub(crate) const fn newest(&self) -> u16 {
        self.newest
    }

    /// A view of this number is known to somebody.
    pub(crate) const fn heard_of(&mut self, view: u16) {
        if view > self.newest {
            self.newest = view;
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

    /// Whether this relay leads a part of the chain that is too small.
    pub(crate) fn has_no_quorum(&self) -> bool {
        self.state == ViewState::NoQuorum
    }

    /// A proposal or a decision from the neighbour before or after, of a mission that this relay holds.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let all = context.member.all;
        match message {
            // A chain has no more relays than its mission.
            Message::Proposal(proposal) if proposal.place < all => {
                self.on_proposal(context, proposal)
            }
            Message::Decision(decision) if decision.relays.is_none_or(|relays| relays <= all) => {
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
            } else {
                self.due.decision = true;
            }
            return Effects {
                repeated: true,
                ..from
            };
        }
        let agreed = context.member.view;
        let newest = self
            .awaited()
            .map_or(agreed, |known| known.view.max(agreed));
        if proposal.view <= newest {
            // Late, or from a leader that has missed something.
            if self.stragglers.one_more() {
                // Whoever proposes has to take a higher number.
                self.heard_of(self.newest.saturating_add(1));
                return Effects {
                    proposed_by: from.proposed_by,
                    ..Effects::FOREIGN
                };
            }
            return Effects {
                stale: true,
                ..from
            };
        }
        let before = Some(proposal.before);
        let effects = self.propose(
            context,
            proposal.view,
            proposal.mission_id,
            proposal.place,
            before,
        );
        Effects {
            proposed_by: from.proposed_by,
            ..effects
        }
    }

    /// A proposal has come through `place` relays before this one.
    fn propose(
        &mut self,
        context: &Context<'_>,
        view: u16,
        mission_id: MissionId,
        place: u16,
        before: Option<PriorView>,
    ) -> Effects {
        let mission = &context.member.mission;
        let known = PriorView {
            view: context.member.view,
            relays: mission.relays(),
            leader: context.member.index == mission.leader(),
        };
        let before = match before {
            Some(told) if told.view > known.view => told,
            Some(told) if told.view == known.view => PriorView {
                leader: told.leader || known.leader,
                ..told
            },
            _ => known,
        };
        self.state = ViewState::Proposed;
        self.stragglers = Stragglers::NONE;
        self.proposed = Some(Proposed {
            view,
            mission_id,
            place: place.saturating_add(1),
            before,
            relays: None,
        });
        self.retransmit.heard();
        self.retransmit.stop();
        self.due = ViewDue::default();
        let effects = if context.end {
            self.decide(context)
        } else {
            self.due.proposal = true;
            Effects::NONE
        };
        Effects {
            view_proposed: true,
            ..effects
        }
    }

    /// The chain ends here: if a proposal has come so far, everybody is counted.
    pub(crate) fn decide(&mut self, context: &Context<'_>) -> Effects {
        let Some(proposed) = self.awaited() else {
            return Effects::NONE;
        };
        // Of two halves the one with the leader is the larger.
        let there = 2 * u32::from(proposed.place) + u32::from(proposed.before.leader);
        let enough = !context.member.settings.quorum || there > u32::from(proposed.before.relays);
        self.conclude(context, enough.then_some(proposed.place))
    }

    fn on_decision(&mut self, context: &Context<'_>, decision: &Decision) -> Effects {
        match self.awaited() {
            Some(proposed)
                if proposed.view == decision.view
                    && proposed.mission_id == decision.mission_id
                    && proposed.place.saturating_add(1) == decision.place
                    && decision.relays.is_none_or(|relays| relays > proposed.place) =>
            {
                self.conclude(context, decision.relays)
            }
            _ => Effects::STALE,
        }
    }

    fn conclude(&mut self, context: &Context<'_>, relays: Option<u16>) -> Effects {
        let Some(proposed) = &mut self.proposed else {
            return Effects::NONE;
        };
        let holds = [context.latest, context.member.active].contains(&proposed.mission_id);
        if !holds {
            // A newer mission has taken its place since: the others come to hold that one, too.
            return Effects::FOREIGN;
        }
        proposed.relays = relays;
        let leads = proposed.place == 1;
        self.state = if relays.is_none() && leads {
            ViewState::NoQuorum
        } else {
            ViewState::Decided
        };
        self.retransmit.stop();
        self.due = ViewDue {
            decision: !leads,
            ..ViewDue::default()
        };
        // Until somebody else is found there is nothing to ask again.
        self.asks = false;
        self.ask_at = None;
        Effects {
            decided: Some(relays.map_or(Decided::Refused, Decided::Granted)),
            ..Effects::NONE
        }
    }

    /// A message is said to have arrived: whether it is the proposal.
    pub(crate) fn on_busy(&mut self, context: &Context<'_>, number: u16) -> bool {
        let known = self
            .awaited()
            .is_some_and(|proposed| proposed.view == number);
        if known {
            // What is missing is the decision, and that may take its time.
            self.retransmit.heard();
            self.retransmit.sent(context.now, trip(context));
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
        if self.retransmit.is_due(context.now) && self.state == ViewState::Proposed {
            self.due.proposal = true;
            resent = true;
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
        let Some(view) = self.newest.checked_add(1).filter(|_| !under_way) else {
            return Effects::NONE;
        };
        self.heard_of(view);
        let effects = self.propose(context, view, context.latest, 0, None);
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

    /// Whether the proposal is to be sent onward; it is taken for sent then.
    pub(crate) fn take_onward(&mut self, context: &Context<'_>) -> Option<Message> {
        let proposed = self.awaited()?;
        if !core::mem::take(&mut self.due.proposal) {
            return None;
        }
        self.retransmit.sent(context.now, trip(context));
        Some(Message::Proposal(Proposal {
            mission_id: proposed.mission_id,
            view: proposed.view,
            place: proposed.place,
            before: proposed.before,
        }))
    }

    /// What is to be sent back; it is taken for sent then.
    pub(crate) fn take_back(&mut self) -> Option<Message> {
        let proposed = self.proposed?;
        if core::mem::take(&mut self.due.decision) && self.state != ViewState::Proposed {
            return Some(Message::Decision(Decision {
                mission_id: proposed.mission_id,
                view: proposed.view,
                place: proposed.place,
                relays: proposed.relays,
            }));
        }
        core::mem::take(&mut self.due.busy).then_some(Message::Busy {
            sweep: proposed.view,
        })
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.ask_at, self.retransmit.next_timeout())
    }
}

/// What a decision has to travel: at most through all relays of the mission.
const fn trip(context: &Context<'_>) -> Trip {
    Trip {
        hop_time: context.member.settings.hop_time,
        hops: context.member.all,
        slow: false,
    }
}

#[cfg(test)]
mod tests {
    use super::{Proposed, ViewChange, ViewState};
    use crate::mission::Mission;
    use crate::mission::tests::paper;
    use crate::node::context::{Context, Decided, Effects, Member, Proposer};
    use crate::settings::Settings;
    use crate::time::Instant;
    use crate::wire::digest::MissionId;
    use crate::wire::message::{Decision, Message, PriorView, Proposal};

    /// Relay 2 of 3, which holds mission 4 and flies the one it was loaded with.
    struct Second {
        member: Member,
        latest: MissionId,
    }

    impl Second {
        fn new() -> Self {
            let mission = Mission::try_new(paper(3)).unwrap();
            Self {
                member: Member::new(mission, Settings::default(), 2),
                latest: MissionId {
                    version: 4,
                    digest: 0x1234,
                },
            }
        }

        fn context(&self) -> Context<'_> {
            Context {
                now: Instant::ZERO,
                member: &self.member,
                latest: self.latest,
                end: false,
                measured_per_w: None,
            }
        }

        fn proposal(&self, view: u16) -> Message {
            Message::Proposal(Proposal {
                mission_id: self.latest,
                view,
                place: 1,
                before: PriorView {
                    view: 0,
                    relays: 3,
                    leader: true,
                },
            })
        }
    }

    fn decision_on(view: u16, mission_id: MissionId) -> Message {
        Message::Decision(Decision {
            mission_id,
            view,
            place: 3,
            relays: Some(3),
        })
    }

    const FROM: Effects = Effects {
        proposed_by: Some(Proposer::Neighbour),
        ..Effects::NONE
    };

    /// The leader was switched on again in the midst of a proposal, and has been offered another mission.
    #[test]
    fn a_proposal_of_the_same_view_with_another_mission_is_another() {
        let mut relay = Second::new();
        let mut view = ViewChange::new(1);
        let first = relay.proposal(1);
        let proposed = Effects {
            view_proposed: true,
            ..FROM
        };
        assert_eq!(view.handle(&relay.context(), &first), proposed);
        let repeated = Effects {
            repeated: true,
            ..FROM
        };
        assert_eq!(view.handle(&relay.context(), &first), repeated);
        relay.latest.version = 5;
        let stale = Effects {
            stale: true,
            ..FROM
        };
        let again = relay.proposal(1);
        assert_eq!(view.handle(&relay.context(), &again), stale);
    }

    #[test]
    fn a_decision_is_of_the_mission_that_was_proposed() {
        let relay = Second::new();
        let mut view = ViewChange::new(1);
        view.handle(&relay.context(), &relay.proposal(1));
        let other = MissionId {
            version: 5,
            ..relay.latest
        };
        let decision = decision_on(1, other);
        assert_eq!(view.handle(&relay.context(), &decision), Effects::STALE);
        let decided = Effects {
            decided: Some(Decided::Granted(3)),
            ..Effects::NONE
        };
        let decision = decision_on(1, relay.latest);
        assert_eq!(view.handle(&relay.context(), &decision), decided);
    }

    /// A newer mission has taken the place of the one proposed: it cannot be flown any more.
    #[test]
    fn who_has_lost_the_mission_has_no_part_in_its_view() {
        let mut relay = Second::new();
        let mut view = ViewChange::new(1);
        view.handle(&relay.context(), &relay.proposal(1));
        let decision = decision_on(1, relay.latest);
        relay.latest.version = 5;
        assert_eq!(view.handle(&relay.context(), &decision), Effects::FOREIGN);
        assert_eq!(view.state, ViewState::Proposed);
        assert!(matches!(view.proposed, Some(Proposed { relays: None, .. })));
    }
}
