//! What the leader works out before it begins a pass: its prediction, the targets or altitudes to try next.

use super::computation::{ADJUST, Computation};
use super::state::Action;
use super::task::LeaderTask;
use super::turning::Turning;
use crate::node::context::Context;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::local::HopEnd;
use crate::optimiser::pass::origins;
use crate::optimiser::plan::Planner;
use crate::optimiser::search::{Infeasible, Schedule, Search};
use crate::place::Placement;
use crate::settings::{Method, Settings};

/// Hops of the prediction in one call of `work`, 16 reaches each. In an uneven field a part of one.
const HOPS_AT_ONCE: u16 = 12;

/// The same in an even field, where a reach takes twice the work.
const FIELD_HOPS_AT_ONCE: u16 = 8;

impl Computation {
    /// Goes on with the leader's computation; whether the next pass can begin.
    pub(super) fn plan(&mut self, context: &Context<'_>) -> Result<bool, Infeasible> {
        if self.has_to_tell(context) || self.gathers(context) {
            return Ok(true);
        }
        if self.is_solving(context) {
            if let Some(target) = self.solve(context) {
                self.search_chosen(context, target)?;
                return Ok(true);
            }
            return Ok(false);
        }
        let (mission, profile) = (context.mission(), self.profile);
        match &mut self.task {
            LeaderTask::No => {
                self.begin_task(context)?;
                Ok(false)
            }
            LeaderTask::Predicting(planner) => {
                // The leader knows its own profile; of the others it can only assume what the mission has in common.
                let profile_of = |index| {
                    if index == context.index() {
                        profile
                    } else {
                        mission.config().common
                    }
                };
                let hops = match mission.field() {
                    None => HOPS_AT_ONCE,
                    Some(field) if field.is_constant() => FIELD_HOPS_AT_ONCE,
                    Some(_) => 1,
                };
                let ladder = match planner.step(mission, profile_of, hops) {
                    Ok(None) => return Ok(false),
                    Ok(Some(agreed)) => Some(agreed.ladder),
                    // The others may hold something else: let their answers decide.
                    Err(Infeasible) => None,
                };
                let last = context.settings().method == Method::Align;
                self.search_with(context, ladder, last)?;
                Ok(true)
            }
            _ => Ok(true),
        }
    }

    /// What the leader begins with: its prediction, if it may, or the search itself.
    #[inline(never)] // a planner is built here once; its stack is not for every call of `work`
    fn begin_task(&mut self, context: &Context<'_>) -> Result<(), Infeasible> {
        let Settings {
            predict, schedule, ..
        } = *context.settings();
        if predict && schedule == Schedule::Bracketed {
            let planner = Planner::new(context.mission(), self.profile, schedule)?;
            self.task.predict(planner);
            return Ok(());
        }
        self.search_by(
            context,
            schedule,
            None,
            context.settings().method == Method::Align,
            false,
        )
    }

    /// Goes over to trying targets, with `ladder` first if there is one.
    pub(super) fn search_with(
        &mut self,
        context: &Context<'_>,
        ladder: Option<Ladder>,
        last: bool,
    ) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, ladder, last, false)
    }

    /// The leader goes back to the places that the relays were given: nothing can be met at those chosen.
    pub(super) fn search_given(&mut self, context: &Context<'_>) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, None, true, true)
    }

    #[inline(never)]
    fn search_by(
        &mut self,
        context: &Context<'_>,
        schedule: Schedule,
        ladder: Option<Ladder>,
        last: bool,
        given: bool,
    ) -> Result<(), Infeasible> {
        let mut search = Search::new(context.mission(), self.profile, schedule)?;
        if let Some(ladder) = ladder {
            search.begin_with(ladder);
        }
        self.task.search(search, last, given);
        Ok(())
    }

    /// The leader begins the pass it has planned.
    pub(super) fn begin_pass(&mut self, context: &Context<'_>) -> Action {
        let mission = context.mission();
        if self.has_to_tell(context) {
            return self.begin_sense(context);
        }
        if self.gathers(context) {
            self.begin();
            return self.begin_gathering(context);
        }
        match &self.task {
            LeaderTask::Searching { search, given, .. } => {
                let ladder = *search.ladder();
                let chosen = context.joins() && self.chosen.is_some() && !given;
                self.begin();
                self.sweep_on(context, ladder, chosen, None, &origins(mission))
            }
            LeaderTask::Adjusting(rounds) if ADJUST => {
                let (turn, sir) = (rounds.turn(), rounds.sir);
                self.begin();
                let tx = HopEnd {
                    place: Placement::default(),
                    apart_m: 0.0,
                };
                self.take_turn(context, Turning::new(turn, sir, tx, mission.tx_gain()))
            }
            _ => Action::Work,
        }
    }

    pub(super) fn begin(&mut self) {
        self.state.begin();
        self.sweeps = self.sweeps.saturating_add(1);
    }
}
