//! What neighbours say to each other. `body` has how they say it, `FORMAT.md` the byte tables.

use super::digest::MissionId;
#[cfg(feature = "upload")]
use super::upload::Upload;
use crate::guard::Fence;
use crate::optimiser::PerTarget;
use crate::optimiser::joint::Outlook;
use crate::optimiser::joint::trial::{Bar, Trials};
use crate::optimiser::ladder::Ladder;
use crate::optimiser::local::Local;
use crate::optimiser::verdict::Verdict;
use crate::place::{Placement, Station};

/// The longest body: a sweep of sixteen targets with what was measured, or from aside of the line.
pub const MAX_BODY: usize = 88;

/// One message between neighbours. *Onward* is the way a pass goes: toward Rx, or toward Tx in a field.
#[derive(Clone, PartialEq, Debug)]
pub enum Message {
    /// Onward: targets, and how far the sender reaches for each.
    Sweep(Sweep),
    /// Back: what became of them. It acknowledges the sweep of the same number.
    Verdict(Answer),
    /// Back: the pass of this number has arrived, what became of it is not known yet. Sent for a repeated one only.
    Busy {
        /// The number of the pass.
        sweep: u16,
    },
    /// Either way: a sign of life from a link that would be silent otherwise.
    Heartbeat {
        /// The sender's mission digest, so that a wrong configuration shows before take-off.
        mission: u16,
        /// Whether the sender asks for a heartbeat in return.
        answer: bool,
    },
    /// Onward: where the sender would be in each of a few trials.
    Course(Course),
    /// Back: which of them is gone by, and what the rest of the chain is worth about it.
    Worth(Worth),
    /// Onward: whose turn it is to move.
    Token(Token),
    /// Back: who has moved where.
    Moved(Moved),
    /// Either way, also to nodes that are no neighbours: who the sender takes for its neighbour, and which view it holds.
    Hello(Hello),
    /// Onward: a new view of the chain is proposed; it counts who is there.
    Proposal(Proposal),
    /// Back: what was decided on the proposal, and how many relays there are.
    Decision(Decision),
    /// Either way: the fence between two neighbours.
    Fence {
        /// [`super::digest::digest`] of the sender's mission, as it was loaded.
        mission: u16,
        /// What the sender says of it.
        fence: Fence,
    },
    /// Either way, also from the ground: a mission that is newer than the one that the receiver holds.
    #[cfg(feature = "upload")]
    Offer(Upload),
}

impl Message {
    /// The digest of the sender's mission; a [`Message::Busy`] bears none.
    pub const fn mission(&self) -> Option<u16> {
        match self {
            Self::Sweep(sweep) => Some(sweep.mission),
            Self::Verdict(answer) => Some(answer.mission),
            Self::Busy { .. } => None,
            Self::Heartbeat { mission, .. } | Self::Fence { mission, .. } => Some(*mission),
            Self::Course(course) => Some(course.mission),
            Self::Worth(worth) => Some(worth.mission),
            Self::Token(token) => Some(token.mission),
            Self::Moved(moved) => Some(moved.mission),
            Self::Hello(hello) => Some(hello.mission),
            Self::Proposal(proposal) => Some(proposal.mission_id.digest),
            Self::Decision(count) => Some(count.mission_id.digest),
            #[cfg(feature = "upload")]
            Self::Offer(upload) => Some(upload.base()),
        }
    }

    /// Whether it is said of a pass that places come of: then its digest is that of a view of the chain.
    pub(crate) const fn is_of_a_view(&self) -> bool {
        matches!(
            self,
            Self::Sweep(_)
                | Self::Verdict(_)
                | Self::Course(_)
                | Self::Worth(_)
                | Self::Token(_)
                | Self::Moved(_)
        )
    }

    /// Whether it is part of a view change: then its digest is that of the mission to be flown in it.
    pub(crate) const fn is_of_a_call(&self) -> bool {
        matches!(self, Self::Proposal(_) | Self::Decision(_))
    }

    /// Whether it is a pass, which goes onward.
    pub const fn is_onward(&self) -> bool {
        matches!(
            self,
            Self::Sweep(_) | Self::Course(_) | Self::Token(_) | Self::Proposal(_)
        )
    }
}

