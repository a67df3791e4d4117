//! Model check of the view change: runs the firmware's code under every order of events.
//!
//! The chains have three or four relays.
//!
//! | event | model |
//! | --- | --- |
//! | frame | remains in the air once sent: received at any later time, in any order, any number of times, or never |
//! | links cut or restored | the chain changes to another set partition; neighbours are the nearest relays of the same part |
//! | relay silent | a part of its own |
//! | proposal timed out | a relay without a predecessor proposes anew, with a larger number than any in its part |
//! | no successor | the relay decides, or abandons the proposal |
//! | pass | a relay that knows its view to be agreed on informs the next relay, if that is in the same view |
//! | departure or join | a relay goes outside of the chain, where it has no neighbours, or comes back; its neighbours select each other |
//! | reboot | the relay keeps only its acceptor state, or loses that, too |
//! | renewal | in some checks: all members of a view renew their leases; time advances by 0.1 s |
//!
//! The numbers of cuts, proposals, reboots, departures, joins and renewals are bounded, nothing else is. Time is modelled
//! only by renewals: no lease expires. The checks with renewals test the bounds of other relays' leases: positions of an
//! agreed view are not used before every lease of an earlier view has ended.
//!
//! A view is *in force* from the time its leader knows that all members have accepted it until a successor is in force.
//! Views that follow each other one by one are never in force together. So the check is that all agreed views form one
//! sequence, starting with the initial view.

#![allow(
    clippy::cast_possible_truncation,
    reason = "the modelled chains have at most 8 relays"
)]

extern crate std;

use stateright::{Checker, HasDiscoveries, Model, Property};
use std::string::String;
use std::vec::Vec;
use std::{format, println, vec};

use crate::mission::Mission;
use crate::mission::tests::paper;
use crate::node::circulation::{Circulation, LateMessages, Stage};
use crate::node::context::OtherLeases;
use crate::node::context::{Context, Effects, LayerEvent, Member, ProposalOutcome};
use crate::node::lease::LeaseBounds;
use crate::node::view::change::{ViewChange, ViewRequest};
use crate::settings::Settings;
use crate::time::{Duration, Instant};
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal, Successor};

/// Checks the view-change protocol for every order of events in a chain of `relays` relays. The numbers of link cuts,
/// proposals and reboots are limited.
///
/// If `heals` is true, the function also checks in every state that the chain agrees on a view once all links are
/// restored.
fn all_holds(relays: u16, (cuts, proposals, reboots): (u8, u8, u8), heals: bool) {
    Check {
        cuts,
        proposals,
        reboots,
        heals,
        ..Check::of(relays)
    }
    .holds();
}

#[test]
fn chains_of_three_and_four_have_one_sequence_of_views() {
    all_holds(3, (2, 3, 1), true);
    all_holds(4, (2, 2, 1), true);
    all_holds(4, (2, 3, 0), false);
}

/// Checks that each agreed view replaces the one before when a spare joins and a relay leaves.
#[test]
fn departures_and_joins_keep_one_sequence_of_views() {
    for (relays, outside, (cuts, proposals, reboots, moves)) in [
        (3, 0, (1, 3, 0, 2)),
        (3, 0b010, (1, 3, 0, 2)),
        (4, 0b0100, (1, 3, 0, 2)),
        (4, 0b0010, (0, 3, 1, 2)),
    ] {
        Check {
            outside,
            moves,
            cuts,
            proposals,
            reboots,
            heals: relays == 3,
            ..Check::of(relays)
        }
        .holds();
    }
}

/// Checks that no positions of an agreed view are used while a relay has a lease of an earlier view. The chain has
/// `relays` relays, of which those in the bit mask `outside` are outside at first.
fn leases_end(relays: u16, outside: u8, (cuts, proposals, renewals, moves): (u8, u8, u8, u8)) {
    Check {
        cuts,
        proposals,
        outside,
        moves,
        renewals,
        ..Check::of(relays)
    }
    .holds();
}

#[test]
fn leases_of_earlier_views_have_ended() {
    leases_end(3, 0, (2, 3, 2, 0));
    leases_end(3, 0b100, (1, 3, 2, 1));
    leases_end(4, 0, (1, 3, 2, 0));
}

/// Model check of the leases with more events than the test above; takes some minutes.
#[test]
#[ignore = "minutes"]
fn leases_of_earlier_views_have_ended_in_more_states() {
    leases_end(4, 0, (2, 3, 2, 0));
    leases_end(3, 0, (3, 4, 2, 0));
}

