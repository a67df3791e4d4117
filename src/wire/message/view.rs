//! The proposal of a new view of the chain, and the decision on it, which travels back.

use serde::{Deserialize, Serialize};

use super::parts::{MessageError, Word, read, write};
use super::tag;
use crate::mission::MAX_RELAYS;
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;

/// The proposal of a new view, as one relay hands it to the next.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proposal {
    /// The mission that the view is to fly: the one that every relay up to the sender holds.
    pub mission_id: MissionId,
    /// The new view, after every one that its proposer has heard of.
    pub view: ViewId,
    /// How many relays it has come through, the sender included: 1 to 1000.
    pub place: u16,
    /// What it has gathered from them.
    pub poll: Poll,
}

/// What a proposal has gathered.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Poll {
    /// The newest view that any relay on the way knows to be agreed on.
    pub agreed: View,
    /// How many of its members were on the way, 0 to 1000.
    pub votes: u16,
    /// Whether one of them is the one that proposed it: of two halves, theirs is the larger.
    pub proposer: bool,
    /// How long members of it that are elsewhere may still hold it, in tenths of a second.
    pub lease_left: u16,
    /// How long its places are still not to be taken, for the sake of earlier views, in tenths of a second; 65535 where nobody knows.
    pub rest: u16,
    /// The latest successor of it that a member has accepted, which may have been agreed on.
    pub successor: Option<Successor>,
}

impl Poll {
    /// Of the members of `agreed`, before any has been asked.
    pub(crate) const fn of(agreed: View) -> Self {
        Self {
            agreed,
            votes: 0,
            proposer: false,
            lease_left: u16::MAX,
            rest: u16::MAX,
            successor: None,
        }
    }
}

/// A view that was decided on, and may have been agreed on.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Successor {
    /// The proposal that the decision was on.
    pub proposal: ViewId,
    /// The view: the one proposed, or one that was found to be decided on before.
    pub view: View,
}

/// What came of a proposal, as it travels back.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decision {
    /// The mission that was proposed.
    pub mission_id: MissionId,
    /// The view that was proposed.
    pub proposal: ViewId,
    /// The sender's place, from 1 at the one that has proposed: 1 to 1000.
    pub place: u16,
    /// How many relays the proposal has come through: 1 to 1000.
    pub there: u16,
    /// The newest view that any relay on the way knew to be agreed on: what is decided follows it.
    pub base: View,
    /// The view to be accepted: the one proposed, or one that was decided on before; `None` if too few members are there.
    pub view: Option<View>,
    /// How long its places are not to be taken, for the sake of members of the view before that are elsewhere, in tenths of a second.
    pub lease_left: u16,
}

/// A mission, a proposal and a place.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct CallBody {
    digest: Word,
    version: Word,
    proposal: [u8; 4],
    place: Word,
}

impl CallBody {
    const fn new(mission_id: MissionId, proposal: ViewId, place: u16) -> Self {
        Self {
            digest: Word::new(mission_id.digest),
            version: Word::new(mission_id.version),
            proposal: proposal.bits().to_le_bytes(),
            place: Word::new(place),
        }
    }

    /// The numbers, if they are in range.
    fn checked(self) -> Option<(MissionId, ViewId, u16)> {
        let mission_id = MissionId {
            version: self.version.number(),
            digest: self.digest.number(),
        };
        let proposal = ViewId::from_bits(u32::from_le_bytes(self.proposal));
        let place = self.place.number();
        let known = proposal.is_proposed() && is_size(place);
        known.then_some((mission_id, proposal, place))
    }
}

/// A view and its size.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct SizedBody {
    id: [u8; 4],
    relays: Word,
}

impl SizedBody {
    const fn of(view: View) -> Self {
        Self {
            id: view.id.bits().to_le_bytes(),
            relays: Word::new(view.relays),
        }
    }

    fn view(self) -> View {
        View {
            id: ViewId::from_bits(u32::from_le_bytes(self.id)),
            relays: self.relays.number(),
        }
    }
}

/// Whether a chain can be in it.
fn is_view(view: View) -> bool {
    (view.id == ViewId::LOADED || view.id.is_proposed()) && is_size(view.relays)
}

fn is_size(relays: u16) -> bool {
    (1..=MAX_RELAYS).contains(&relays)
}

impl Proposal {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let Poll {
            agreed,
            votes,
            proposer,
            lease_left,
            rest,
            successor,
        } = self.poll;
        let successor = successor.map(|successor| {
            let proposal = successor.proposal.bits().to_le_bytes();
            (proposal, SizedBody::of(successor.view))
        });
        let call = CallBody::new(self.mission_id, self.view, self.place);
        let numbers = [votes, lease_left, rest].map(Word::new);
        let agreed = SizedBody::of(agreed);
        write(
            &(tag::PROPOSAL, call, agreed, numbers, proposer, successor),
            buffer,
        )
    }

    /// What is agreed on, or was decided on, was proposed before.
    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (call, agreed, numbers, proposer, successor): ProposalBody = read(body)?;
        let [votes, lease_left, rest] = numbers.map(Word::number);
        let agreed: View = SizedBody::view(agreed);
        let successor = successor.map(|(proposal, view)| Successor {
            proposal: ViewId::from_bits(u32::from_le_bytes(proposal)),
            view: view.view(),
        });
        let poll = Poll {
            agreed,
            votes,
            proposer,
            lease_left,
            rest,
            successor,
        };
        let known = is_view(agreed)
            && poll.votes <= agreed.relays
            && successor.is_none_or(|successor| {
                successor.proposal.is_proposed()
                    && successor.view.id.is_proposed()
                    && is_size(successor.view.relays)
            });
        let (mission_id, view, place) = call
            .checked()
            .filter(|_| known)
            .filter(|(_, view, _)| {
                agreed.id < *view
                    && successor.is_none_or(|successor| {
                        successor.proposal < *view && successor.view.id <= successor.proposal
                    })
            })
            .ok_or(MessageError::Value)?;
        Ok(Self {
            mission_id,
            view,
            place,
            poll,
        })
    }
}

type ProposalBody = (
    CallBody,
    SizedBody,
    [Word; 3],
    bool,
    Option<([u8; 4], SizedBody)>,
);

impl Decision {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let call = CallBody::new(self.mission_id, self.proposal, self.place);
        let view = self.view.map(SizedBody::of);
        let base = SizedBody::of(self.base);
        let numbers = [self.there, self.lease_left].map(Word::new);
        write(&(tag::DECISION, call, base, view, numbers), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (call, base, view, numbers): (CallBody, SizedBody, Option<SizedBody>, [Word; 2]) =
            read(body)?;
        let base = base.view();
        let [there, lease_left] = numbers.map(Word::number);
        let view = view.map(SizedBody::view);
        let known = is_view(base)
            && is_size(there)
            && view.is_none_or(|view| view.id.is_proposed() && is_size(view.relays));
        let (mission_id, proposal, place) = call
            .checked()
            .filter(|(_, proposal, _)| known && base.id < *proposal)
            .ok_or(MessageError::Value)?;
        Ok(Self {
            mission_id,
            proposal,
            place,
            there,
            base,
            view,
            lease_left,
        })
    }
}
