//! Votes on a view: proposal and decision.

use serde::Deserialize;
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::message::{Decision, Message, Poll, Proposal, Successor};
use uav_relay::{View, ViewId};

use super::hello::mission_id;

use super::bytes::{pass, words};
use super::limits::{is_count, is_proposed};
use super::reader::Reader;

/// View and its number of relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct SizedView {
    pub(crate) id: u32,
    pub(crate) relays: u16,
}

impl SizedView {
    pub(super) fn write(self, out: &mut Vec<u8>) {
        out.extend(self.id.to_le_bytes());
        words(out, &[self.relays]);
    }

    pub(super) fn view(self) -> View {
        View {
            id: ViewId::from_bits(self.id),
            relays: self.relays,
        }
    }

    pub(super) fn is_proposed(self) -> bool {
        is_proposed(self.id) && is_count(self.relays)
    }

    /// Returns true for a proposed view or the chain as loaded.
    pub(super) fn is_view(self) -> bool {
        (self.id == 0 || is_proposed(self.id)) && is_count(self.relays)
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            id: rest.long()?,
            relays: rest.word()?,
        })
    }
}

/// Common content of proposals and decisions: mission, view, and the sender's place.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Call {
    /// Digest and version of the mission.
    pub(crate) of: (u16, u16),
    pub(crate) view: u32,
    pub(crate) place: u16,
}

impl Call {
    pub(super) fn body(self, tag: u8) -> Vec<u8> {
        let mut out = pass(tag, [self.of.0, self.of.1]);
        out.extend(self.view.to_le_bytes());
        words(&mut out, &[self.place]);
        out
    }

    pub(super) fn mission_id(self) -> MissionId {
        mission_id(self.of)
    }

    pub(super) fn in_range(self) -> bool {
        is_proposed(self.view) && is_count(self.place)
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            of: (rest.word()?, rest.word()?),
            view: rest.long()?,
            place: rest.word()?,
        })
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Proposed {
    pub(crate) call: Call,
    pub(crate) agreed: SizedView,
    pub(crate) votes: u16,
    pub(crate) lease_left: u16,
    pub(crate) rest: u16,
    pub(crate) proposer: bool,
    /// Accepted successor: the proposal by which it was decided, and the view.
    pub(crate) successor: Option<(u32, SizedView)>,
}

impl Proposed {
    pub(super) fn body(self) -> Vec<u8> {
        let mut out = self.call.body(11);
        self.agreed.write(&mut out);
        words(&mut out, &[self.votes, self.lease_left, self.rest]);
        out.push(u8::from(self.proposer));
        out.push(u8::from(self.successor.is_some()));
        if let Some((proposal, view)) = self.successor {
            out.extend(proposal.to_le_bytes());
            view.write(&mut out);
        }
        out
    }

    pub(super) fn message(self) -> Message {
        Message::Proposal(Proposal {
            mission_id: self.call.mission_id(),
            view: ViewId::from_bits(self.call.view),
            place: self.call.place,
            poll: Poll {
                agreed: self.agreed.view(),
                votes: self.votes,
                proposer: self.proposer,
                lease_left: self.lease_left,
                rest: self.rest,
                successor: self.successor.map(|(proposal, view)| Successor {
                    proposal: ViewId::from_bits(proposal),
                    view: view.view(),
                }),
            },
        })
    }

    pub(super) fn in_range(self) -> bool {
        let agreed = self.agreed;
        self.call.in_range()
            && agreed.is_view()
            && self.votes <= agreed.relays
            && self
                .successor
                .is_none_or(|(proposal, view)| is_proposed(proposal) && view.is_proposed())
            // The views were proposed earlier.
            && agreed.id < self.call.view
            && self.successor.is_none_or(|(proposal, view)| {
                proposal < self.call.view && view.id <= proposal
            })
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            call: Call::read(rest)?,
            agreed: SizedView::read(rest)?,
            votes: rest.word()?,
            lease_left: rest.word()?,
            rest: rest.word()?,
            proposer: rest.bool()?,
            successor: rest.option(|rest| Some((rest.long()?, SizedView::read(rest)?)))?,
        })
    }
}

/// Content of a decision.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Decided {
    pub(crate) call: Call,
    /// View that the decision follows.
    pub(crate) base: SizedView,
    pub(crate) view: Option<SizedView>,
    pub(crate) there: u16,
    pub(crate) lease_left: u16,
}

impl Decided {
    pub(super) fn body(self) -> Vec<u8> {
        let mut out = self.call.body(12);
        self.base.write(&mut out);
        out.push(u8::from(self.view.is_some()));
        if let Some(view) = self.view {
            view.write(&mut out);
        }
        words(&mut out, &[self.there, self.lease_left]);
        out
    }

    pub(super) fn in_range(self) -> bool {
        self.call.in_range()
            && self.base.is_view()
            && self.base.id < self.call.view
            && is_count(self.there)
            && self.view.is_none_or(SizedView::is_proposed)
    }

    pub(super) fn message(self) -> Message {
        Message::Decision(Decision {
            mission_id: self.call.mission_id(),
            proposal: ViewId::from_bits(self.call.view),
            place: self.call.place,
            there: self.there,
            base: self.base.view(),
            view: self.view.map(SizedView::view),
            lease_left: self.lease_left,
        })
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            call: Call::read(rest)?,
            base: SizedView::read(rest)?,
            view: rest.option(SizedView::read)?,
            there: rest.word()?,
            lease_left: rest.word()?,
        })
    }
}