/// Checks that the model check finds the fault of not waiting for the leases of earlier views.
#[test]
fn the_check_finds_the_fault_of_not_waiting_for_leases() {
    let check = Check {
        rule: Rule::AtOnce,
        renewals: 1,
        ..Check::of(3)
    };
    assert_eq!(check.search().unwrap().what, EARLIER_LEASES);
}

/// Checks that the model check finds a wrong rule for departures. By this rule a relay that leaves no longer counts for
/// the quorum, although the chain has not agreed on its departure yet.
#[test]
fn the_check_finds_the_fault_of_counting_only_the_relays_inside() {
    let check = Check {
        rule: Rule::Inside,
        moves: 1,
        proposals: 3,
        ..Check::of(3)
    };
    let found = check.search().unwrap();
    assert_eq!(found.what, ONE_CHAIN, "{}", found.how);
}

/// Model check of the view change with more events than the tests above; takes some minutes.
#[test]
#[ignore = "minutes"]
fn chains_of_three_and_four_in_more_states() {
    all_holds(3, (3, 3, 1), true);
    all_holds(3, (3, 4, 1), false);
    all_holds(4, (2, 3, 0), true);
    all_holds(4, (3, 3, 0), false);
    all_holds(4, (2, 3, 1), false);
}

/// Checks that the model check finds a broken quorum rule. If all reachable relays could vote, two views could be in
/// force at the same time.
#[test]
fn the_check_finds_the_fault_of_counting_all_votes() {
    for relays in [3, 4] {
        let check = Check {
            rule: Rule::Everybody,
            ..Check::of(relays)
        };
        let found = check.search().unwrap();
        assert_eq!(found.what, ONE_CHAIN, "{}", found.how);
    }
}

/// Checks that the model check finds the fault of a relay that restarts without its stored votes.
#[test]
fn the_check_finds_the_fault_of_a_lost_record() {
    let check = Check {
        losses: 1,
        ..Check::of(3)
    };
    assert!(check.search().is_some());
}

/// Identifier of a view and its number of members. Can be sorted.
pub(super) type SizedView = (ViewId, u16);

/// Message of the model, without mission and times.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) enum Body {
    Proposal {
        proposed_view: ViewId,
        place: u16,
        agreed: SizedView,
        votes: u16,
        proposer: bool,
        /// Fields `lease_left` and `earlier_lease_left` of the poll.
        leases: [u16; 2],
        successor: Option<(ViewId, SizedView)>,
    },
    Decision {
        proposed_view: ViewId,
        place: u16,
        reached: u16,
        base: SizedView,
        accepted: Option<SizedView>,
        usable_in: u16,
    },
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) struct Frame {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) body: Body,
}

/// State of one relay in the model of view changes.
#[derive(Clone, Debug)]
pub(super) struct RelayState {
    pub(super) change: ViewChange,
    /// Last view that this relay accepted: its identifier, the relay's rank, and the number of members.
    pub(super) flies: (ViewId, u16, u16),
    /// Bounds of other relays' leases, and the view and the end of this relay's own lease. Constant without renewals.
    bounds: LeaseBounds,
    lease: Option<(ViewId, Instant)>,
}

impl RelayState {
    fn key(&self) -> impl Eq + core::hash::Hash + use<> {
        let change = &self.change;
        (
            change.circulation.stage(),
            change.proposed,
            change.electorate,
            self.flies,
            self.bounds,
            self.lease,
        )
    }
}

impl PartialEq for RelayState {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for RelayState {}

impl core::hash::Hash for RelayState {
    fn hash<H: core::hash::Hasher>(&self, hasher: &mut H) {
        self.key().hash(hasher);
    }
}

/// Decided view: its size, the view that it replaces, and the relays that voted.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) struct DecidedView {
    pub(super) view: SizedView,
    pub(super) follows: ViewId,
    /// Bit mask of the relays that voted on the proposal; bit 0 is the first relay.
    pub(super) members: u8,
}

#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) struct Chain {
    pub(super) relays: Vec<RelayState>,
    /// Number of the part of the chain to which each relay belongs while links are cut. Relays of the same part receive
    /// each other.
    pub(super) parts: Vec<u8>,
    /// Frames in transit, which can still arrive; sorted and without duplicates.
    pub(super) air: Vec<Frame>,
    /// Views that were ever decided on.
    pub(super) decided: Vec<DecidedView>,
    /// Views that were ever accepted by all their members.
    pub(super) agreed: Vec<SizedView>,
    pub(super) cuts: u8,
    pub(super) proposals: u8,
    pub(super) reboots: u8,
    pub(super) losses: u8,
    /// Bit mask of the relays outside of the chain; bit 0 is the first relay.
    pub(super) outside: u8,
    /// Number of departures and joins that can still happen.
    pub(super) moves: u8,
    /// Number of lease renewals that can still happen.
    renewals: u8,
    now: Instant,
    /// Agreed views, and the times from which their positions may be used. Empty without renewals.
    usable: Vec<(ViewId, Instant)>,
}

