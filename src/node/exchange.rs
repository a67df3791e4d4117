//! The state table of a pass and what comes back of it: one for every algorithm.
//!
//! Every algorithm is made of passes: the leader (relay 1, in a field relay N) begins one, each relay works out its share
//! and hands it *onward*, the last one knows what came of it, and that travels *back* through all of them.
//!
//! | phase | a new pass comes | the same pass again | what came of it comes | work is due |
//! | --- | --- | --- | --- | --- |
//! | `Idle` | share, hand on: `Waiting` | - | stale | - |
//! | `Planning` (leader) | - | - | stale | compute on; then begin a pass: `Waiting` |
//! | `Waiting` | share, hand on | say busy | agreement: take the place, hand back, `Holding`; else hand back, `Answered` | go on with the share, then hand on |
//! | `Answered` | share, hand on: `Waiting` | hand back again | stale | (leader) begin a pass: `Waiting` |
//! | `Holding` | share, hand on: `Waiting` | hand back again | stale | - |
//! | `Infeasible` (leader) | - | - | stale | - |
//!
//! The last relay knows what came of it by itself and skips `Waiting`, but for the time its share takes. The leader has
//! nobody to hand back to: without an agreement it has work to do. A pass whose number is just behind the current one is
//! stale wherever it comes. Only an agreement, or a turn of Algorithm 2, moves the setpoint: a relay holds its place
//! through everything else.

/// Where a relay is in the protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// No pass has come yet.
    Idle,
    /// The leader is computing what to begin with.
    Planning,
    /// A pass is under way onward.
    Waiting,
    /// What came of the last pass was no agreement.
    Answered,
    /// The chain has agreed; the relay holds its place.
    Holding,
    /// The leader has found that no target can be met.
    Infeasible,
}

/// What the node has to do now.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Next {
    /// Count a message of a pass that is over.
    Stale,
    /// Call `work` after a pause.
    Work {
        /// Whether the setpoint has moved.
        moved: bool,
    },
    /// Hand the pass onward, and again until something comes back.
    Forward {
        /// Whether the setpoint has moved.
        moved: bool,
    },
    /// Say back that the pass has arrived.
    Busy,
    /// Hand back again what came of it.
    Repeat,
    /// What came of the pass is known: hand it back.
    Answer {
        /// Whether the setpoint has moved.
        moved: bool,
        /// Whether the chain has agreed with it.
        agreed: bool,
    },
    /// No target can be met.
    Infeasible,
}

/// What a pass that has come in is to a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Arrival {
    New,
    Again,
    Straggler,
}

/// A pass that is this many numbers or fewer behind the current one is a straggler; farther off, its leader was rebooted.
const STRAGGLERS: u16 = 64;

/// Which pass is under way, and how far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exchange {
    pub(crate) phase: Phase,
    pub(crate) number: u16,
}

impl Exchange {
    /// What a pass of `number` is; `same` tells whether it is the current one in everything else.
    pub(crate) fn arrival(self, number: u16, same: bool) -> Arrival {
        let behind = self.number.wrapping_sub(number);
        match behind {
            _ if self.phase == Phase::Idle => Arrival::New,
            0 if same => Arrival::Again,
            1..=STRAGGLERS => Arrival::Straggler,
            _ => Arrival::New,
        }
    }

    /// What to do about a pass that has come again.
    pub(crate) fn again(self) -> Next {
        if self.phase == Phase::Waiting {
            Next::Busy
        } else {
            Next::Repeat
        }
    }

    /// Whether what came of pass `number` is awaited.
    pub(crate) fn awaits(self, number: u16) -> bool {
        self.phase == Phase::Waiting && number == self.number
    }

    /// Whether something can be handed back.
    pub(crate) fn is_answered(self) -> bool {
        matches!(self.phase, Phase::Answered | Phase::Holding)
    }
}
