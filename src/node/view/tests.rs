//! Tests of the view change at one relay.

use crate::mission::Mission;
use crate::mission::tests::paper;
use crate::node::circulation::{SUSPICIOUS, Stage};
use crate::node::context::OtherLeases;
use crate::node::context::{Context, Effects, LayerEvent, Member, ProposalOutcome, Proposer};
use crate::node::view::change::{Proposed, ViewChange};
use crate::node::view::electorate::Electorate;
use crate::settings::Settings;
use crate::time::Instant;
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal, Successor};

pub(super) fn id(number: u32, node: u32) -> ViewId {
    ViewId::from_bits(number << 10 | node)
}

/// Relay under test, in a chain of four. It flies the mission loaded before flight, but has stored a different mission
/// with the version 4.
pub(super) struct Relay {
    pub(super) member: Member,
    pub(super) latest: MissionId,
    pub(super) end: bool,
    pub(super) now: Instant,
    pub(super) view: ViewChange,
}

impl Relay {
    pub(super) fn new(node: u16) -> Self {
        let mission = Mission::try_new(paper(4)).unwrap();
        Self {
            member: Member::new(mission, Settings::default(), node),
            latest: MissionId {
                version: 4,
                digest: 0x1234,
            },
            end: node == 4,
            now: Instant::ZERO,
            view: ViewChange::new(4, 1, 1),
        }
    }

    pub(super) fn second() -> Self {
        Self::new(2)
    }

    pub(super) fn handle(&mut self, message: &Message) -> Effects {
        let Self {
            ref member,
            latest,
            end,
            now,
            ref mut view,
        } = *self;
        let context = context(member, latest, end, now);
        view.handle(&context, message)
    }

    /// Makes this relay the last one that the view proposal can reach, so that it decides the proposal.
    pub(super) fn ends(&mut self) -> Effects {
        self.end = true;
        let context = context(&self.member, self.latest, true, self.now);
        self.view.decide(&context)
    }

    /// Makes this relay the leader, which has no previous relay, and lets its view request fall due.
    pub(super) fn leads(&mut self) -> Effects {
        self.view.request.start(self.now);
        self.now = self.view.request.next_timeout().unwrap();
        let context = context(&self.member, self.latest, self.end, self.now);
        self.view.handle_timeout(&context, true, false)
    }

    pub(super) fn onward(&mut self, to: u16) -> Option<Message> {
        let context = context(&self.member, self.latest, self.end, self.now);
        self.view.poll_onward(&context, to)
    }

    /// Returns a proposal of relay 1 for the view `view`.
    pub(super) fn proposal(&self, view: ViewId) -> Message {
        Message::Proposal(Proposal {
            mission_id: self.latest,
            proposed_view: view,
            place: 1,
            poll: Poll {
                votes: 1,
                proposer: true,
                ..Poll::of(View {
                    id: ViewId::LOADED,
                    relays: 4,
                })
            },
        })
    }

    /// Returns the next relay's decision on `proposal`. `view` is the accepted view; `None` for a refusal.
    pub(super) fn decision(&self, proposal: ViewId, view: Option<View>) -> Message {
        Message::Decision(Decision {
            mission_id: self.latest,
            proposed_view: proposal,
            place: self.member.node + 1,
            reached: 4,
            base: View {
                id: ViewId::LOADED,
                relays: 4,
            },
            accepted: view,
            usable_in: 0,
        })
    }
}

pub(super) fn context(member: &Member, latest: MissionId, end: bool, now: Instant) -> Context<'_> {
    Context {
        now,
        member,
        latest,
        is_last_reachable: end,
        other_leases: OtherLeases::NONE,
    }
}

pub(super) const fn all(id: ViewId) -> View {
    View { id, relays: 4 }
}

pub(super) const fn came(decided: ProposalOutcome) -> Effects {
    Effects::of(LayerEvent::ProposalDecided(decided))
}