/// Event that can happen next in the model.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum ModelEvent {
    Part(usize),
    Arrives(Frame),
    Proposes(usize),
    EndsAt(usize),
    Repeats(usize),
    Passes(usize),
    Reboots(usize),
    Forgets(usize),
    /// The relay with this list index leaves the chain, or joins it again.
    Moves(usize),
    /// The leader with this list index renews the leases of its view, and all members receive this.
    Renews(usize),
}

/// Inserts `one` into the sorted list `all`, unless the list contains it.
pub(super) fn insert_sorted<T: Ord>(all: &mut Vec<T>, one: T) {
    if let Err(at) = all.binary_search(&one) {
        all.insert(at, one);
    }
}

impl Chain {
    pub(super) fn before(&self, at: usize) -> Option<usize> {
        (0..at).rev().find(|&other| self.are_linked(at, other))
    }

    pub(super) fn after(&self, at: usize) -> Option<usize> {
        (at + 1..self.parts.len()).find(|&other| self.are_linked(at, other))
    }

    /// Returns true if both relays are inside of the chain, and the link between them is not cut.
    fn are_linked(&self, one: usize, other: usize) -> bool {
        self.parts[other] == self.parts[one] && self.outside & (1 << one | 1 << other) == 0
    }
}

impl Body {
    pub(super) fn message(self, mission_id: MissionId) -> Message {
        let view = |(id, relays)| View { id, relays };
        match self {
            Self::Proposal {
                proposed_view: id,
                place,
                agreed,
                votes,
                proposer,
                leases: [lease_left, earlier_lease_left],
                successor,
            } => Message::Proposal(Proposal {
                mission_id,
                proposed_view: id,
                place,
                poll: Poll {
                    agreed: view(agreed),
                    votes,
                    proposer,
                    lease_left,
                    earlier_lease_left,
                    successor: successor.map(|(proposal, of)| Successor {
                        proposal,
                        view: view(of),
                    }),
                },
            }),
            Self::Decision {
                proposed_view: proposal,
                place,
                reached: there,
                base,
                accepted: of,
                usable_in,
            } => Message::Decision(Decision {
                mission_id,
                proposed_view: proposal,
                place,
                reached: there,
                base: view(base),
                accepted: of.map(view),
                usable_in,
            }),
        }
    }

    /// Returns the message without the times of leases, which would increase the number of states.
    fn untimed(mut self) -> Self {
        match &mut self {
            Self::Proposal { leases, .. } => *leases = [0; 2],
            Self::Decision { usable_in, .. } => *usable_in = 0,
        }
        self
    }

    pub(super) fn of(message: &Message) -> Option<Self> {
        let sized = |view: View| (view.id, view.relays);
        match message {
            Message::Proposal(proposal) => Some(Self::Proposal {
                proposed_view: proposal.proposed_view,
                place: proposal.place,
                agreed: sized(proposal.poll.agreed),
                votes: proposal.poll.votes,
                proposer: proposal.poll.proposer,
                leases: [proposal.poll.lease_left, proposal.poll.earlier_lease_left],
                successor: proposal
                    .poll
                    .successor
                    .map(|successor| (successor.proposal, sized(successor.view))),
            }),
            Message::Decision(decision) => Some(Self::Decision {
                proposed_view: decision.proposed_view,
                place: decision.place,
                reached: decision.reached,
                base: sized(decision.base),
                accepted: decision.accepted.map(sized),
                usable_in: decision.usable_in,
            }),
            _ => None,
        }
    }
}

/// Rule that decides which votes on a view count.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Rule {
    /// Rule of the firmware: only members vote.
    Members,
    /// Broken rule, for a test: a departure reduces the quorum at all other relays at once.
    Inside,
    /// Broken rule, for a test: positions of an agreed view are used at once.
    AtOnce,
    /// Broken rule, for a test: every reachable relay votes. The quorum is that of the newest view that any reachable
    /// relay knows.
    Everybody,
}

