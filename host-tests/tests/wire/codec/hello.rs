//! Hello message.

use serde::Deserialize;
use uav_relay::ViewId;
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::message::{Hello, Message};

use super::bytes::{pass, words};
use super::limits::is_count;
use super::reader::Reader;

#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Greeting {
    pub(crate) mission: u16,
    pub(crate) neighbour: u16,
    pub(crate) behind: u16,
    pub(crate) newest: u32,
    /// Digest and version of the held mission.
    pub(crate) holds: (u16, u16),
    pub(crate) nonce: u16,
    pub(crate) hears: u8,
    pub(crate) flags: u8,
}

impl Greeting {
    pub(super) fn body(self) -> Vec<u8> {
        let mut out = pass(10, [self.mission, self.neighbour]);
        words(&mut out, &[self.behind]);
        out.extend(self.newest.to_le_bytes());
        words(&mut out, &[self.holds.0, self.holds.1, self.nonce]);
        out.extend([self.hears, self.flags]);
        out
    }

    pub(super) fn flag(self, bit: u8) -> bool {
        self.flags >> bit & 1 == 1
    }

    pub(super) fn message(self) -> Message {
        Message::Hello(Hello {
            mission: self.mission,
            newest: ViewId::from_bits(self.newest),
            neighbour: self.neighbour,
            ask: self.flag(0),
            form: self.flag(1),
            fresh: self.flag(2),
            ready: self.flag(3),
            behind: self.behind,
            hears: self.hears,
            holds: mission_id(self.holds),
            nonce: self.nonce,
            flies: self.flag(4),
            whole: self.flag(5),
            refused: self.flag(6),
        })
    }

    pub(super) fn in_range(self) -> bool {
        self.neighbour <= 1000 && is_count(self.behind) && self.hears <= 15 && self.flags <= 127
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            mission: rest.word()?,
            neighbour: rest.word()?,
            behind: rest.word()?,
            newest: rest.long()?,
            holds: (rest.word()?, rest.word()?),
            nonce: rest.word()?,
            hears: rest.byte()?,
            flags: rest.byte()?,
        })
    }
}

pub(super) fn mission_id((digest, version): (u16, u16)) -> MissionId {
    MissionId { version, digest }
}
