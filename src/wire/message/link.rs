//! Messages outside of views: hello, claim to a node number, and fence between two neighbours.

use crate::guard::Fence;
use crate::mission::MAX_RELAYS;
use crate::place::CrossSection;
use crate::view::ViewId;
use crate::wire::digest::MissionId;
use crate::wire::message::parts::{MessageError, PassId, Word, read, require, tag, write};

/// Hello: the sender's neighbour, received nodes, view and mission.
#[expect(
    clippy::struct_excessive_bools,
    reason = "eight flags of the wire format"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`digest`](crate::wire::digest::digest) of the mission loaded before flight.
    pub mission: u16,
    /// Latest view known to the sender.
    pub latest_view: ViewId,
    /// Sender's neighbour toward the destination; 0 for none.
    pub neighbour: u16,
    /// True if the sender requests a hello.
    pub requests_reply: bool,
    /// True if the sender requests a new view (members).
    pub requests_view: bool,
    /// True if the sender has restarted and joined nothing yet.
    pub fresh: bool,
    /// Readiness of sender or destination.
    ///
    /// - Both in the chain: the sender fits in beside the destination.
    /// - Sender outside: it would join.
    /// - Destination outside: it is called to join.
    pub ready: bool,
    /// Number of relays from the sender on: 1 to 1000.
    pub behind: u16,
    /// Nodes that the sender receives toward the destination. Bit i: number differs by i + 1.
    pub hears: u8,
    /// Newest mission of the sender, loaded or uploaded.
    pub latest_mission: MissionId,
    /// True if the sender uses `latest_mission` now.
    pub active: bool,
    /// True if all relays of the view use `latest_mission`.
    pub active_in_view: bool,
    /// True if the sender or a relay beyond refuses `latest_mission`.
    pub refused: bool,
    /// Flag for a node outside the chain.
    ///
    /// - With `fresh`: the sender is outside, and no relay selects it.
    /// - Without: the destination is outside an agreed view that is in place.
    pub outside: bool,
    /// Nonce for a mission offer; 0 to accept none.
    pub offer_number: u16,
}

impl Hello {
    /// Returns true if `by` receives `of`, within four numbers.
    pub(crate) const fn is_heard(&self, by: u16, of: u16) -> bool {
        let distance = by.abs_diff(of);
        distance >= 1 && distance <= 8 && self.hears >> (distance - 1) & 1 == 1
    }

    /// Encodes into `buffer`; returns the length, if it fits.
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

/// Claim of a node to its number, or another's echo. It detects two nodes with the same number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Claim {
    /// Random claim number; the larger wins. Raised at most once while active.
    pub number: u32,
    /// Other claim to the same number; 0 for none.
    pub other_number: u32,
    /// True if the node is passive: another uses its number.
    pub passive: bool,
    /// True for an echo of a claim to the destination's number.
    pub echo: bool,
}

impl Claim {
    /// Encodes into `buffer`; returns the length, if it fits. Flags from bit 0: passive, echo.
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

/// Encodes a limit of x (fence); returns the length, if it fits.
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