/// Configuration of a model check: the quorum rule, and bounds on the number of events.
#[derive(Clone, Debug)]
pub(super) struct Check {
    pub(super) rule: Rule,
    pub(super) members: Vec<Member>,
    pub(super) partitions: Vec<Vec<u8>>,
    pub(super) cuts: u8,
    pub(super) proposals: u8,
    pub(super) reboots: u8,
    pub(super) losses: u8,
    /// Relays that are outside of the chain at first, as a bit mask.
    pub(super) outside: u8,
    pub(super) moves: u8,
    /// Number of lease renewals. Without any, the leases are not modelled.
    pub(super) renewals: u8,
    /// True to check in every state that the chain agrees on a view once all links are restored.
    pub(super) heals: bool,
}

/// Returns all ways to divide `relays` relays into parts that do not receive each other. Each way is a list with the
/// number of the part to which each relay belongs.
pub(super) fn partitions(relays: usize) -> Vec<Vec<u8>> {
    let mut all = vec![vec![]];
    for _ in 0..relays {
        all = all
            .iter()
            .flat_map(|parts: &Vec<u8>| {
                let next = parts.iter().max().map_or(0, |most| most + 1);
                (0..=next).map(move |part| {
                    let mut parts = parts.clone();
                    parts.push(part);
                    parts
                })
            })
            .collect();
    }
    all
}

impl Check {
    pub(super) fn of(relays: u16) -> Self {
        let mission = Mission::try_new(paper(relays)).unwrap();
        Self {
            rule: Rule::Members,
            members: (1..=relays)
                .map(|node| Member::new(mission, Settings::default(), node))
                .collect(),
            partitions: partitions(usize::from(relays)),
            cuts: 2,
            proposals: 2,
            reboots: 0,
            losses: 0,
            outside: 0,
            moves: 0,
            renewals: 0,
            heals: false,
        }
    }

    pub(super) fn new_relay(&self) -> RelayState {
        let relays = self.members.len() as u16;
        RelayState {
            change: ViewChange::new(relays, 1, 1),
            flies: (ViewId::LOADED, 0, relays),
            bounds: LeaseBounds::new(Instant::ZERO, &self.members[0].settings),
            lease: None,
        }
    }

