//! What the leader works out before it begins a pass: its prediction, the targets or altitudes to try next.

use core::task::Poll;

use super::super::adjust::Turning;
use super::super::exchange::Next;
use super::super::lead::Lead;
use super::super::settings::Method;
use super::{ADJUST, ALTITUDE, LEVELS_AT_ONCE, Own, Pass, Share};
use crate::placement::climb::{Attempt, Climb};
use crate::placement::coarse::Coarse;
use crate::placement::ladder::Ladder;
use crate::placement::local::Beside;
use crate::placement::pass::origins;
use crate::placement::search::{Infeasible, Schedule, Search};
use crate::sir::Placement;

/// Hops of the prediction in one call of `work`: 16 reaches each.
const HOPS_AT_ONCE: u16 = 16;

/// The same in a field, where a reach takes twice the work.
const FIELD_HOPS_AT_ONCE: u16 = 8;

impl Share {
    /// Goes on with the leader's computation; whether the next pass can begin.
    pub(super) fn plan(&mut self, own: Own<'_>) -> Result<bool, Infeasible> {
        let (mission, profile) = (own.mission, self.profile);
        match &mut self.lead {
            Lead::No => {
                self.begin_lead(own)?;
                Ok(false)
            }
            Lead::Predicting(planner) => {
                // The leader knows its own profile; of the others it can only assume what the mission has in common.
                let profile_of = |index| {
                    if index == own.index {
                        profile
                    } else {
                        mission.config().common
                    }
                };
                let hops = match mission.field() {
                    None => HOPS_AT_ONCE,
                    Some(_) => FIELD_HOPS_AT_ONCE,
                };
                let ladder = match planner.step(mission, profile_of, hops) {
                    Ok(None) => return Ok(false),
                    Ok(Some(agreed)) => Some(agreed.ladder),
                    // The others may hold something else: let their answers decide.
                    Err(Infeasible) => None,
                };
                let last = own.settings.method == Method::Align;
                self.search_with(own, ladder, last)?;
                Ok(true)
            }
            Lead::Surveying(coarse) if ALTITUDE => {
                let Some(interferer) = mission.interferer() else {
                    return Err(Infeasible);
                };
                let found =
                    coarse.step(mission, interferer, profile, &mut self.wave, LEVELS_AT_ONCE);
                if let Poll::Ready(predicted) = found {
                    self.climb(own, predicted);
                }
                Ok(false)
            }
            Lead::Climbing(climb) if ALTITUDE && climb.is_vain() => {
                // Nothing better than what Algorithm 1 gave: agree on that once more.
                let target = climb.target();
                self.search_with(own, Some(Ladder::single(target)), true)?;
                Ok(true)
            }
            _ => Ok(true),
        }
    }

    #[inline(never)] // a planner is built here once; its stack is not for every call of `work`
    fn begin_lead(&mut self, own: Own<'_>) -> Result<(), Infeasible> {
        self.lead = Lead::begin(own.mission, self.profile, own.settings)?;
        if let Lead::Searching { search, .. } = &mut self.lead
            && own.measured_per_w.is_some()
        {
            search.take_as_even();
        }
        Ok(())
    }

    /// Goes over to trying targets, with `ladder` first if there is one.
    #[inline(never)]
    pub(super) fn search_with(
        &mut self,
        own: Own<'_>,
        ladder: Option<Ladder>,
        last: bool,
    ) -> Result<(), Infeasible> {
        let mut search = Search::new(own.mission, self.profile, Schedule::Bracketed)?;
        if own.measured_per_w.is_some() {
            search.take_as_even();
        }
        if let Some(ladder) = ladder {
            search.begin_with(ladder);
        }
        self.lead = Lead::Searching { search, last };
        Ok(())
    }

    #[inline(never)]
    pub(super) fn climb(&mut self, own: Own<'_>, predicted: Option<(f32, u8)>) {
        let target = self.target.unwrap_or(1.0);
        let tolerance = own.mission.config().tolerance;
        self.lead = Lead::Climbing(Climb::new(target, tolerance, predicted));
    }

    #[inline(never)]
    pub(super) fn survey(&mut self, own: Own<'_>, target: f32) {
        let coarse = Coarse::new(own.mission, target, &mut self.wave);
        self.lead = Lead::Surveying(coarse);
    }

    /// The leader begins the pass it has planned.
    pub(super) fn begin_pass(&mut self, own: Own<'_>) -> Next {
        let mission = own.mission;
        match &self.lead {
            Lead::Searching { search, .. } => {
                let ladder = *search.ladder();
                self.begin();
                self.sweep_on(own, ladder, None, &origins(mission))
            }
            Lead::Climbing(climb) if ALTITUDE => {
                let Attempt { rungs, levels } = climb.attempt();
                self.begin();
                let levels = self.levels(own, levels);
                self.wave.begin(mission, rungs, levels);
                self.pass = Pass::Wave;
                self.go_on_with_wave(own)
            }
            Lead::Adjusting(rounds) if ADJUST => {
                let (turn, sir) = (rounds.turn(), rounds.sir);
                self.begin();
                let tx = Beside {
                    place: Placement::default(),
                    apart_m: 0.0,
                };
                self.take_turn(own, Turning::new(turn, sir, tx, mission.tx_gain()))
            }
            _ => Next::Work { moved: false },
        }
    }

    fn begin(&mut self) {
        self.exchange.begin();
        self.sweeps = self.sweeps.saturating_add(1);
    }
}
