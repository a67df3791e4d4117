//! What a solver is at.

use crate::optimiser::joint::starts::Seek;
use crate::place::Placement;

/// A pass forward.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForwardPass {
    /// Relays that are behind it.
    pub(super) done: u16,
    /// Where the last of them is, and where it was.
    pub(super) from: Placement,
    pub(super) old: Placement,
    pub(super) penalty: f32,
    /// The last place that the next relay may take, m.
    pub(super) end_m: f32,
    /// Whether a relay has to hold back.
    pub(super) holds_back: bool,
}

/// What is being worked out.
#[derive(Clone, Copy, Debug)]
pub(super) enum Work {
    /// The next start.
    Begin,
    /// The highest target of the chain as it is, and what for.
    Seek(Seek, Purpose),
    /// The chain as it is for one target, to be kept.
    Settle(f32, Purpose),
    /// Whether the relays of this segment, the last of which is to stand there, can hold back as a target is met.
    Stand(u8, f32, Seek, Purpose),
    /// The next move of a chain that meets this.
    Polish(f32),
    /// A pass back, at this segment.
    Back(u8),
    /// A pass forward with a part of the step and a target; to be kept if `true`.
    Forward(f32, f32, bool),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Purpose {
    /// A chain to begin with, of the shape of the start.
    Start,
    /// A higher target during an ascent.
    Raise,
    /// The slack where less of it counts.
    Tighten,
    /// What an ascent has come to.
    Judge,
    /// What that comes to by the rules of the sweep.
    Last,
    /// Whether the chain has all that can be had, by the same rules.
    Probe,
    /// Whether one relay's move gains something, by the same rules.
    Move,
}

impl Purpose {
    /// Whether relays go by the rules of the sweep.
    pub(super) const fn is_sweep(self) -> bool {
        matches!(self, Self::Last | Self::Probe | Self::Move)
    }
}
