//! Messages outside of views: hello, claim to a node number, and fence between two neighbours.

use crate::guard::Fence;
use crate::mission::MAX_RELAYS;
use crate::place::CrossSection;
use crate::view::ViewId;
use crate::wire::digest::MissionId;
use crate::wire::message::parts::{MessageError, PassId, Word, read, require, tag, write};

/// Hello message: state of the sender, with its neighbour, the nodes that it receives, and its mission.
#[expect(
    clippy::struct_excessive_bools,
    reason = "eight flags of the wire format"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`digest`](crate::wire::digest::digest) of the sender's mission as loaded before flight.
    pub mission: u16,
    /// Identifier of the latest view (agreed members of the chain) that the sender knows.
    pub latest_view: ViewId,
    /// Node number of the sender's neighbour toward the destination of this hello; 0 for none.
    pub neighbour: u16,
    /// True if the sender requests a hello in return.
    pub requests_reply: bool,
    /// True if the sender requests a new view (agreed members of the chain).
    pub requests_view: bool,
    /// True until the sender first takes part, after its start, in a pass along the chain or in a view.
    pub fresh: bool,
    /// Readiness of the sender or of the destination. Its meaning depends on which of them is in the chain.
    ///
    /// - Both: true if the sender fits between the destination and the destination's present neighbour toward it.
    /// - The destination: true if the sender would join the chain when it is called.
    /// - The sender: true if the destination is called to join (`calls_destination`).
    pub ready: bool,
    /// Number of relays that the destination can reach through the sender, with the sender: 1 to 1000. These relays are
    /// linked in a row that begins with the sender and leads away from the destination.
    pub behind: u16,
    /// Nodes that the sender receives in the direction of this hello's destination, as a bit mask. Bit i, 0 to 3,
    /// stands for the node whose number differs from the sender's by i + 1.
    pub hears: u8,
    /// Identifier of the newest mission that the sender has, loaded or uploaded.
    pub latest_mission: MissionId,
    /// True if the sender uses the mission `latest_mission` now.
    pub active: bool,
    /// True if all relays of the sender's view (agreed set of relays) use the mission `latest_mission`. Always false
    /// for a mission that was loaded before flight.
    pub active_in_view: bool,
    /// True if a relay refuses the mission `latest_mission`: the sender, or a relay behind it. A relay is behind the
    /// sender if the sender is between it and the destination.
    pub refused: bool,
    /// Flag for a node outside of the chain. Its meaning depends on `fresh`.
    ///
    /// With `fresh`, the sender is outside of the chain (`is_of_outsider`). Without `fresh` the destination is, and the
    /// relays have agreed on a view without it and are at their positions (`frees_destination`).
    pub outside: bool,
    /// Nonce that a mission offer in reply to this hello must repeat. 0 if the sender accepts no offer.
    pub offer_number: u16,
}

impl Hello {
    /// Returns true if the sender of this hello, node `by`, receives node `of`. False if the two node numbers differ by
    /// more than four.
    pub(crate) const fn is_heard(&self, by: u16, of: u16) -> bool {
        let distance = by.abs_diff(of);
        distance >= 1 && distance <= 8 && self.hears >> (distance - 1) & 1 == 1
    }

    /// Returns true if the sender is outside of the chain. It would then join when it is called, if it is `ready`.
    pub(crate) const fn is_of_outsider(&self) -> bool {
        self.outside && self.fresh
    }

    /// Returns true if the sender calls the destination, which is outside of the chain, to join it.
    pub(crate) const fn calls_destination(&self) -> bool {
        self.ready && !self.fresh
    }

    /// Returns true if the destination, which is outside of the chain, may fly away.
    pub(crate) const fn frees_destination(&self) -> bool {
        self.outside && !self.fresh
    }

