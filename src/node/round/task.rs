//! What the leader has beyond every other relay: which pass comes next.

use crate::mission::{Mission, Profile};
use crate::optimiser::joint::Solver;
use crate::optimiser::joint::ascent::Ascent;
use crate::optimiser::plan::Planner;
use crate::optimiser::search::{Infeasible, Schedule, Search};
use crate::settings::{Adjust, Method, Settings};
use crate::wire::message::AdjustStep as Turn;

/// The most relays whose chain is solved in one relay, without a message; longer ones are solved by messages.
pub(crate) const MOST_SOLVED: usize = if cfg!(feature = "altitude") { 100 } else { 0 };

/// A chain being solved by the joint method.
pub(crate) type Chain = Solver<MOST_SOLVED, { MOST_SOLVED / 10 }>;

/// What the leader is at.
#[cfg_attr(
    feature = "altitude",
    expect(
        clippy::large_enum_variant,
        reason = "there is one of it, and nothing allocates"
    )
)]
#[derive(Clone, Debug)]
pub(crate) enum Lead {
    /// Not the leader, or nothing begun yet, or all done.
    No,
    /// Solving the chain from the mission.
    Predicting(Planner),
    /// The same by the joint method: every relay does that, not the leader alone.
    Solving(Chain),
    /// The joint method by messages.
    Ascending(Ascent),
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
    turn: Turn,
    /// SIR of the chain after the last round.
    pub(crate) sir: f32,
}

impl Rounds {
    pub(crate) const fn new(adjust: Adjust) -> Self {
        Self {
            adjust,
            done: 0,
            turn: Turn::Look,
            sir: 0.0,
        }
    }

    /// What the next pass is for.
    pub(crate) const fn turn(&self) -> Turn {
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
            Turn::Stop => return true,
            Turn::Look => false,
            Turn::Move { .. } => {
                self.done = self.done.saturating_add(1);
                !any
            }
        };
        self.turn = if idle || self.done >= self.adjust.rounds {
            Turn::Stop
        } else {
            Turn::Move {
                explore_m: self.adjust.explore_m,
                local: self.adjust.local,
            }
        };
        false
    }
}

impl Lead {
    /// What the leader begins with: its prediction, if it may, or the search itself.
    pub(crate) fn begin(
        mission: &Mission,
        profile: Profile,
        settings: &Settings,
    ) -> Result<Self, Infeasible> {
        if settings.predict && settings.schedule == Schedule::Bracketed {
            Planner::new(mission, profile, settings.schedule).map(Self::Predicting)
        } else {
            let last = settings.method == Method::Align;
            Search::new(mission, profile, settings.schedule).map(|search| Self::Searching {
                search,
                last,
                given: false,
            })
        }
    }
}