pub(super) const PROPOSED: Effects = Effects {
    view_proposed: true,
    ..Effects::NONE.by(Proposer::Neighbour)
};

pub(super) const REPEATED: Effects = Effects::DUPLICATE.by(Proposer::Neighbour);

pub(super) const LATE: Effects = Effects::STALE.by(Proposer::Neighbour);

#[test]
fn a_proposal_is_forwarded_with_one_more_vote() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    assert_eq!(relay.handle(&proposal), PROPOSED);
    let Some(Message::Proposal(handed)) = relay.onward(3) else {
        panic!("nothing is handed on")
    };
    assert_eq!((handed.proposed_view, handed.place), (id(1, 1), 2));
    assert_eq!((handed.poll.votes, handed.poll.proposer), (2, true));
    assert_eq!(relay.onward(3), None, "once");
    assert_eq!(relay.view.poll_back(), None);
}

#[test]
fn a_duplicate_proposal_is_answered_by_its_state() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    assert_eq!(relay.handle(&proposal), REPEATED);
    let busy = Message::Busy {
        number: id(1, 1).mark(),
    };
    assert_eq!(relay.view.poll_back(), Some(busy));
    let decision = relay.decision(id(1, 1), Some(all(id(1, 1))));
    let granted = came(ProposalOutcome::Granted {
        relays: 4,
        usable_in: 0,
    });
    assert_eq!(relay.handle(&decision), granted);
    for again in [false, true] {
        if again {
            assert_eq!(relay.handle(&proposal), REPEATED);
        }
        let Some(Message::Decision(back)) = relay.view.poll_back() else {
            panic!("nothing is handed back")
        };
        assert_eq!((back.place, back.accepted), (2, Some(all(id(1, 1)))));
    }
    assert_eq!(relay.handle(&decision), Effects::STALE);
}

#[test]
fn a_newer_proposal_replaces_an_outstanding_one() {
    let mut relay = Relay::second();
    for view in [id(1, 1), id(1, 3), id(2, 1)] {
        let proposal = relay.proposal(view);
        assert_eq!(relay.handle(&proposal), PROPOSED);
    }
    let old = relay.proposal(id(1, 3));
    assert_eq!(relay.handle(&old), LATE);
}

/// Checks that a second proposal of a view, with a different mission, is not treated as a duplicate.
///
/// Between the two proposals the leader has restarted and received the different mission.
#[test]
fn a_proposal_of_the_same_view_with_another_mission_is_another() {
    let mut relay = Relay::second();
    let first = relay.proposal(id(1, 1));
    assert_eq!(relay.handle(&first), PROPOSED);
    assert_eq!(relay.handle(&first), REPEATED);
    relay.latest.version = 5;
    let again = relay.proposal(id(1, 1));
    assert_eq!(relay.handle(&again), LATE);
}

#[test]
fn a_later_promise_excludes_an_earlier_decision() {
    let mut relay = Relay::second();
    for view in [id(1, 1), id(2, 1)] {
        let proposal = relay.proposal(view);
        relay.handle(&proposal);
    }
    let early = relay.decision(id(1, 1), Some(all(id(1, 1))));
    assert_eq!(relay.handle(&early), Effects::STALE);
    assert!(!relay.view.electorate.awaits(id(1, 1)));
    assert_eq!(relay.view.circulation.stage(), Stage::Outstanding);
}

#[test]
fn a_decision_counts_only_from_the_next_relay() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let Message::Decision(decision) = relay.decision(id(1, 1), Some(all(id(1, 1)))) else {
        return;
    };
    let small = View {
        id: id(1, 1),
        relays: 2,
    };
    let strays = [
        Decision {
            place: 2,
            ..decision
        },
        Decision {
            place: 4,
            ..decision
        },
        Decision {
            proposed_view: id(1, 3),
            ..decision
        },
        Decision {
            accepted: Some(small),
            ..decision
        },
    ];
    for stray in strays {
        let stray = Message::Decision(stray);
        assert_eq!(relay.handle(&stray), Effects::STALE, "{stray:?}");
    }
    assert_eq!(relay.view.circulation.stage(), Stage::Outstanding);
}

