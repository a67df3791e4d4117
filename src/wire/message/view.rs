//! The call for a new view of the chain, and what came of it, which travels back.

use super::parts::{MessageError, PassId, ViewBody, read, write};
use super::tag;
use crate::wire::digest::MissionId;

/// The call for a new view, as one relay hands it to the next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proposal {
    /// The mission that the view is to fly: the one that every relay up to the sender holds.
    pub mission_id: MissionId,
    /// The number of the new view, above that of every agreed one.
    pub view: u16,
    /// How many relays it has come through, the sender included: 1 to 1000.
    pub place: u16,
    /// The newest view that any of them has agreed to.
    pub before: PriorView,
}

impl Proposal {
    /// The sender's place; size and number of the view before; version of the mission; whether its leader is there.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let before = self.before;
        let body = ViewBody::new(
            PassId::new(self.view, self.mission_id.digest),
            [
                self.place,
                before.relays,
                before.view,
                self.mission_id.version,
            ],
            u8::from(before.leader),
        );
        write(&(tag::PROPOSAL, body), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        Self::checked(read(body)?).ok_or(MessageError::Value)
    }

    fn checked(body: ViewBody) -> Option<Self> {
        let (place @ 1.., relays @ 1.., view, leader @ 0..=1) = body.parts()? else {
            return None;
        };
        Some(Self {
            mission_id: body.mission_id(body.pass.mission()),
            view: body.pass.number(),
            place,
            before: PriorView {
                view,
                relays,
                leader: leader == 1,
            },
        })
    }
}

/// A view of the chain that a new one follows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PriorView {
    /// Its number; 0 is the chain as the mission has it.
    pub view: u16,
    /// How many relays were in it, 1 to 1000.
    pub relays: u16,
    /// Whether its leader is among those that the call has come through.
    pub leader: bool,
}

/// What came of the call for a new view, as it travels back.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decision {
    /// The mission that the view flies.
    pub mission_id: MissionId,
    /// The number of the view.
    pub view: u16,
    /// The sender's place, from 1 at the one that has called: 1 to 1000.
    pub place: u16,
    /// How many relays there are, 1 to 1000; `None` if they are too few to go on without the others.
    pub relays: Option<u16>,
}

impl Decision {
    /// The sender's place; how many relays, 0 for too few; version of the mission.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let body = ViewBody::new(
            PassId::new(self.view, self.mission_id.digest),
            [
                self.place,
                self.relays.unwrap_or(0),
                0,
                self.mission_id.version,
            ],
            0,
        );
        write(&(tag::DECISION, body), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        Self::checked(read(body)?).ok_or(MessageError::Value)
    }

    fn checked(body: ViewBody) -> Option<Self> {
        let (place @ 1.., relays, 0, 0) = body.parts()? else {
            return None;
        };
        Some(Self {
            mission_id: body.mission_id(body.pass.mission()),
            view: body.pass.number(),
            place,
            relays: (relays > 0).then_some(relays),
        })
    }
}