/// One pass of targets along the chain, as one relay hands it to the next.
#[derive(Clone, PartialEq, Debug)]
pub struct Sweep {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// The targets.
    pub ladder: Ladder,
    /// Where the sender flies across the line, and its power.
    pub relay: Station,
    /// Whether relays are to be where the joint method has each of them across the line, and not where they were given.
    pub chosen: bool,
    /// Upsilon as the sender measures it where it stands, 1/W, in a closed loop.
    pub measured_per_w: Option<f32>,
    /// The sender's place for each target, m along x; shorter than the ladder where the upper targets cannot be met.
    pub reaches: PerTarget,
}

/// The verdict on one sweep, as it travels back.
#[derive(Clone, PartialEq, Debug)]
pub struct Answer {
    /// Number of the sweep.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// What became of the targets.
    pub verdict: Verdict,
    /// Where the receiver is to stand when a target is committed, m along x; `None` for its own reach.
    pub stand: Option<f32>,
    /// Whether the sender or a relay after it differs from what the mission says of all.
    pub own: bool,
}

/// One pass of the joint method: a few trials of a target and of a step by every relay.
#[derive(Clone, PartialEq, Debug)]
pub struct Course {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// The sender's transmit power, W.
    pub power_w: f32,
    /// By what they are judged.
    pub bar: Bar,
    /// A few trials, and where the sender is in each of them.
    pub trials: Trials,
}

/// What came of a course, as it travels back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Worth {
    /// Number of the pass.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// The trial that is gone by; `None` if none got through.
    pub trial: Option<u8>,
    /// Its slack, m.
    pub slack_m: f32,
    /// What the rest of the chain is worth about where the receiver is in it, or in the last one before.
    pub outlook: Outlook,
}

/// One turn of Algorithm 2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Token {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// Where the sender stands now.
    pub place: Placement,
    /// The sender's transmit power, W.
    pub power_w: f32,
    /// What this pass is for.
    pub turn: Turn,
    /// SIR of the chain before this pass, linear; 0 before it is known.
    pub sir: f32,
}

/// What a relay does when the token comes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Turn {
    /// It stays, and hears where its neighbours are.
    Look,
    /// It moves if that is better.
    Move {
        /// How far up or down it may, m: the paper's `epsilon_h`.
        explore_m: f32,
        /// How it looks for a better place.
        local: Local,
    },
    /// It stays for good.
    Stop,
}

/// What a turn came to, as it travels back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moved {
    /// Number of the pass.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// Where the sender stands now.
    pub place: Placement,
    /// Whether it or any relay after it has moved.
    pub any: bool,
    /// SIR of the worst hop after the sender, linear.
    pub worst: f32,
}

/// What one node tells another about the chain as it sees it.
#[expect(
    clippy::struct_excessive_bools,
    reason = "five flags of the wire format"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`super::digest::digest`] of the sender's mission, as it was loaded.
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

/// A proposal of a new view, as one relay hands it to the next.
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

/// A view of the chain that a new one follows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PriorView {
    /// Its number; 0 is the chain as the mission has it.
    pub view: u16,
    /// How many relays were in it, 1 to 1000.
    pub relays: u16,
    /// Whether its leader is among those that the proposal has come through.
    pub leader: bool,
}

/// The decision on a proposal, as it travels back.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decision {
    /// The mission that the view flies.
    pub mission_id: MissionId,
    /// The number of the view.
    pub view: u16,
    /// The sender's place, from 1 at the one that has proposed: 1 to 1000.
    pub place: u16,
    /// How many relays there are, 1 to 1000; `None` if they are too few to go on without the others.
    pub relays: Option<u16>,
}

/// Why a body is no message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MessageError {
    /// Not the one encoding of any message, or bytes are left over.
    Encoding,
    /// A number is not finite or outside its range.
    Value,
}

impl core::fmt::Display for MessageError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Encoding => "the body is not a message",
            Self::Value => "a number in the message is outside its range",
        })
    }
}

impl core::error::Error for MessageError {}
