//! What one node tells another about the chain as it sees it.

use super::parts::{MessageError, PassId, ViewBody, read, write};
use super::tag;
use crate::wire::digest::MissionId;

/// What one node tells another about the chain as it sees it.
#[expect(
    clippy::struct_excessive_bools,
    reason = "five flags of the wire format"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`digest`](crate::wire::digest::digest) of the sender's mission, as it was loaded.
    pub mission: u16,
    /// The largest number of a view that the sender has heard of.
    pub newest: u16,
    /// The node that it takes for its neighbour on this side; 0 for none.
    pub neighbour: u16,
    /// Whether it asks for a hello in return.
    pub ask: bool,
    /// Whether it asks for a new view.
    pub form: bool,
    /// Whether it has been switched on and has had no part in anything yet.
    pub fresh: bool,
    /// Whether it can hear a node on its other side, or needs none there.
    pub ready: bool,
    /// The newest mission that it holds.
    pub holds: MissionId,
    /// Whether that is the one it flies.
    pub flies: bool,
}

impl Hello {
    /// The neighbour; digest and version of what it holds; flags from bit 0: asks for a hello, asks for a new view, fresh, ready,
    /// flies what it holds.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let flags = [self.ask, self.form, self.fresh, self.ready, self.flies]
            .into_iter()
            .rev()
            .fold(0, |flags, flag| flags << 1 | u8::from(flag));
        let body = ViewBody::new(
            PassId::new(self.newest, self.mission),
            [self.neighbour, 0, self.holds.digest, self.holds.version],
            flags,
        );
        write(&(tag::HELLO, body), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        Self::checked(read(body)?).ok_or(MessageError::Value)
    }

    fn checked(body: ViewBody) -> Option<Self> {
        let (neighbour, 0, held, flags @ 0..=0x1F) = body.parts()? else {
            return None;
        };
        Some(Self {
            mission: body.pass.mission(),
            newest: body.pass.number(),
            neighbour,
            ask: flags & 1 != 0,
            form: flags & 2 != 0,
            fresh: flags & 4 != 0,
            ready: flags & 8 != 0,
            flies: flags & 16 != 0,
            holds: body.mission_id(held),
        })
    }
}
