//! View change at one relay: a proposal is received, forwarded and decided.
//!
//! A proposal travels as [`Circulation`] describes, with these additions:
//!
//! | stage | newer proposal received | decision received | no neighbour after this relay, proposal not forwarded |
//! | --- | --- | --- | --- |
//! | `Idle` | vote, forward it: `Outstanding` | stale | - |
//! | `Outstanding` | vote, forward it | reply with it: `Completed` | decide: `Completed` |
//! | `Completed` | vote, forward it: `Outstanding` | stale | - |
//!
//! No pass is forwarded while a proposal is outstanding. A refused proposal leaves the positions unchanged. Its leader
//! proposes again after `probe_after` or later ([`ViewRequest`]). A leader without neighbours does so only if its own
//! vote would suffice. A proposal is bound to the node that it was forwarded to. If that neighbour is lost or replaced,
//! this relay requests a later view.
//!
//! The first request for a view is sent at once. It is repeated until a view is decided.

use crate::node::circulation::{Circulation, LateMessages, Reply};
use crate::node::context::{
    Context, Effects, LayerEvent, Member, PAUSE, ProposalOutcome, Proposer, earliest,
};
use crate::node::view::electorate;
use crate::node::view::electorate::Electorate;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::settings::Settings;
use crate::time::{Duration, Instant, Jitter};
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal};

/// Maximum increase of the latest known view number by one message. So no single message can use up all numbers.
const MAX_ADVANCE: u32 = 4096;

/// State of one relay in a view change: the relays' agreement on the members of the chain.
#[derive(Clone, Debug)]
pub(crate) struct ViewChange {
    /// Transmission state of the view proposal along the chain, and of its reply. Its stage is `Outstanding` while this
    /// relay awaits the decision.
    pub(super) circulation: Circulation,
    pub(super) proposed: Option<Proposed>,
    pub(super) electorate: Electorate,
    /// Identifier of the latest view that this relay knows to be proposed or agreed on.
    pub(super) newest: ViewId,
    pub(crate) request: ViewRequest,
    /// True if the last decision refused a view because of a missing quorum.
    pub(super) refused: bool,
    pub(super) late_messages: LateMessages,
}

impl ViewChange {
    /// Creates the state of view changes for a chain of `relays` relays. `initial_leader` is the node number of the
    /// leader before any view change.
    pub(crate) const fn new(relays: u16, initial_leader: u16, seed: u32) -> Self {
        Self {
            electorate: Electorate::new(relays, initial_leader),
            circulation: Circulation::new(seed),
            proposed: None,
            newest: ViewId::LOADED,
            request: ViewRequest::new(seed),
            refused: false,
            late_messages: LateMessages::NONE,
        }
    }

    /// Returns the record of this relay's votes on views, which the firmware stores. `base` is the digest (hash) of the
    /// mission loaded before flight.
    pub(crate) const fn record(&self, base: u16) -> ViewRecord {
        ViewRecord::new(base, self.electorate)
    }

    /// Returns true until this relay sends or receives its first view-change message.
    pub(crate) fn is_untouched(&self) -> bool {
        self.proposed.is_none() && self.newest == self.electorate.promised()
    }

    /// Restores the stored votes on views after a start of the relay, and requests a view. `untouched` is true if the
    /// agreement on positions has not started.
    ///
    /// Returns an error if this relay has already taken part in an agreement, or had loaded a different mission when
    /// the votes were stored.
    pub(crate) fn resume(
        &mut self,
        now: Instant,
        member: &Member,
        record: &ViewRecord,
        untouched: bool,
    ) -> Result<(), RecordError> {
        let initial_leader = self.electorate.initial_leader;
        let electorate = record
            .electorate(member.digest, member.all, initial_leader)
            .ok_or(RecordError::Base)?;
        let new = self.electorate == Electorate::new(member.all, initial_leader);
        if !(new && untouched && self.is_untouched()) {
            return Err(RecordError::Begun);
        }
        self.electorate = electorate;
        self.newest = electorate.promised();
        if self.newest > ViewId::LOADED {
            self.request.request_now(now);
        }
        Ok(())
    }

