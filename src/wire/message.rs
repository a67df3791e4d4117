//! What neighbours say to each other. `body` has how they say it, `FORMAT.md` the byte tables.

use crate::mission::Profile;
use crate::placement::PerTarget;
use crate::placement::coded::{PLACES, WIDTH};
use crate::placement::ladder::Ladder;
use crate::placement::levels::Levels;
use crate::placement::local::Local;
use crate::placement::verdict::Verdict;
use crate::placement::wave::{Choice, Rungs};
use crate::sir::Placement;

/// The longest body: a wave with a place for every pair of a target and a level, or a sweep with what was measured.
pub const MAX_BODY: usize = if cfg!(feature = "altitude") {
    29 + WIDTH * PLACES
} else {
    88
};

/// One message between neighbours. *Onward* is the way a pass goes: toward Rx, or toward Tx in a field.
#[derive(Clone, PartialEq, Debug)]
pub enum Message<'a> {
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
    /// Onward: targets, altitude levels, and how far the sender reaches for each pair.
    Wave(Wave<'a>),
    /// Back: which of them were chosen.
    Trace(Trace),
    /// Onward: whose turn it is to move.
    Token(Token),
    /// Back: who has moved where.
    Moved(Moved),
}

impl Message<'_> {
    /// The digest of the sender's mission; a [`Message::Busy`] bears none.
    pub const fn mission(&self) -> Option<u16> {
        match self {
            Self::Sweep(sweep) => Some(sweep.mission),
            Self::Verdict(answer) => Some(answer.mission),
            Self::Busy { .. } => None,
            Self::Heartbeat { mission, .. } => Some(*mission),
            Self::Wave(wave) => Some(wave.mission),
            Self::Trace(trace) => Some(trace.mission),
            Self::Token(token) => Some(token.mission),
            Self::Moved(moved) => Some(moved.mission),
        }
    }

    /// Whether it is a pass, which goes onward.
    pub const fn is_onward(&self) -> bool {
        matches!(self, Self::Sweep(_) | Self::Wave(_) | Self::Token(_))
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
    /// What the sender holds.
    pub profile: Profile,
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
}

/// One pass of targets and altitude levels.
#[derive(Clone, PartialEq, Debug)]
pub struct Wave<'a> {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// The targets.
    pub rungs: Rungs,
    /// The sender's levels.
    pub levels: Levels,
    /// The sender's transmit power, W.
    pub power_w: f32,
    /// The sender's place for each pair, target by target, as in [`crate::placement::coded`].
    pub reaches: &'a [u8],
}

/// What was chosen of a wave, as it travels back.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Trace {
    /// Number of the pass.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// The target, and the level that the receiver takes for it; `None` if no target was met.
    pub choice: Option<Choice>,
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