    pub(super) fn context(&self, chain: &Chain, at: usize) -> Context<'_> {
        let member = &self.members[at];
        Context {
            now: chain.now,
            member,
            latest: member.active,
            is_last_reachable: chain.after(at).is_none(),
            other_leases: if self.renewals == 0 {
                OtherLeases::NONE
            } else {
                chain.relays[at].bounds.other_leases(chain.now)
            },
        }
    }

    /// Returns a bit mask of the relays that have voted on the view `proposal`; bit 0 is the first relay.
    pub(super) fn voters(chain: &Chain, proposal: ViewId) -> u8 {
        let voters = chain.relays.iter().zip(0..);
        let voters = voters.filter(|(unit, _)| unit.change.electorate.has_voted(proposal));
        let known = voters.fold(0, |members, (_, at)| members | 1 << at);
        let handed = chain
            .air
            .iter()
            .filter(|frame| matches!(frame.body, Body::Proposal { proposed_view: view, .. } if view == proposal));
        handed.fold(known, |members, frame| members | 1 << frame.from)
    }

    /// Adds the pending messages of the relay with list index `at` to the frames in transit. Records the decision in
    /// `effects`, if any.
    pub(super) fn apply_effects(&self, chain: &mut Chain, at: usize, effects: Effects) {
        let (before, after) = (chain.before(at), chain.after(at));
        let context = self.context(chain, at);
        let decides = chain.relays[at].change.proposed;
        let members = decides.map_or(0, |proposed| Self::voters(chain, proposed.view));
        let Chain {
            relays: units,
            air,
            decided: decrees,
            agreed,
            usable,
            now,
            ..
        } = chain;
        let unit = &mut units[at];
        let is_timed = self.renewals > 0;
        let mut send = |to: usize, message: &Message| {
            if let Some(body) = Body::of(message) {
                let body = if is_timed { body } else { body.untimed() };
                let from = at;
                insert_sorted(air, Frame { from, to, body });
            }
        };
        if let Some(to) = after
            && let Some(message) = unit.change.poll_onward(&context, to as u16 + 1)
        {
            send(to, &message);
        }
        if let Some(to) = before {
            while let Some(message) = unit.change.poll_back() {
                send(to, &message);
            }
        }
        if let Some(proposed) = unit.change.proposed
            && let Some(LayerEvent::ProposalDecided(decided)) = effects.event
        {
            let rest = |usable_in: u16| *now + Duration::from_millis(100).times(usable_in.into());
            let base = proposed.base.id;
            match decided {
                ProposalOutcome::Granted { relays, usable_in } => {
                    unit.flies = (proposed.view, proposed.rank, relays);
                    if is_timed {
                        unit.bounds.accept((proposed.view, base), rest(usable_in));
                        unit.lease = None;
                    }
                    if is_timed && proposed.rank == 1 {
                        unit.bounds.confirm(proposed.view);
                        let waits = if self.rule == Rule::AtOnce {
                            0
                        } else {
                            usable_in
                        };
                        insert_sorted(usable, (proposed.view, rest(waits)));
                    }
                }
                ProposalOutcome::Superseded { view, usable_in } => {
                    if let Some(view) = view.filter(|_| is_timed) {
                        unit.bounds.accept((view, base), rest(usable_in));
                    }
                }
                ProposalOutcome::NoQuorum => {}
            }
            if let Some(view) = proposed.accepted {
                if view.id == proposed.view && view.relays == proposed.rank {
                    insert_sorted(
                        decrees,
                        DecidedView {
                            view: (view.id, view.relays),
                            follows: proposed.poll.agreed.id,
                            members,
                        },
                    );
                }
                if proposed.rank == 1 {
                    insert_sorted(agreed, (view.id, view.relays));
                }
            }
        }
        let change = &mut unit.change;
        if self.rule == Rule::Everybody {
            change.electorate.count_everybody();
        }
        // Resets timers and the handling of late messages, to reduce the number of states.
        change.newest = ViewId::LOADED;
        change.request = ViewRequest::new(1);
        change.refused = false;
        change.late_messages = LateMessages::NONE;
        change.circulation = Circulation::at_stage(change.circulation.stage());
    }

    pub(super) fn propose(&self, chain: &mut Chain, at: usize) {
        let newest = (0..chain.relays.len())
            .filter(|&other| chain.parts[other] == chain.parts[at])
            .map(|other| chain.relays[other].change.electorate.promised())
            .max()
            .unwrap();
        let context = self.context(chain, at);
        let change = &mut chain.relays[at].change;
        change.observe_view(newest);
        if change.outstanding().is_some() {
            change.observe_view(newest.next_by(self.members[at].node).unwrap());
        }
        change.request = ViewRequest::due(Instant::ZERO);
        let effects = change.handle_timeout(&context, true, false);
        self.apply_effects(chain, at, effects);
    }

    pub(super) fn arrive(&self, chain: &mut Chain, frame: &Frame) {
        let at = frame.to;
        let neighbour = match frame.body {
            Body::Proposal { .. } => chain.before(at),
            Body::Decision { .. } => chain.after(at),
        };
        if neighbour != Some(frame.from) {
            return;
        }
        let context = self.context(chain, at);
        let message = frame.body.message(self.members[0].active);
        let effects = chain.relays[at].change.handle(&context, &message);
        self.apply_effects(chain, at, effects);
    }

    pub(super) fn end(&self, chain: &mut Chain, at: usize) {
        if chain.after(at).is_none() {
            let context = self.context(chain, at);
            let effects = chain.relays[at].change.decide(&context);
            self.apply_effects(chain, at, effects);
        }
    }

    pub(super) fn repeat(&self, chain: &mut Chain, at: usize) {
        chain.relays[at].change.resend();
        self.apply_effects(chain, at, Effects::NONE);
    }

    pub(super) fn pass(chain: &mut Chain, at: usize) {
        let Some(to) = chain.after(at) else {
            return;
        };
        let RelayState { change, flies, .. } = &chain.relays[at];
        let (view, place, _) = *flies;
        let knows = change.electorate.agreed().id == view && change.outstanding().is_none();
        let next = &mut chain.relays[to];
        if knows
            && next.change.outstanding().is_none()
            && next.flies.0 == view
            && next.flies.1 == place + 1
        {
            next.change.commit(view);
            next.bounds.confirm(view);
        }
    }

    /// Renews the leases of the view of the relay with list index `leader`.
    ///
    /// No effect unless all members can take part, and the relay leads them.
    fn renew(&self, chain: &mut Chain, leader: usize) {
        let (view, _, relays) = chain.relays[leader].flies;
        let mut members = vec![leader];
        while let Some(next) = members.last().and_then(|at| chain.after(*at)) {
            members.push(next);
        }
        members.truncate(relays.into());
        let takes_part = |(at, rank): (&usize, u16)| {
            let RelayState { change, flies, .. } = &chain.relays[*at];
            let rank = if view == ViewId::LOADED { 0 } else { rank };
            *flies == (view, rank, relays) && change.outstanding().is_none()
        };
        let knows = chain.relays[leader].change.electorate.agreed().id >= view;
        let all = members.len() == usize::from(relays) && members.iter().zip(1..).all(takes_part);
        if !(all && knows) {
            return;
        }
        chain.now = chain.now + Duration::from_millis(100);
        let until = chain.now + self.members[leader].settings.dead_after;
        for at in members {
            let relay = &mut chain.relays[at];
            relay.change.commit(view);
            relay.bounds.confirm(view);
            relay.bounds.vouch(view, until);
            relay.lease = Some((view, until));
        }
    }

    /// Makes the relay with list index `at` leave the chain, as `Node::go_outside` does, or join it again.
    fn move_relay(&self, chain: &mut Chain, at: usize) {
        chain.outside ^= 1 << at;
        let change = &mut chain.relays[at].change;
        change.leave(Instant::ZERO);
        change.request = ViewRequest::new(1);
        if self.rule == Rule::Inside && chain.outside >> at & 1 == 1 {
            for other in (0..chain.relays.len()).filter(|&other| other != at) {
                let electorate = &mut chain.relays[other].change.electorate;
                electorate.agreed.relays = electorate.agreed.relays.saturating_sub(1).max(1);
            }
        }
        self.apply_effects(chain, at, Effects::NONE);
    }

    pub(super) fn reboot(&self, chain: &mut Chain, at: usize, remembers: bool) {
        let electorate = chain.relays[at].change.electorate;
        chain.relays[at] = self.new_relay();
        if remembers {
            chain.relays[at].change.electorate = electorate;
        }
        self.apply_effects(chain, at, Effects::NONE);
    }
}