    pub(crate) const fn latest_view(&self) -> ViewId {
        self.newest
    }

    /// Records that some other relay knows `view`. The latest known view number advances by at most [`MAX_ADVANCE`],
    /// because one message could otherwise use up all numbers. A relay that was away for long receives `view`
    /// repeatedly, and so catches up.
    #[inline(never)] // called from many places
    pub(crate) fn observe_view(&mut self, view: ViewId) {
        if view > self.newest {
            self.newest = self.newest.toward(view, MAX_ADVANCE);
        }
    }

    /// Records that all members of `view` have accepted it. The call has no effect unless `view` is the view that this
    /// relay accepted last.
    pub(crate) fn commit(&mut self, view: ViewId) {
        if self.electorate.awaits(view) {
            self.electorate.commit();
        }
    }

    /// Returns the view proposal whose decision is awaited, if any.
    pub(crate) fn outstanding(&self) -> Option<Proposed> {
        self.proposed.filter(|_| self.circulation.is_outstanding())
    }

    /// Returns the last view proposal that this relay has voted on; `None` if there is none.
    pub(crate) const fn proposed(&self) -> Option<Proposed> {
        self.proposed
    }

    /// Returns this relay's rank in the last view proposal, and the number of relays in that proposal. Rank 1 is the
    /// leader. `None` without a proposal.
    pub(crate) fn rank_and_count(&self) -> Option<(u16, u16)> {
        let proposed = self.proposed?;
        Some((proposed.rank, proposed.reached.max(proposed.rank)))
    }

    /// Returns true if the last proposal was refused, because the reachable relays are no quorum.
    pub(crate) const fn has_no_quorum(&self) -> bool {
        self.refused
    }

    /// Requests a view later than `proposal`, because the decision on `proposal` can no longer arrive.
    pub(super) fn request_later_view(&mut self, context: &Context<'_>, proposal: ViewId) {
        if self.newest <= proposal
            && let Some(later) = proposal.next_by(context.member.node)
        {
            self.observe_view(later);
        }
        self.request.request_now(context.now);
    }

    /// Drops the last view proposal and requests a view, as after a restart.
    pub(crate) fn leave(&mut self, now: Instant) {
        self.proposed = None;
        self.circulation.withdraw();
        self.request.request_now(now);
    }

