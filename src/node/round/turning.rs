//! Algorithm 2 on board: a token goes from relay to relay; whoever has it looks for a better place and tells both neighbours.
//!
//! The token brings the place of the relay before, what comes back brings that of the relay after: the first pass is for
//! looking alone. On the way back the worst SIR is gathered, so that the leader knows that of the chain after every round.

use core::task::Poll;

use crate::mission::{Interferer, Mission};
use crate::optimiser::local::{HopEnd, Hops, LocalSearch};
use crate::place::Placement;
use crate::power_ratio::PowerRatio;
use crate::wire::message::AdjustStep;

/// A token, as one relay sees it.
#[derive(Clone, Debug)]
pub(crate) struct Turning {
    /// What this pass is for, and the SIR of the chain before it.
    pub(crate) turn: AdjustStep,
    pub(crate) sir: f32,
    /// The node before this relay, and what its power is worth.
    pub(crate) before: HopEnd,
    pub(crate) gain_in: PowerRatio,
    search: Option<LocalSearch>,
    /// Whether this relay or one after it has moved; the worst SIR from here on.
    pub(crate) any: bool,
    pub(crate) worst: f32,
}

impl Turning {
    pub(crate) const fn new(
        turn: AdjustStep,
        sir: f32,
        before: HopEnd,
        gain_in: PowerRatio,
    ) -> Self {
        Self {
            turn,
            sir,
            before,
            gain_in,
            search: None,
            any: false,
            worst: f32::MAX,
        }
    }

    /// The hops of a relay of `power_w` watts, with its neighbour toward Rx at `after`; `None` for relay N.
    pub(crate) fn hops(
        &self,
        mission: &Mission,
        interferer: &Interferer,
        power_w: f32,
        after: Option<Placement>,
    ) -> Hops {
        let after = after.map(|place| HopEnd {
            place,
            apart_m: mission.config().min_separation_m,
        });
        Hops::new(
            mission,
            interferer,
            self.before,
            self.gain_in,
            power_w,
            after,
        )
    }

    /// Begins to look for a better place than `at`, within `band`, m; whether this turn is one to move.
    pub(crate) fn begin(&mut self, hops: Hops, at: Placement, band: (f32, f32)) -> bool {
        if let AdjustStep::Move { explore_m, local } = self.turn {
            self.search = Some(LocalSearch::new(local, hops, at, explore_m, band));
        }
        self.search.is_some()
    }

    /// Looks on, for at most `budget` evaluations and a row: ready when it is over, with the better place.
    pub(crate) fn step(&mut self, budget: u16) -> Poll<Option<Placement>> {
        let Some(search) = &mut self.search else {
            return Poll::Ready(None);
        };
        let Poll::Ready(found) = search.step(budget) else {
            return Poll::Pending;
        };
        self.search = None;
        self.any |= found.is_some();
        Poll::Ready(found)
    }

    /// Whether the search is still on.
    pub(crate) const fn is_searching(&self) -> bool {
        self.search.is_some()
    }
}
