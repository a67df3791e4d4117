//! What one node tells another about the chain as it sees it.

use super::parts::{MessageError, Word, read, write};
use super::tag;
use crate::mission::MAX_RELAYS;
use crate::view::ViewId;
use crate::wire::digest::MissionId;

/// What one node tells another about the chain as it sees it.
#[expect(
    clippy::struct_excessive_bools,
    reason = "seven flags of the wire format"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`digest`](crate::wire::digest::digest) of the sender's mission, as it was loaded.
    pub mission: u16,
    /// The latest view that the sender has heard of.
    pub newest: ViewId,
    /// The node that it takes for its neighbour on this side; 0 for none.
    pub neighbour: u16,
    /// Whether it asks for a hello in return.
    pub ask: bool,
    /// Whether it asks for a new view.
    pub form: bool,
    /// Whether it has been switched on and has had no part in anything yet.
    pub fresh: bool,
    /// Whether it could come between the receiver and the node that the receiver takes there: whether it and that one hear each other.
    pub ready: bool,
    /// How many relays hang together from it on toward its other side, itself included: 1 to 1000.
    pub behind: u16,
    /// The nodes on this side that it hears, bit 0 for the nearest: 0 to 15.
    pub hears: u8,
    /// The newest mission that it holds.
    pub holds: MissionId,
    /// Whether that is the one it flies.
    pub flies: bool,
    /// Whether all relays of its view fly that, an uploaded mission.
    pub whole: bool,
    /// Whether a relay that it knows of refuses that: the sender itself, which then flies and holds another one, or one beyond it.
    pub refused: bool,
    /// A number for the offer that answers it; 0 at a node that takes none.
    pub nonce: u16,
}

impl Hello {
    /// Whether node `by`, which says this, hears node `of`, which is on the side that it says it to.
    pub(crate) const fn is_heard(&self, by: u16, of: u16) -> bool {
        let distance = by.abs_diff(of);
        distance >= 1 && distance <= 8 && self.hears >> (distance - 1) & 1 == 1
    }

    /// The mission; the neighbour; how many are behind; the newest view; digest and version of what it holds; the number for an offer; whom it hears; flags from bit 0: asks for
    /// a hello, asks for a new view, fresh, ready, flies what it holds, so do all of its view, refused.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let Self {
            ask, form, fresh, ..
        } = *self;
        let flags = [
            ask,
            form,
            fresh,
            self.ready,
            self.flies,
            self.whole,
            self.refused,
        ]
        .into_iter()
        .rev()
        .fold(0_u8, |flags, flag| flags << 1 | u8::from(flag));
        let last = [self.holds.digest, self.holds.version, self.nonce].map(Word::new);
        let newest = self.newest.bits().to_le_bytes();
        let near = [self.mission, self.neighbour, self.behind].map(Word::new);
        write(
            &(tag::HELLO, near, newest, last, [self.hears, flags]),
            buffer,
        )
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ([mission, neighbour, behind], newest, [digest, version, nonce], [hears, flags]): (
            [Word; 3],
            [u8; 4],
            [Word; 3],
            [u8; 2],
        ) = read(body)?;
        let neighbour = neighbour.number();
        let behind = behind.number();
        let known = neighbour <= MAX_RELAYS && (1..=MAX_RELAYS).contains(&behind);
        if !known || hears > 0x0F || flags > 0x7F {
            return Err(MessageError::Value);
        }
        Ok(Self {
            mission: mission.number(),
            newest: ViewId::from_bits(u32::from_le_bytes(newest)),
            neighbour,
            ask: flags & 1 != 0,
            form: flags & 2 != 0,
            fresh: flags & 4 != 0,
            ready: flags & 8 != 0,
            behind,
            flies: flags & 16 != 0,
            whole: flags & 32 != 0,
            refused: flags & 64 != 0,
            hears,
            nonce: nonce.number(),
            holds: MissionId {
                version: version.number(),
                digest: digest.number(),
            },
        })
    }
}