impl Check {
    /// Returns true if the agreed views form one sequence. Each agreed view must replace the initial view or an earlier
    /// agreed view, and no two agreed views may replace the same view.
    pub(super) fn is_one_chain(chain: &Chain) -> bool {
        let follows = |(id, _): &SizedView| {
            let decree = chain.decided.iter().find(|decree| decree.view.0 == *id);
            decree.map(|decree| decree.follows)
        };
        let mut before: Vec<_> = chain.agreed.iter().map(follows).collect();
        let known = before.iter().all(|view| {
            view.is_some_and(|view| {
                view == ViewId::LOADED || chain.agreed.iter().any(|(id, _)| *id == view)
            })
        });
        before.sort();
        let count = before.len();
        before.dedup();
        known && before.len() == count
    }

    pub(super) fn has_one_size(chain: &Chain) -> bool {
        let twice = |all: &[ViewId]| all.windows(2).any(|pair| pair[0] == pair[1]);
        let decrees: Vec<_> = chain.decided.iter().map(|decree| decree.view.0).collect();
        let agreed: Vec<_> = chain.agreed.iter().map(|view| view.0).collect();
        !twice(&decrees) && !twice(&agreed)
    }

    /// Returns true if the newest agreed view that each relay knows meets two conditions. The view is the initial one,
    /// or is in the list of agreed views. And the relays that have a vote in this view, and know no newer one, are not
    /// more than its members.
    pub(super) fn is_known_and_counted(&self, chain: &Chain) -> bool {
        self.rule != Rule::Members
            || chain.relays.iter().all(|unit| {
                let view = unit.change.electorate.agreed();
                let members = chain.relays.iter().filter(|unit| {
                    let electorate = unit.change.electorate;
                    electorate.agreed() == view && electorate.member
                });
                let known =
                    view.id == ViewId::LOADED || chain.agreed.contains(&(view.id, view.relays));
                known && members.count() <= usize::from(view.relays)
            })
    }
}

/// Name of the safety property of leases: they end before positions of a later view may be used.
pub(super) const EARLIER_LEASES: &str = "leases of earlier views end before positions are used";

impl Chain {
    fn has_ended_leases(&self) -> bool {
        let leases = self.relays.iter().filter_map(|relay| relay.lease);
        leases.into_iter().all(|(view, end)| {
            let later = self.usable.iter().filter(|(later, _)| *later > view);
            later.into_iter().all(|(_, from)| end <= *from)
        })
    }
}

/// Maximum number of proposals until the chain must have agreed on a view, once its links are restored.
pub(super) const MAX_PROPOSALS: u8 = 3;

impl Check {
    /// Delivers all frames between the relays in the bit mask `there`, until the state no longer changes.
    pub(super) fn drain(&self, chain: &mut Chain, there: u8) {
        loop {
            let before = chain.clone();
            for at in (0..chain.relays.len()).filter(|at| there >> at & 1 == 1) {
                self.end(chain, at);
                self.repeat(chain, at);
                Self::pass(chain, at);
            }
            for frame in before.air.clone() {
                self.arrive(chain, &frame);
            }
            if *chain == before {
                return;
            }
        }
    }