    /// Handles a view proposal or a decision from a neighbour. The caller checks that this relay has stored the mission
    /// of the proposed view.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let all = context.member.all;
        match message {
            // A chain has at most the relays of its mission.
            Message::Proposal(proposal) if proposal.place < all => {
                self.on_proposal(context, proposal)
            }
            // The decided view is later than the view that it replaces.
            Message::Decision(decision)
                if decision
                    .accepted
                    .is_none_or(|view| decision.base.id < view.id && view.relays <= all) =>
            {
                self.on_decision(context, decision)
            }
            _ => Effects::STALE,
        }
    }

    fn on_proposal(&mut self, context: &Context<'_>, proposal: &Proposal) -> Effects {
        self.observe_view(proposal.proposed_view);
        let is_duplicate = self.proposed.is_some_and(|known| {
            known.view == proposal.proposed_view
                && known.mission_id == proposal.mission_id
                && known.rank == proposal.place.saturating_add(1)
        });
        if is_duplicate {
            let path = context.path(proposal.place);
            self.circulation.on_duplicate(context.now, path);
            return Effects::DUPLICATE.by(Proposer::Neighbour);
        }
        let received = Some(proposal.poll);
        let effects = self.propose(
            context,
            proposal.proposed_view,
            proposal.mission_id,
            proposal.place,
            received,
        );
        if let Some(effects) = effects {
            return effects.by(Proposer::Neighbour);
        }
        // The proposal is late, or its leader has missed a later proposal.
        if self.late_messages.count_one() {
            // The proposer must use a later number.
            if let Some(later) = self.newest.next_by(context.member.node) {
                self.observe_view(later);
            }
            return Effects::FOREIGN.by(Proposer::Neighbour);
        }
        Effects::STALE.by(Proposer::Neighbour)
    }

    /// Votes on the proposed `view`, and returns the effects on the other parts of the relay. `place` is the number of
    /// relays that have voted before this one, and `received` has their votes (`None` at the proposer). Returns `None`
    /// if this relay has already promised (Paxos) `view` or a later view.
    pub(super) fn propose(
        &mut self,
        context: &Context<'_>,
        view: ViewId,
        mission_id: MissionId,
        place: u16,
        received: Option<Poll>,
    ) -> Option<Effects> {
        let node = context.member.node;
        let poll = self
            .electorate
            .vote(node, view, received, context.other_leases)?;
        // The number may advance without limit here, because this relay has voted on the view.
        self.newest = self.newest.max(view);
        self.late_messages = LateMessages::NONE;
        self.proposed = Some(Proposed {
            view,
            mission_id,
            rank: place.saturating_add(1),
            poll,
            forwarded_to: None,
            base: poll.agreed,
            reached: 0,
            accepted: None,
            usable_in: 0,
        });
        self.circulation.start(context.now);
        let effects = if context.is_last_reachable {
            self.decide(context)
        } else {
            Effects::NONE
        };
        Some(Effects {
            view_proposed: true,
            ..effects
        })
    }

    /// Decides the outstanding view proposal. Called if this relay is the last one that can be reached, so that all
    /// reachable relays have voted.
    ///
    /// If this relay has already forwarded the proposal, the next relay may decide on it, too. Two different views
    /// could then have the same identifier, so this relay requests a later view instead.
    pub(crate) fn decide(&mut self, context: &Context<'_>) -> Effects {
        let Some(proposed) = self.outstanding() else {
            return Effects::NONE;
        };
        if proposed.forwarded_to.is_some() {
            self.request_later_view(context, proposed.view);
            return Effects::NONE;
        }
        let Proposed {
            view, rank, poll, ..
        } = proposed;
        let accepted = if context.member.settings.quorum {
            electorate::decide(&poll, view, rank, context.member.all)
        } else {
            Some(View {
                id: view,
                relays: rank,
            })
        };
        let usable_in = if rank == context.member.all {
            0
        } else {
            electorate::remaining_wait(&poll, context.longest_lease())
        };
        let decision = ViewDecision {
            reached: rank,
            base: poll.agreed,
            accepted,
            usable_in,
        };
        self.apply_view_decision(context, decision)
    }

    /// Schedules a new view proposal after a refusal, because more relays may be reachable by then.
    pub(super) fn retry_after_refusal(&mut self, context: &Context<'_>) {
        let wait = context.settings().probe_after;
        self.request.request_after_refusal(context.now, wait);
    }

    fn on_decision(&mut self, context: &Context<'_>, decision: &Decision) -> Effects {
        match self.outstanding() {
            Some(proposed)
                if proposed.view == decision.proposed_view
                    && proposed.mission_id == decision.mission_id
                    && proposed.rank.saturating_add(1) == decision.place
                    && decision.reached > proposed.rank
                    && decision.accepted.is_none_or(|view| {
                        view.id != proposed.view || view.relays > proposed.rank
                    }) =>
            {
                let decision = ViewDecision {
                    reached: decision.reached,
                    base: decision.base,
                    accepted: decision.accepted,
                    usable_in: decision.usable_in,
                };
                self.apply_view_decision(context, decision)
            }
            _ => Effects::STALE,
        }
    }

    fn apply_view_decision(&mut self, context: &Context<'_>, decision: ViewDecision) -> Effects {
        let ViewDecision {
            reached,
            base,
            accepted,
            usable_in,
        } = decision;
        let Some(proposed) = &mut self.proposed else {
            return Effects::NONE;
        };
        let holds = [context.latest, context.member.active].contains(&proposed.mission_id);
        if !holds {
            // This relay has replaced the proposed mission by a newer one. The other relays will receive it.
            return Effects::FOREIGN;
        }
        let proposal = proposed.view;
        if !self.electorate.accept(proposal, base, accepted) {
            // A second node that uses the proposer's index has made this proposal with the same identifier.
            self.request_later_view(context, proposal);
            return Effects::STALE;
        }
        let has_newer_base = base.id > proposed.poll.agreed.id;
        proposed.base = base;
        proposed.reached = reached;
        proposed.accepted = accepted;
        proposed.usable_in = usable_in;
        let is_own = proposed.rank == 1;
        if is_own && accepted.is_some() {
            // All other members have already accepted the view.
            self.electorate.commit();
        }
        self.refused = accepted.is_none();
        let path = context.path(proposed.rank.saturating_sub(1));
        self.circulation.complete(context.now, path);
        self.request.stop();
        if is_own && accepted.is_none() {
            // From this decision relays have learned of a newer view, so they can vote on the next proposal.
            if has_newer_base {
                self.request.request_now(context.now);
            } else {
                self.retry_after_refusal(context);
            }
        }
        Effects::of(LayerEvent::ProposalDecided(match accepted {
            Some(view) if view.id == proposal => ProposalOutcome::Granted {
                relays: view.relays,
                usable_in,
            },
            Some(View { id, .. }) => ProposalOutcome::Superseded {
                view: Some(id).filter(|id| self.electorate.is_polled_in(*id)),
                usable_in,
            },
            None => ProposalOutcome::NoQuorum,
        }))
    }
}

