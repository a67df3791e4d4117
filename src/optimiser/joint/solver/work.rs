//! Current work of a solver.

use crate::optimiser::joint::starts::Seek;
use crate::place::Placement;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForwardPass {
    /// Relays that the pass has completed.
    pub(super) done: u16,
    /// New and previous position of the last of them.
    pub(super) from: Placement,
    pub(super) old: Placement,
    pub(super) penalty: f32,
    pub(super) end_m: f32,
    pub(super) holds_back: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Work {
    /// Begin the next start.
    Begin,
    /// Search for the highest feasible target of the unchanged chain.
    Seek(Seek, Purpose),
    /// Compute the chain for one target, and store it.
    Settle(f32, Purpose),
    /// Check that relays can hold back: segment, required x of its last relay, m, and the search.
    Stand(u8, f32, Seek, Purpose),
    /// Try the next move of the polish; the chain meets this target.
    Polish(f32),
    /// Backward pass at this segment.
    Back(u8),
    /// Forward pass with a fraction of the step and a target; stored if `true`.
    Forward(f32, f32, bool),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Purpose {
    /// Initial chain with the shape of the start.
    Start,
    /// Higher target during an ascent.
    Raise,
    /// Slack after its limit has been reduced.
    Tighten,
    /// Result of an ascent.
    Judge,
    /// Result of an ascent by the sweep's rules.
    Last,
    /// Check of the ceiling, by the sweep's rules.
    Probe,
    /// Check of one relay's move, by the sweep's rules.
    Move,
}

impl Purpose {
    /// Returns true if the pass uses the sweep's rules.
    pub(super) const fn is_sweep(self) -> bool {
        matches!(self, Self::Last | Self::Probe | Self::Move)
    }
}
