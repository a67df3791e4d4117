//! What the leader works out before it begins a pass: its prediction, the targets or altitudes to try next.

use super::core::{ADJUST, ALTITUDE, Own, Share};
use super::state::Next;
use super::task::Lead;
use super::turning::Turning;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::local::HopEnd as Beside;
use crate::optimiser::pass::origins;
use crate::optimiser::search::{Infeasible, Schedule, Search};
use crate::place::Placement;
use crate::settings::Method;

/// Hops of the prediction in one call of `work`: 16 reaches each. In an uneven field a part of one.
const HOPS_AT_ONCE: u16 = 16;

/// The same in an even field, where a reach takes twice the work.
const FIELD_HOPS_AT_ONCE: u16 = 8;

impl Share {
    /// Goes on with the leader's computation; whether the next pass can begin.
    pub(super) fn plan(&mut self, own: Own<'_>) -> Result<bool, Infeasible> {
        if self.is_solving(own) {
            if let Some(target) = self.solve(own) {
                self.search_chosen(own, target)?;
                return Ok(true);
            }
            return Ok(false);
        }
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
                    Some(field) if field.is_constant() => FIELD_HOPS_AT_ONCE,
                    Some(_) => 1,
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
            _ => Ok(true),
        }
    }

    #[inline(never)] // a planner is built here once; its stack is not for every call of `work`
    fn begin_lead(&mut self, own: Own<'_>) -> Result<(), Infeasible> {
        self.lead = Lead::begin(own.mission, self.profile, own.settings)?;
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
        if let Some(ladder) = ladder {
            search.begin_with(ladder);
        }
        self.lead = Lead::Searching {
            search,
            last,
            given: false,
        };
        Ok(())
    }

    /// The leader goes back to the places that the relays were given: nothing can be met at those chosen.
    pub(super) fn search_given(&mut self, own: Own<'_>) -> Result<(), Infeasible> {
        self.lead = Lead::Searching {
            search: Search::new(own.mission, self.profile, Schedule::Bracketed)?,
            last: true,
            given: true,
        };
        Ok(())
    }

    /// The leader begins the pass it has planned.
    pub(super) fn begin_pass(&mut self, own: Own<'_>) -> Next {
        let mission = own.mission;
        match &self.lead {
            Lead::Searching { search, given, .. } => {
                let ladder = *search.ladder();
                let chosen = own.joins() && self.chosen.is_some() && !given;
                self.begin();
                self.sweep_on(own, ladder, chosen, None, &origins(mission))
            }
            Lead::Ascending(ascent) if ALTITUDE => {
                let ascent = *ascent;
                self.begin();
                self.set_course(own, ascent)
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
