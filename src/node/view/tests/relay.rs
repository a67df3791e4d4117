//! Test relay in a chain of four, with its inputs.

use crate::mission::Mission;
use crate::mission::tests::paper;
use crate::node::context::{Context, Decided, Effects, Member, News, Proposer};
use crate::node::view::change::ViewChange;
use crate::node::view::electorate::Held;
use crate::settings::Settings;
use crate::time::Instant;
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal};

pub(super) fn id(number: u32, node: u32) -> ViewId {
    ViewId::from_bits(number << 10 | node)
}

/// Relay in a chain of four that holds mission 4 and flies the loaded one.
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

    /// Removes the next relay.
    pub(super) fn ends(&mut self) -> Effects {
        self.end = true;
        let context = context(&self.member, self.latest, true, self.now);
        self.view.decide(&context)
    }

    /// Lets the relay lead: no relay precedes it, and its request timer expires.
    pub(super) fn leads(&mut self) -> Effects {
        self.view.asking.ask(self.now);
        self.now = self.view.asking.next_timeout().unwrap();
        let context = context(&self.member, self.latest, self.end, self.now);
        self.view.handle_timeout(&context, true, false)
    }

    pub(super) fn onward(&mut self, to: u16) -> Option<Message> {
        let context = context(&self.member, self.latest, self.end, self.now);
        self.view.take_onward(&context, to)
    }

    /// Returns a proposal of relay 1.
    pub(super) fn proposal(&self, view: ViewId) -> Message {
        Message::Proposal(Proposal {
            mission_id: self.latest,
            view,
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

    /// Returns a decision sent by the next relay.
    pub(super) fn decision(&self, proposal: ViewId, view: Option<View>) -> Message {
        Message::Decision(Decision {
            mission_id: self.latest,
            proposal,
            place: self.member.node + 1,
            there: 4,
            base: View {
                id: ViewId::LOADED,
                relays: 4,
            },
            view,
            lease_left: 0,
        })
    }
}

pub(super) fn context(member: &Member, latest: MissionId, end: bool, now: Instant) -> Context<'_> {
    Context {
        now,
        member,
        latest,
        end,
        held: Held::NONE,
    }
}

pub(super) const fn all(id: ViewId) -> View {
    View { id, relays: 4 }
}

pub(super) const fn came(decided: Decided) -> Effects {
    Effects::of(News::Decided(decided))
}

pub(super) const PROPOSED: Effects = Effects {
    view_proposed: true,
    ..Effects::NONE.by(Proposer::Neighbour)
};

pub(super) const REPEATED: Effects = Effects::DUPLICATE.by(Proposer::Neighbour);

pub(super) const LATE: Effects = Effects::STALE.by(Proposer::Neighbour);