#[test]
fn the_last_relay_decides() {
    let mut relay = Relay::new(4);
    let Message::Proposal(mut proposal) = relay.proposal(id(1, 1)) else {
        return;
    };
    proposal.place = 3;
    proposal.poll.votes = 3;
    let granted = Effects {
        event: Some(LayerEvent::ProposalDecided(ProposalOutcome::Granted {
            relays: 4,
            usable_in: 0,
        })),
        ..PROPOSED
    };
    assert_eq!(relay.handle(&Message::Proposal(proposal)), granted);
    assert!(relay.view.electorate.awaits(id(1, 1)));
    // The first pass shows that all relays have accepted the view.
    relay.view.commit(id(1, 1));
    assert_eq!(relay.view.electorate.agreed(), all(id(1, 1)));
    relay.view.commit(id(1, 1));
    assert_eq!(relay.view.electorate.agreed(), all(id(1, 1)));
}

#[test]
fn the_leader_proposes_again_after_a_superseded_proposal() {
    let mut relay = Relay::new(1);
    relay.leads();
    relay.onward(2).unwrap();
    let earlier = View {
        id: id(1, 1),
        relays: 3,
    };
    // This relay has proposed the view itself and has not received the decision.
    let first = relay.view.electorate.promised();
    assert_eq!(first, earlier.id);
    relay.view.observe_view(id(2, 3));
    relay.now = relay.view.request.next_timeout().unwrap();
    assert!(relay.leads().began);
    let second = relay.view.electorate.promised();
    assert!(second > id(2, 3));
    let decision = relay.decision(second, Some(earlier));
    let superseded = ProposalOutcome::Superseded {
        view: Some(earlier.id),
        usable_in: 0,
    };
    assert_eq!(relay.handle(&decision), came(superseded));
    assert_eq!(relay.view.electorate.agreed(), earlier);
    assert!(relay.view.electorate.member);
    assert_eq!(relay.view.poll_back(), None, "nobody is before it");
    assert!(relay.leads().began);
}

/// Checks that the refusal of a proposal states the newest agreed view. From it the relays near the leader learn of
/// this view. Otherwise all their proposals would be refused.
#[test]
fn a_refusal_names_the_agreed_view() {
    let view = View {
        id: id(1, 1),
        relays: 3,
    };
    let voted = |mut electorate: Electorate, node| {
        electorate
            .vote(node, view.id, None, OtherLeases::NONE)
            .unwrap();
        let base = electorate.agreed();
        assert!(electorate.accept(view.id, base, Some(view)));
        electorate
    };
    let [mut second, mut third] = [2, 3].map(Relay::new);
    second.view.electorate = voted(second.view.electorate, 2);
    third.view.electorate = voted(third.view.electorate, 3);
    third.view.commit(view.id);
    third.end = true;
    second.view.observe_view(view.id);
    let mut refused = 0;
    for round in 0..2 {
        assert!(second.leads().began);
        let proposal = second.onward(3).unwrap();
        let effects = third.handle(&proposal);
        let Some(Message::Decision(back)) = third.view.poll_back() else {
            panic!("nothing is handed back")
        };
        if effects.event == Some(LayerEvent::ProposalDecided(ProposalOutcome::NoQuorum)) {
            refused += 1;
            assert_eq!((back.base, back.accepted), (view, None));
        }
        let decided = second.handle(&Message::Decision(back)).event;
        if round == 0 {
            assert_eq!(
                decided,
                Some(LayerEvent::ProposalDecided(ProposalOutcome::NoQuorum))
            );
            assert_eq!(second.view.electorate.agreed(), view);
        } else {
            // Both relays now know the view, so two of the view's three members vote.
            assert!(matches!(
                decided,
                Some(LayerEvent::ProposalDecided(ProposalOutcome::Granted {
                    relays: 2,
                    ..
                }))
            ));
        }
    }
    assert_eq!(refused, 1);
}