impl ViewChange {
    /// Schedules a retransmission of the outstanding view proposal. Called when the next relay can be reached again.
    pub(crate) fn resend(&mut self) {
        self.circulation.resend();
    }

    /// Returns the view proposal to forward to node `to`, if one is pending, and marks it as sent.
    pub(crate) fn poll_onward(&mut self, context: &Context<'_>, to: u16) -> Option<Message> {
        let proposal = self.outstanding()?.view;
        if !self.circulation.poll_forward() {
            return None;
        }
        let proposed = self.proposed.as_mut()?;
        if *proposed.forwarded_to.get_or_insert(to) != to {
            self.request_later_view(context, proposal);
            return None;
        }
        let proposed = *proposed;
        let path = context.path(context.member.all);
        self.circulation.await_result(context.now, path);
        Some(Message::Proposal(Proposal {
            mission_id: proposed.mission_id,
            proposed_view: proposed.view,
            place: proposed.rank,
            poll: proposed.poll,
        }))
    }

    /// Returns the reply to the view proposal, if one is pending, and marks it as sent.
    pub(crate) fn poll_back(&mut self) -> Option<Message> {
        let proposed = self.proposed?;
        Some(match self.circulation.poll_reply()? {
            Reply::Result => Message::Decision(Decision {
                mission_id: proposed.mission_id,
                proposed_view: proposed.view,
                place: proposed.rank,
                reached: proposed.reached,
                base: proposed.base,
                accepted: proposed.accepted,
                usable_in: proposed.usable_in,
            }),
            Reply::InProgress => Message::Busy {
                number: proposed.view.mark(),
            },
        })
    }

    /// Handles the next relay's reply `Busy`: it has no result for message `number` yet. Returns true if that message
    /// is the outstanding view proposal.
    pub(crate) fn on_busy(&mut self, context: &Context<'_>, number: u16) -> bool {
        let known = self
            .outstanding()
            .is_some_and(|proposed| proposed.view.mark() == number);
        if known {
            let path = context.path(context.member.all);
            self.circulation.on_in_progress(context.now, path);
        }
        known
    }
}

impl ViewChange {
    /// Handles the timers of retransmissions and view requests. `is_first` is true if this relay has no neighbour
    /// toward the leader. `fresh` is true if this relay has not taken part in any agreement or view since its start.
    pub(crate) fn handle_timeout(
        &mut self,
        context: &Context<'_>,
        is_first: bool,
        fresh: bool,
    ) -> Effects {
        let hop_time = context.settings().hop_time;
        let resent = self.circulation.handle_timeout(context.now, hop_time);
        let effects = if self.request.is_due(context.now) {
            self.request_again(context, is_first, fresh)
        } else {
            Effects::NONE
        };
        Effects { resent, ..effects }
    }

