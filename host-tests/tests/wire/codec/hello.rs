//! Hello message.

use serde::{Deserialize, Serialize};
use uav_relay::ViewId;
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::message::{Hello, Message};

use super::fields;

#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct Greeting {
    pub(crate) mission: u16,
    pub(crate) neighbour: u16,
    pub(crate) behind: u16,
    #[serde(rename = "newest_view")]
    pub(crate) newest: u32,
    /// Digest and version of the held mission.
    #[serde(flatten, with = "fields::holds")]
    pub(crate) holds: (u16, u16),
    #[serde(rename = "offer_number")]
    pub(crate) nonce: u16,
    pub(crate) hears: u8,
    pub(crate) flags: u8,
}

impl Greeting {
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
}

pub(super) fn mission_id((digest, version): (u16, u16)) -> MissionId {
    MissionId { version, digest }
}
