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
    pub(crate) latest_view: u32,
    /// Digest and version of the held mission.
    #[serde(flatten, with = "fields::latest_mission")]
    pub(crate) latest_mission: (u16, u16),
    pub(crate) offer_number: u16,
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
            latest_view: ViewId::from_bits(self.latest_view),
            neighbour: self.neighbour,
            requests_reply: self.flag(0),
            requests_view: self.flag(1),
            fresh: self.flag(2),
            ready: self.flag(3),
            behind: self.behind,
            hears: self.hears,
            latest_mission: mission_id(self.latest_mission),
            offer_number: self.offer_number,
            active: self.flag(4),
            active_in_view: self.flag(5),
            refused: self.flag(6),
        })
    }
}

pub(super) fn mission_id((digest, version): (u16, u16)) -> MissionId {
    MissionId { version, digest }
}