    /// Sends a view request to the neighbour toward the leader, or proposes a view if this relay has none.
    fn request_again(&mut self, context: &Context<'_>, is_first: bool, fresh: bool) -> Effects {
        let settings = &context.member.settings;
        if !self.request.poll_due(context.now, fresh, settings) {
            return Effects::NONE;
        }
        if !is_first {
            return Effects::of(LayerEvent::RequestView);
        }
        let under_way = self.outstanding().is_some_and(|proposed| {
            proposed.view >= self.newest && proposed.mission_id == context.latest
        });
        let newest = self.newest.max(self.electorate.promised());
        let next = newest.next_by(context.member.node);
        let Some(view) = next.filter(|_| !under_way) else {
            return Effects::NONE;
        };
        // Each proposal uses up a view number, so none is made without a chance of success.
        let Member { node, all, .. } = *context.member;
        let is_alone = self.refused && context.is_last_reachable && context.settings().quorum;
        if is_alone
            && self
                .electorate
                .lacks_quorum_alone(node, view, all, context.other_leases)
        {
            self.retry_after_refusal(context);
            return Effects::NONE;
        }
        self.observe_view(view);
        let Some(effects) = self.propose(context, view, context.latest, 0, None) else {
            return Effects::NONE;
        };
        Effects {
            began: true,
            ..effects.by(Proposer::Itself)
        }
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.request.next_timeout(), self.circulation.next_timeout())
    }
}

/// Last view proposal that this relay has voted on, with the decision on it once this is known.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Proposed {
    pub(crate) view: ViewId,
    /// Identifier of the mission that the proposed view's relays will fly.
    pub(crate) mission_id: MissionId,
    /// Position of this relay in the order in which the relays vote: 1 for the proposer.
    pub(crate) rank: u16,
    /// Votes on the proposed view, including this relay's vote.
    pub(super) poll: Poll,
    /// Node to which the proposal was forwarded; `None` until then. The proposal is never sent to a second node,
    /// because two views with the same identifier could result.
    pub(super) forwarded_to: Option<u16>,
    /// View that the decided view replaces. Before the decision it is the newest view known to be agreed on.
    pub(crate) base: View,
    /// Number of relays that the proposal has reached; 0 until its decision is known.
    pub(super) reached: u16,
    /// View that the decision accepted; `None` before the decision and without a quorum.
    pub(super) accepted: Option<View>,
    pub(super) usable_in: u16,
}

/// Decision on a view proposal. `accepted` is the accepted view; `None` if the voters were no quorum.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewDecision {
    pub(super) reached: u16,
    pub(super) base: View,
    pub(super) accepted: Option<View>,
    pub(super) usable_in: u16,
}

/// Request of this relay for a new view, with the timer of its repetition.
///
/// | situation | wait before the request | set by |
/// | --- | --- | --- |
/// | reason for a new view, such as a changed neighbour | 250 us | `request_now` |
/// | repetition without a result | 8, 16, 32 hop times, after 12 requests doubled each time; at most `probe_after` | `poll_due` |
/// | refused view | about `probe_after`, doubled with each refusal in a row, at most three times | `request_after_refusal` |
/// | new reason after a refusal | the rest of the first `probe_after` | `start` |
/// | no pass along the chain since the start | `probe_after` and a round trip, or the time of a first pass if longer | `Node::await_first` |
///
/// A relay that has just selected a neighbour does not request a view before the end of `Neighbour::grace`.
#[derive(Clone, Debug)]
pub(crate) struct ViewRequest {
    pending: bool,
    /// Number of requests for a new view that this relay has sent without a result.
    tries: u8,
    at: Option<Instant>,
    /// Number of consecutive refusals of view proposals, for lack of a quorum.
    refusals: u8,
    /// Earliest time of the next view request after a refusal. A new reason for a view, such as a changed neighbour,
    /// moves the request forward to this time. `None` if a new reason does not change the time of the request.
    not_before: Option<Instant>,
    jitter: Jitter,
}

