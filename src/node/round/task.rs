//! What the leader has beyond every other relay: which pass comes next.

use crate::optimiser::joint::{MOST_SOLVED, Solver};
use crate::optimiser::plan::Planner;
use crate::optimiser::search::Search;
use crate::settings::Adjust;
use crate::wire::message::AdjustStep;

/// A chain being solved by the joint method.
pub(crate) type ChainSolver = Solver<MOST_SOLVED, { MOST_SOLVED / 10 }>;

/// What the leader is at.
#[cfg_attr(
    feature = "altitude",
    expect(
        clippy::large_enum_variant,
        reason = "there is one of it, and nothing allocates"
    )
)]
#[derive(Clone, Debug)]
pub(crate) enum LeaderTask {
    /// Not the leader, or nothing begun yet, or all done.
    No,
    /// Solving the chain from the mission.
    Predicting(Planner),
    /// The same by the joint method: every relay does that, not the leader alone.
    Solving(ChainSolver),
    /// Trying targets at the altitudes held; whether the chain settles with what is agreed.
    Searching {
        search: Search,
        /// Nothing comes after it.
        last: bool,
        /// Of the places that the relays were given, though others were chosen.
        given: bool,
    },
    /// Algorithm 2.
    Adjusting(Rounds),
}

/// Where Algorithm 2 is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounds {
    adjust: Adjust,
    /// Rounds that are over; the first pass, which only looks, is not one.
    done: u16,
    turn: AdjustStep,
    /// SIR of the chain after the last round.
    pub(crate) sir: f32,
}

impl Rounds {
    pub(crate) const fn new(adjust: Adjust) -> Self {
        Self {
            adjust,
            done: 0,
            turn: AdjustStep::Look,
            sir: 0.0,
        }
    }

    /// What the next pass is for.
    pub(crate) const fn turn(&self) -> AdjustStep {
        self.turn
    }

    /// How many rounds are over.
    pub(crate) const fn done(&self) -> u16 {
        self.done
    }

    /// Takes what came of a pass; whether that was the last one.
    pub(crate) fn advance(&mut self, any: bool, sir: f32) -> bool {
        self.sir = sir;
        let idle = match self.turn {
            AdjustStep::Stop => return true,
            AdjustStep::Look => false,
            AdjustStep::Move { .. } => {
                self.done = self.done.saturating_add(1);
                !any
            }
        };
        self.turn = if idle || self.done >= self.adjust.rounds {
            AdjustStep::Stop
        } else {
            AdjustStep::Move {
                explore_m: self.adjust.explore_m,
                local: self.adjust.local,
            }
        };
        false
    }
}

impl LeaderTask {
    /// Nothing is left to do.
    pub(crate) fn rest(&mut self) {
        *self = Self::No;
    }

    /// Solves the chain from the mission.
    pub(crate) fn predict(&mut self, planner: Planner) {
        *self = Self::Predicting(planner);
    }

    /// The same by the joint method.
    pub(crate) fn solve(&mut self, chain: ChainSolver) {
        *self = Self::Solving(chain);
    }

    /// Tries targets: the `last` thing to do, and of the places `given`, or not.
    pub(crate) fn search(&mut self, search: Search, last: bool, given: bool) {
        *self = Self::Searching {
            search,
            last,
            given,
        };
    }

    /// Begins Algorithm 2.
    pub(crate) fn adjust(&mut self, adjust: Adjust) {
        *self = Self::Adjusting(Rounds::new(adjust));
    }
}