    /// Returns true if the relays in the bit mask `there` are a quorum of the newest view that they know. They must
    /// also be a quorum of every later view that was ever decided on.
    pub(super) fn is_quorum(chain: &Chain, there: u8) -> bool {
        let known = |at: &usize| there >> at & 1 == 1;
        let agreed = (0..chain.relays.len()).filter(known);
        let agreed = agreed.map(|at| chain.relays[at].change.electorate.agreed().id);
        let newest = agreed.max().unwrap_or(ViewId::LOADED);
        let has_most = |members: u8, proposer: u16| {
            let has_proposer = there & members & 1 << (proposer - 1) != 0;
            2 * (there & members).count_ones() + u32::from(has_proposer) > members.count_ones()
        };
        let all = ((1_u16 << chain.relays.len()) - 1) as u8;
        (newest > ViewId::LOADED || has_most(all, 1))
            && chain.decided.iter().all(|decree| {
                decree.view.0 < newest || has_most(decree.members, decree.view.0.proposer())
            })
    }

    /// Returns the number of proposals that the relays in the bit mask `there` need to agree on a view.
    ///
    /// The members of the view must be exactly these relays. Only the links between them work. If `keeps_air` is true,
    /// frames in transit are still delivered; otherwise they are lost. Returns `Some(0)` if the relays are no quorum,
    /// and `None` if [`MAX_PROPOSALS`] are not enough.
    pub(super) fn proposals_needed(&self, chain: &Chain, there: u8, keeps_air: bool) -> Option<u8> {
        let mut chain = chain.clone();
        for (part, at) in chain.parts.iter_mut().zip(0..) {
            *part = if there >> at & 1 == 1 { 0 } else { at + 1 };
        }
        chain.outside = 0;
        if !keeps_air {
            chain.air.clear();
        }
        let first = there.trailing_zeros() as usize;
        self.drain(&mut chain, there);
        if !Self::is_quorum(&chain, there) {
            return Some(0);
        }
        for proposals in 0..=MAX_PROPOSALS {
            let agreed = chain.relays[first].change.electorate.agreed();
            let settled = (0..chain.relays.len())
                .filter(|at| there >> at & 1 == 1)
                .all(|at| {
                    let RelayState { change, flies, .. } = &chain.relays[at];
                    let knows = change.electorate.agreed() == agreed && change.electorate.member;
                    knows
                        && change.circulation.stage() != Stage::Outstanding
                        && flies.0 == agreed.id
                });
            if settled && u32::from(agreed.relays) == there.count_ones() {
                return Some(proposals);
            }
            chain.air.clear();
            self.propose(&mut chain, first);
            self.drain(&mut chain, there);
        }
        None
    }

    /// Returns true if every quorum of relays can still agree on a view once its links are restored.
    pub(super) fn is_alive(&self, chain: &Chain) -> bool {
        let all = ((1_u16 << chain.relays.len()) - 1) as u8;
        (1..=all).all(|there| {
            [true, false]
                .iter()
                .all(|keeps_air| self.proposals_needed(chain, there, *keeps_air).is_some())
        })
    }
}

/// Name of the safety property that the model check verifies: agreed views form one sequence.
pub(super) const ONE_CHAIN: &str = "all agreed views form a single sequence";

impl Model for Check {
    type State = Chain;
    type Action = ModelEvent;

    fn init_states(&self) -> Vec<Chain> {
        let relays = self.members.len();
        let mut chain = Chain {
            relays: vec![self.new_relay(); relays],
            parts: vec![0; relays],
            air: vec![],
            decided: vec![],
            agreed: vec![],
            cuts: self.cuts,
            proposals: self.proposals,
            reboots: self.reboots,
            losses: self.losses,
            outside: self.outside,
            moves: self.moves,
            renewals: self.renewals,
            now: Instant::ZERO,
            usable: vec![],
        };
        for at in 0..relays {
            self.apply_effects(&mut chain, at, Effects::NONE);
        }
        vec![chain]
    }

