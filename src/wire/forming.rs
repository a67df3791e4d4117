//! The wire form of the messages by which a chain is formed: a view's number, four numbers and a byte of flags.

use serde::{Deserialize, Serialize};

use super::body::Pass;
use super::digest::MissionId;
use super::message::{Decision, Hello, PriorView, Proposal};
use crate::mission::MAX_RELAYS;

/// What a hello, a proposal and a decision have in common; what the numbers mean depends, and those that mean nothing are 0.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Forming {
    /// The number is that of a view.
    pass: Pass,
    one: [u8; 2],
    other: [u8; 2],
    more: [u8; 2],
    version: [u8; 2],
    flags: u8,
}

impl Forming {
    const fn new(pass: Pass, numbers: [u16; 4], flags: u8) -> Self {
        let [one, other, more, version] = numbers;
        Self {
            pass,
            one: one.to_le_bytes(),
            other: other.to_le_bytes(),
            more: more.to_le_bytes(),
            version: version.to_le_bytes(),
            flags,
        }
    }

    /// The numbers, of which the first two are of relays, the third one of a view or a digest, and the flags.
    fn parts(self) -> Option<(u16, u16, u16, u8)> {
        let one = u16::from_le_bytes(self.one);
        let other = u16::from_le_bytes(self.other);
        let more = u16::from_le_bytes(self.more);
        (one <= MAX_RELAYS && other <= MAX_RELAYS).then_some((one, other, more, self.flags))
    }

    const fn mission_id(self, digest: u16) -> MissionId {
        MissionId {
            version: u16::from_le_bytes(self.version),
            digest,
        }
    }

    /// The neighbour; digest and version of what it holds; flags from bit 0: asks for a hello, asks for a new view, fresh, ready,
    /// flies what it holds.
    pub(super) fn of_hello(hello: &Hello) -> Self {
        let flags = [hello.ask, hello.form, hello.fresh, hello.ready, hello.flies]
            .into_iter()
            .rev()
            .fold(0, |flags, flag| flags << 1 | u8::from(flag));
        Self::new(
            Pass::new(hello.newest, hello.mission),
            [hello.neighbour, 0, hello.holds.digest, hello.holds.version],
            flags,
        )
    }

    pub(super) fn hello(self) -> Option<Hello> {
        let (neighbour, 0, held, flags @ 0..=0x1F) = self.parts()? else {
            return None;
        };
        Some(Hello {
            mission: self.pass.mission(),
            newest: self.pass.number(),
            neighbour,
            ask: flags & 1 != 0,
            form: flags & 2 != 0,
            fresh: flags & 4 != 0,
            ready: flags & 8 != 0,
            flies: flags & 16 != 0,
            holds: self.mission_id(held),
        })
    }

    /// The sender's place; size and number of the view before; version of the mission; whether its leader is there.
    pub(super) fn of_proposal(proposal: &Proposal) -> Self {
        let before = proposal.before;
        Self::new(
            Pass::new(proposal.view, proposal.mission_id.digest),
            [
                proposal.place,
                before.relays,
                before.view,
                proposal.mission_id.version,
            ],
            u8::from(before.leader),
        )
    }

    pub(super) fn proposal(self) -> Option<Proposal> {
        let (place @ 1.., relays @ 1.., view, leader @ 0..=1) = self.parts()? else {
            return None;
        };
        Some(Proposal {
            mission_id: self.mission_id(self.pass.mission()),
            view: self.pass.number(),
            place,
            before: PriorView {
                view,
                relays,
                leader: leader == 1,
            },
        })
    }

    /// The sender's place; how many relays, 0 for too few; version of the mission.
    pub(super) fn of_decision(count: &Decision) -> Self {
        Self::new(
            Pass::new(count.view, count.mission_id.digest),
            [
                count.place,
                count.relays.unwrap_or(0),
                0,
                count.mission_id.version,
            ],
            0,
        )
    }

    pub(super) fn count(self) -> Option<Decision> {
        let (place @ 1.., relays, 0, 0) = self.parts()? else {
            return None;
        };
        Some(Decision {
            mission_id: self.mission_id(self.pass.mission()),
            view: self.pass.number(),
            place,
            relays: (relays > 0).then_some(relays),
        })
    }
}