#[test]
fn a_decision_counts_only_for_its_mission() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let decision = relay.decision(id(1, 1), Some(all(id(1, 1))));
    let Message::Decision(mut other) = decision.clone() else {
        return;
    };
    other.mission_id.version = 5;
    assert_eq!(relay.handle(&Message::Decision(other)), Effects::STALE);
    let granted = came(ProposalOutcome::Granted {
        relays: 4,
        usable_in: 0,
    });
    assert_eq!(relay.handle(&decision), granted);
}

/// Checks that a relay ignores the decision on a view with an older mission than it has stored.
#[test]
fn a_relay_without_the_mission_is_not_in_its_view() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let decision = relay.decision(id(1, 1), Some(all(id(1, 1))));
    relay.latest.version = 5;
    assert_eq!(relay.handle(&decision), Effects::FOREIGN);
    assert_eq!(relay.view.circulation.stage(), Stage::Outstanding);
    assert!(matches!(
        relay.view.proposed,
        Some(Proposed { accepted: None, .. })
    ));
    assert!(!relay.view.electorate.awaits(id(1, 1)));
}

#[test]
fn an_accepted_successor_is_reported_and_decided_again() {
    let mut relay = Relay::new(4);
    let first = all(id(1, 1));
    relay
        .view
        .electorate
        .vote(4, first.id, None, OtherLeases::NONE)
        .unwrap();
    let base = relay.view.electorate.agreed();
    assert!(relay.view.electorate.accept(first.id, base, Some(first)));
    let Message::Proposal(mut proposal) = relay.proposal(id(2, 1)) else {
        return;
    };
    proposal.place = 2;
    proposal.poll.votes = 2;
    let decided = relay.handle(&Message::Proposal(proposal)).event;
    let superseded = ProposalOutcome::Superseded {
        view: Some(first.id),
        usable_in: 0,
    };
    assert_eq!(decided, Some(LayerEvent::ProposalDecided(superseded)));
    let poll = relay.view.proposed.unwrap().poll;
    assert_eq!(
        poll.successor,
        Some(Successor {
            proposal: first.id,
            view: first,
        })
    );
    assert!(relay.view.electorate.awaits(first.id));
}

#[test]
fn a_relay_without_a_next_one_decides_an_unsent_proposal() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    let granted = came(ProposalOutcome::Granted {
        relays: 2,
        usable_in: 0,
    });
    assert_eq!(relay.ends(), granted);
    assert_eq!(relay.ends(), Effects::NONE, "once");
}

#[test]
fn a_forwarded_proposal_without_a_next_relay_is_abandoned() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(1, 1));
    relay.handle(&proposal);
    relay.onward(3).unwrap();
    for _ in 0..3 {
        assert_eq!(relay.ends(), Effects::NONE);
        assert!(relay.view.request.is_pending());
        assert_eq!(relay.view.latest_view(), id(2, 2), "one number more, once");
    }
    // Relay 2 may decide a later proposal if it is the last relay then.
    let later = relay.proposal(id(3, 1));
    assert!(relay.handle(&later).event.is_some());
}

/// Checks that a relay forwards a view proposal to one node only.
///
/// Otherwise two views could have the same identifier if relay 1 loses the link to relay 2: one view with the members 1
/// to 3, and one with 1 and 4.
#[test]
fn a_proposal_is_forwarded_to_only_one_node() {
    let mut relay = Relay::new(1);
    let began = relay.leads();
    assert!(began.began && began.view_proposed);
    relay.onward(2).unwrap();
    relay.view.resend();
    assert_eq!(relay.onward(4), None);
    assert!(relay.view.request.is_pending());
    relay.view.resend();
    assert!(relay.onward(2).is_some(), "it may be back");
    // A later proposal may be forwarded to node 4.
    let mut later = relay.leads();
    for _ in 0..4 {
        if later.began {
            break;
        }
        later = relay.leads();
    }
    assert!(later.began);
    assert!(
        matches!(relay.onward(4), Some(Message::Proposal(Proposal { proposed_view: view, .. })) if view > id(1, 1))
    );
}