    /// Encodes the hello into `buffer`; returns its length, or `None` if it does not fit. The eight flags share one
    /// byte.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let flags = [
            self.requests_reply,
            self.requests_view,
            self.fresh,
            self.ready,
            self.active,
            self.active_in_view,
            self.refused,
            self.outside,
        ]
        .into_iter()
        .rev()
        .fold(0_u8, |flags, flag| flags << 1 | u8::from(flag));
        let last = [
            self.latest_mission.digest,
            self.latest_mission.version,
            self.offer_number,
        ]
        .map(Word::new);
        let newest = self.latest_view.bits().to_le_bytes();
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
        require(known && hears <= 0x0F)?;
        Ok(Self {
            mission: mission.number(),
            latest_view: ViewId::from_bits(u32::from_le_bytes(newest)),
            neighbour,
            requests_reply: flags & 1 != 0,
            requests_view: flags & 2 != 0,
            fresh: flags & 4 != 0,
            ready: flags & 8 != 0,
            behind,
            active: flags & 16 != 0,
            active_in_view: flags & 32 != 0,
            refused: flags & 64 != 0,
            outside: flags & 128 != 0,
            hears,
            offer_number: nonce.number(),
            latest_mission: MissionId {
                version: version.number(),
                digest: digest.number(),
            },
        })
    }
}

/// Claim of a node to its node number, or the echo of such a claim. Claims are sent toward Tx and toward Rx, so that
/// two nodes with the same number detect each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Claim {
    /// Random claim number of the claiming node. If two nodes have the same node number, the node with the larger claim
    /// number keeps it. A node draws its claim number at its start. While it keeps its node number, it raises the claim
    /// number at most once.
    pub number: u32,
    /// Last claim number received from a second node with the claiming node's node number; 0 for none.
    pub other_number: u32,
    /// True if the claiming node is passive because a second node uses its node number.
    pub passive: bool,
    /// True for an echo: the sender returns a claim of a node with the destination's node number. If two nodes have
    /// this number, both receive the echo, and each learns the claim of the other.
    pub echo: bool,
}

impl Claim {
    /// Encodes the claim into `buffer`; returns its length, or `None` if it does not fit. Its flags from bit 0:
    /// passive, echo.
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let flags = u8::from(self.passive) | u8::from(self.echo) << 1;
        let numbers = [self.number, self.other_number].map(u32::to_le_bytes);
        write(&(tag::CLAIM, numbers, flags), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ([number, heard], flags): ([[u8; 4]; 2], u8) = read(body)?;
        require(flags <= 3)?;
        Ok(Self {
            number: u32::from_le_bytes(number),
            other_number: u32::from_le_bytes(heard),
            passive: flags & 1 != 0,
            echo: flags & 2 != 0,
        })
    }
}

/// Encodes a fence message into `buffer`; returns its length, or `None` if it does not fit. A fence is the limit of x
/// that keeps two neighbours separated. The receiver compares `line_digest` with its own digest of the x axis.
pub(super) fn encode_fence(line_digest: u16, fence: &Fence, buffer: &mut [u8]) -> Option<usize> {
    let pass = PassId::new(fence.association, line_digest);
    let numbers = [fence.echo, fence.number].map(Word::new);
    let CrossSection { y_m, altitude_m } = fence.across;
    let places = [fence.x_m, fence.target_m, y_m, altitude_m, fence.apart_m];
    write(&(tag::FENCE, pass, numbers, places, fence.flags), buffer)
}

pub(super) fn decode_fence(body: &[u8]) -> Result<(u16, Fence), MessageError> {
    type FenceBody = (PassId, [Word; 2], [f32; 5], u8);
    let (pass, [echo, number], places, flags): FenceBody = read(body)?;
    let [x_m, target_m, y_m, altitude_m, apart_m] = places;
    let fence = Fence {
        association: pass.number(),
        echo: echo.number(),
        number: number.number(),
        x_m,
        target_m,
        across: CrossSection { y_m, altitude_m },
        apart_m,
        flags,
    };
    require(fence.is_valid())?;
    Ok((pass.digest(), fence))
}