/// Number of view requests after which the time between two requests grows beyond 32 hop times.
const EARLY: u8 = 12;

/// Maximum number of doublings of the wait before a new view request, after consecutive refusals.
const DOUBLINGS: u8 = 3;

impl ViewRequest {
    pub(super) const fn new(seed: u32) -> Self {
        Self {
            pending: false,
            tries: 0,
            at: None,
            refusals: 0,
            not_before: None,
            jitter: Jitter::new(seed),
        }
    }

    pub(crate) const fn is_pending(&self) -> bool {
        self.pending
    }

    /// Requests a view for a new reason, such as a changed neighbour. The request is repeated until a view is decided.
    /// If the last proposed view was refused, the call shortens the wait until the next request.
    pub(crate) fn start(&mut self, now: Instant) {
        if !self.pending {
            self.request_now(now);
        } else if let Some(soon) = self.not_before.take() {
            self.refusals = 0;
            let soon = soon.max(now + PAUSE);
            self.at = Some(self.at.map_or(soon, |at| at.min(soon)));
        }
    }

    /// Requests a view at once, and resets all waits.
    #[inline(never)] // called from many places
    pub(crate) fn request_now(&mut self, now: Instant) {
        self.pending = true;
        self.tries = 0;
        self.refusals = 0;
        self.not_before = None;
        self.at = Some(now + PAUSE);
    }

    /// Repeats a pending view request at once. Called when the search for a neighbour ended without success.
    pub(crate) fn repeat_now(&mut self, now: Instant) {
        if self.pending {
            self.request_now(now);
        }
    }

    /// Requests a view after about `wait`. Each of the first three consecutive refusals doubles the wait.
    ///
    /// [`request_now`](Self::request_now) ends the doubling.
    pub(super) fn request_after_refusal(&mut self, now: Instant, wait: Duration) {
        self.pending = true;
        let wait = self.jitter.spread(wait);
        self.not_before = Some(now + wait);
        self.at = Some(now + wait.times(1 << self.refusals.min(DOUBLINGS)));
        self.refusals = self.refusals.saturating_add(1);
    }

    /// Ends the view request, because a view has been decided or refused.
    pub(crate) const fn stop(&mut self) {
        self.pending = false;
        self.at = None;
        self.not_before = None;
    }

    /// Starts the timer for the first agreement or view after this relay's start. If this relay has taken part in none
    /// by `at`, it requests a view.
    pub(crate) const fn await_first(&mut self, at: Instant) {
        self.at = Some(at);
    }

    /// Returns true if the timer of the next view request has expired. It also runs while this relay awaits its first
    /// agreement or view after a start.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.at.is_some_and(|at| at <= now)
    }

    /// Handles the expired timer of view requests. Returns true if this relay must send a request: one is pending, or
    /// this relay is `fresh` (no agreement or view since its start).
    pub(super) fn poll_due(&mut self, now: Instant, fresh: bool, settings: &Settings) -> bool {
        self.at = None;
        if !self.pending {
            if !fresh {
                return false;
            }
            self.pending = true;
            self.tries = 0;
        }
        self.not_before = None;
        self.at = Some(now + self.patience(settings));
        true
    }

    /// Returns the waiting time before the next view request: 8, 16, then 32 hop times.
    ///
    /// Each relay on the way to the leader repeats the request. So longer waits would add up over the hops. After
    /// [`EARLY`] requests the time doubles again, because the next relay is probably absent.
    fn patience(&mut self, settings: &Settings) -> Duration {
        let doublings = self.tries.min(2) + self.tries.saturating_sub(EARLY).min(10);
        let wait = settings.hop_time.times(8 << doublings);
        self.tries = self.tries.saturating_add(1);
        wait.min(settings.probe_after)
    }

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }

    /// Creates a request for a new view to be sent at `at`.
    #[cfg(test)]
    pub(super) const fn due(at: Instant) -> Self {
        Self {
            pending: true,
            at: Some(at),
            ..Self::new(1)
        }
    }
}
