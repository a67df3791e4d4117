//! A relay's own solution of the chain by the joint method: where it is to be.

use core::task::Poll;

use super::computation::{Chosen, Computation};
use super::state::Action;
use super::task::{ChainSolver, LeaderTask};
use crate::mission::Mission;
use crate::node::context::Context;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Link;
use crate::optimiser::search::Infeasible;

impl Computation {
    /// Whether it has still to find out where it is to be.
    pub(super) fn is_solving(&self, context: &Context<'_>) -> bool {
        let partial = self.seats.is_partial(context.mission().relays());
        context.joins() && self.chosen.is_none() && !partial
    }

    /// Goes on with the chain's solution while there is nothing else to do.
    pub(super) fn think(&mut self, context: &Context<'_>) -> Action {
        if self.is_solving(context) {
            _ = self.solve(context);
            return Action::Think;
        }
        Action::Nothing
    }

    /// What this relay is on a sweep.
    pub(super) fn link<'a>(&self, context: &Context<'a>, chosen: bool) -> Link<'a> {
        let there = self.chosen.filter(|_| chosen);
        Link {
            mission: context.mission(),
            behind: None,
            index: context.index(),
            own: self.station_for(chosen),
            measured_per_w: self.meter.published(),
            plain: chosen && there.is_none_or(|there| there.plain),
            end_m: there.map(|there| there.end_m),
        }
    }

    /// Solves some more of the chain, of relays that bring along what is known; the target, linear SIR, once this relay knows where it is
    /// to be.
    ///
    /// Where that is not to be had, it stays where it was given to be, and the target says nothing.
    #[inline(never)]
    pub(super) fn solve(&mut self, context: &Context<'_>) -> Option<f32> {
        let mission = context.mission();
        if !matches!(self.task, LeaderTask::Solving(_)) && !self.begin_solving(mission) {
            self.choose_given(context);
            return Some(0.0);
        }
        let LeaderTask::Solving(chain) = &mut self.task else {
            return None;
        };
        let seats = &self.seats;
        let seat_of = |index| seats.of(mission, index);
        let Poll::Ready(solved) = chain.step(mission, seat_of) else {
            return None;
        };
        let index = context.index();
        let target = if let Ok(target) = solved {
            let end_m = chain.end_m(mission, &seat_of, index);
            let (at, plain) = (chain.at(index, seat_of(index)), !chain.holds_back());
            // Before it has been asked, the others do not know what it holds.
            let at = self.seat(context).room.nearest(at);
            self.chosen = Some(Chosen { at, end_m, plain });
            target
        } else {
            self.choose_given(context);
            0.0
        };
        self.task.rest();
        Some(target)
    }

    /// Whether the chain can be solved.
    #[inline(never)] // a solver is built here once
    fn begin_solving(&mut self, mission: &Mission) -> bool {
        let Some(chain) = ChainSolver::new(mission) else {
            return false;
        };
        self.task.solve(chain);
        true
    }

    fn choose_given(&mut self, context: &Context<'_>) {
        self.chosen = Some(Chosen {
            at: self.seat(context).room.nearest(self.profile.on_line().at),
            end_m: context.mission().end_for(context.index(), 0.0),
            plain: true,
        });
    }

    /// The leader goes over to sweeps at the places chosen, about `target` if that is known.
    pub(super) fn search_chosen(
        &mut self,
        context: &Context<'_>,
        target: f32,
    ) -> Result<(), Infeasible> {
        let ladder = (target > 0.0 && context.settings().predict).then(|| {
            let gap = context.mission().config().tolerance / 4.0;
            Ladder::around(target * 1.000_001, gap, target * 0.5, target * 2.0)
        });
        self.search_with(context, ladder, false)
    }
}