    fn actions(&self, chain: &Chain, actions: &mut Vec<ModelEvent>) {
        actions.extend(chain.air.iter().copied().map(ModelEvent::Arrives));
        let relays = 0..chain.relays.len();
        for at in relays {
            if chain.moves > 0 {
                actions.push(ModelEvent::Moves(at));
            }
            if chain.outside >> at & 1 == 1 {
                // The relay sends nothing until it returns to the chain.
                continue;
            }
            if chain.proposals > 0 && chain.before(at).is_none() {
                actions.push(ModelEvent::Proposes(at));
            }
            actions.extend([
                ModelEvent::EndsAt(at),
                ModelEvent::Repeats(at),
                ModelEvent::Passes(at),
            ]);
            if chain.renewals > 0 && chain.before(at).is_none() {
                actions.push(ModelEvent::Renews(at));
            }
            if chain.reboots > 0 {
                actions.push(ModelEvent::Reboots(at));
            }
            if chain.losses > 0 {
                actions.push(ModelEvent::Forgets(at));
            }
        }
        if chain.cuts > 0 {
            actions.extend((0..self.partitions.len()).map(ModelEvent::Part));
        }
    }

    fn next_state(&self, before: &Chain, action: ModelEvent) -> Option<Chain> {
        let mut chain = before.clone();
        match action {
            ModelEvent::Part(number) => chain.parts.clone_from(&self.partitions[number]),
            ModelEvent::Arrives(frame) => self.arrive(&mut chain, &frame),
            ModelEvent::Proposes(at) => self.propose(&mut chain, at),
            ModelEvent::EndsAt(at) => self.end(&mut chain, at),
            ModelEvent::Repeats(at) => self.repeat(&mut chain, at),
            ModelEvent::Passes(at) => Self::pass(&mut chain, at),
            ModelEvent::Reboots(at) => self.reboot(&mut chain, at, true),
            ModelEvent::Forgets(at) => self.reboot(&mut chain, at, false),
            ModelEvent::Moves(at) => self.move_relay(&mut chain, at),
            ModelEvent::Renews(at) => self.renew(&mut chain, at),
        }
        if chain == *before {
            return None;
        }
        match action {
            ModelEvent::Part(_) => chain.cuts -= 1,
            ModelEvent::Proposes(_) => chain.proposals -= 1,
            ModelEvent::Reboots(_) => chain.reboots -= 1,
            ModelEvent::Forgets(_) => chain.losses -= 1,
            ModelEvent::Moves(_) => chain.moves -= 1,
            ModelEvent::Renews(_) => chain.renewals -= 1,
            _ => {}
        }
        Some(chain)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![
            Property::always(ONE_CHAIN, |_, chain| Self::is_one_chain(chain)),
            Property::always(EARLIER_LEASES, |_, chain: &Chain| chain.has_ended_leases()),
            Property::always(
                "no view that is decided or agreed on has two different numbers of relays",
                |_, chain| Self::has_one_size(chain),
            ),
            Property::always(
                "every relay knows only agreed views, and no view has more members than its agreed number of relays",
                |check: &Self, chain| check.is_known_and_counted(chain),
            ),
            Property::always(
                "after all links are restored, the relays agree on a view",
                |check: &Self, chain| !check.heals || check.is_alive(chain),
            ),
        ]
    }
}

/// Violated property, and the events that lead to the violation.
pub(super) struct Counterexample {
    pub(super) what: &'static str,
    pub(super) how: String,
}

impl Check {
    /// Searches all states of the model with two threads, and prints their number. Returns a counterexample if there
    /// is one.
    pub(super) fn search(&self) -> Option<Counterexample> {
        let began = std::time::Instant::now();
        let checker = self.clone().checker().threads(2);
        let checker = checker.finish_when(HasDiscoveries::Any).spawn_bfs().join();
        let Self {
            rule,
            cuts,
            proposals,
            reboots,
            losses,
            outside,
            moves,
            renewals,
            heals,
            ..
        } = self;
        println!(
            "view model: {} relays, quorum rule {rule:?}, at most {cuts} partitions, {proposals} proposals, {reboots} reboots, {moves} departures or joins (relays outside of the chain at first: {outside:b}), {losses} losses of stored votes, {renewals} lease renewals, \
             links restored at the end: {heals}; searched {} states to depth {} in {:.1} s",
            self.members.len(),
            checker.unique_state_count(),
            checker.max_depth(),
            began.elapsed().as_secs_f32(),
        );
        let (what, path) = checker.discoveries().into_iter().next()?;
        let steps = path.into_vec().into_iter();
        let steps: Vec<String> = steps
            .map(|(chain, happens)| {
                let Chain { parts, agreed, .. } = chain;
                format!("{parts:?} agreed: {agreed:?}\n  {happens:?}\n")
            })
            .collect();
        let how = steps.concat();
        println!("violated property: {what}; events that violate it:\n{how}");
        Some(Counterexample { what, how })
    }

    pub(super) fn holds(&self) {
        assert!(self.search().is_none());
    }
}