#[test]
fn a_refused_leader_proposes_again_later() {
    let mut relay = Relay::second();
    relay.end = true;
    assert_eq!(relay.leads().event, came(ProposalOutcome::NoQuorum).event);
    assert!(relay.view.has_no_quorum() && relay.view.request.is_pending());
    assert!(!relay.view.electorate.has_voted(relay.view.latest_view()));
    let again = relay.view.request.next_timeout().unwrap();
    assert!(again >= relay.now + relay.member.settings.probe_after);
}

/// Checks that a relay repeats its request for a view often, as long as no decision arrives. On a channel that loses
/// half of all frames, each hop toward the leader would otherwise wait for several seconds.
#[test]
fn a_request_for_a_view_is_repeated_often() {
    let mut relay = Relay::second();
    let most = relay.member.settings.hop_time.times(32);
    relay.view.request.start(relay.now);
    let probe_after = relay.member.settings.probe_after;
    for requests in 0..20 {
        let at = relay.view.request.next_timeout().unwrap();
        let wait = at.since(relay.now);
        assert!(
            wait <= most || requests > 13 && wait <= probe_after,
            "{requests}: {wait:?}"
        );
        // A relay that may be absent is asked less often in the end.
        assert!(requests < 18 || wait == probe_after, "{requests}: {wait:?}");
        relay.now = at;
        let context = context(&relay.member, relay.latest, relay.end, relay.now);
        let effects = relay.view.handle_timeout(&context, false, false);
        assert_eq!(effects.event, Some(LayerEvent::RequestView));
    }
}

#[test]
fn a_leader_proposes_later_views_one_at_a_time() {
    let mut relay = Relay::new(1);
    relay.view.observe_view(id(7, 3));
    assert!(relay.leads().began);
    assert_eq!(relay.view.latest_view(), id(8, 1));
    assert!(!relay.leads().began, "it is under way");
    relay.view.observe_view(id(8, 2));
    assert!(relay.leads().began);
    assert_eq!(relay.view.latest_view(), id(9, 1));
    // The number of the latest known view approaches a much larger view number in steps.
    for number in [4_105, 8_201, 9_000, 9_000] {
        relay.view.observe_view(id(9_000, 3));
        assert_eq!(relay.view.latest_view(), id(number, 3));
    }
}

/// Checks that a relay that is alone for hours makes no proposals without a quorum. Each proposal would use up a view
/// number.
#[test]
fn a_refused_lone_leader_proposes_only_with_a_quorum() {
    let mut relay = Relay::second();
    relay.end = true;
    assert_eq!(relay.leads().event, came(ProposalOutcome::NoQuorum).event);
    let newest = relay.view.latest_view();
    for _ in 0..1_000 {
        assert_eq!(relay.leads(), Effects::NONE);
        assert!(relay.view.has_no_quorum() && relay.view.request.is_pending());
    }
    assert_eq!(relay.view.latest_view(), newest);
    // With a next relay the vote may give a quorum.
    relay.end = false;
    let began = (0..8).any(|_| relay.leads().began);
    assert!(began && relay.view.latest_view() > newest);
}

#[test]
fn late_proposals_cause_a_request_for_a_view() {
    let mut relay = Relay::second();
    let proposal = relay.proposal(id(3, 1));
    relay.handle(&proposal);
    let late = relay.proposal(id(2, 1));
    for _ in 1..SUSPICIOUS {
        assert_eq!(relay.handle(&late), LATE);
    }
    let foreign = Effects::FOREIGN.by(Proposer::Neighbour);
    assert_eq!(relay.handle(&late), foreign);
    assert_eq!(relay.view.latest_view(), id(4, 2));
}
