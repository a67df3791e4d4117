//! Whole chain from the mission alone, without messages: the radio-silent form of Algorithm 1.
//!
//! It uses the same functions as the relays, so its result equals the relays' agreement to the bit. The leader predicts with it,
//! a radio-silent relay computes its own position, and so does a planner.

use super::PerTarget;
use super::ladder::Ladder;
use super::pass::{self, Behind, Link, Walk, origins};
use super::search::{Infeasible, Schedule, Search};
use crate::mission::{Mission, Profile};
use crate::place::Placement;

/// Target SIR on which the chain has agreed, and the list of targets of the last pass along the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Agreed {
    /// Ladder (list of target SIRs) of the last pass along the chain. The committed target is one of them.
    pub ladder: Ladder,
    /// Index of the committed target SIR in the ladder.
    pub commit: u8,
    /// Target SIR that the chain has agreed on, linear.
    pub target: f32,
    /// Target SIR that no chain whose relays have these altitudes can meet, linear. `None` with the paper's fixed-step
    /// schedule, because its passes do not try all chains. `None` also for data in both directions.
    pub most: Option<f32>,
    /// Number of passes along the chain that the search took.
    pub sweeps: u32,
}

/// Solver for the positions of a whole chain in one program, without messages between relays. It computes a few hops
/// per call. Its size does not depend on the number of relays.
#[derive(Clone, Debug)]
pub struct Planner {
    search: Search,
    reaches: PerTarget,
    /// Farthest x at which the current relay meets each target, m; the list grows from call to call.
    next: PerTarget,
    index: u16,
    behind: Option<Behind>,
    sweeps: u32,
}

impl Planner {
    /// Starts to solve `mission`, whose leader has the profile `leader`.
    ///
    /// # Errors
    /// [`Infeasible`] if no SIR above zero is possible at the receiver.
    pub fn new(mission: &Mission, leader: Profile, schedule: Schedule) -> Result<Self, Infeasible> {
        let search = Search::new(mission, leader, schedule)?;
        let mut planner = Self {
            search,
            reaches: PerTarget::new(),
            next: PerTarget::new(),
            index: mission.leader(),
            behind: None,
            sweeps: 0,
        };
        planner.start_sweep(mission);
        Ok(planner)
    }

    fn start_sweep(&mut self, mission: &Mission) {
        self.reaches = origins(mission);
        self.index = mission.leader();
        self.behind = None;
        self.sweeps = self.sweeps.saturating_add(1);
    }

    /// Computes at most `hops` hops of a pass along the chain; `Ok(Some(..))` once the chain is solved.
    ///
    /// For a hop it computes the farthest x of one relay for each of at most 16 targets. In an interference field a
    /// call stops after 128 evaluations of field points, but computes at least one of these x. `profile_of` returns the
    /// profile of relay 1..=N, which must not change between calls.
    ///
    /// # Errors
    /// [`Infeasible`] if no target is left to try.
    #[inline(never)] // frees its stack before a sweep starts
    pub fn step(
        &mut self,
        mission: &Mission,
        profile_of: impl Fn(u16) -> Profile,
        hops: u16,
    ) -> Result<Option<Agreed>, Infeasible> {
        let mut targets = self.search.ladder().targets();
        for _ in 0..hops {
            let profile = profile_of(self.index);
            let link = Link {
                mission,
                behind: self.behind,
                index: self.index,
                own: profile.on_line(),
                measured_per_w: None,
                plain: self.search.ladder().is_plain(),
                end_m: None,
                fixed_m: None,
            };
            if !link.go_on(&targets, &self.reaches, &mut self.next) {
                continue;
            }
            let from = core::mem::replace(&mut self.reaches, core::mem::take(&mut self.next));
            if let Some(next) = mission.after(self.index) {
                self.behind = Some(Behind::of(profile));
                self.index = next;
                continue;
            }
            let verdict = pass::close(&link, *self.search.ladder(), &from, &self.reaches);
            if let Some(commit) = verdict.commit
                && let Some(&target) = targets.get(usize::from(commit))
            {
                return Ok(Some(Agreed {
                    ladder: *self.search.ladder(),
                    commit,
                    target,
                    most: self.search.most(&verdict.slacks),
                    sweeps: self.sweeps,
                }));
            }
            self.search.advance(&verdict.slacks)?;
            self.start_sweep(mission);
            targets = self.search.ladder().targets();
        }
        Ok(None)
    }
}

/// Solves the chain in one call. With [`Schedule::Bracketed`], it takes at most about fifty passes over N hops.
///
/// If the agreed target requires that some relays stop before their farthest x, the function also checks that each of
/// them can take the required x.
///
/// # Errors
/// [`Infeasible`] if no target can be met.
pub fn solve(
    mission: &Mission,
    schedule: Schedule,
    profile_of: impl Fn(u16) -> Profile,
) -> Result<Agreed, Infeasible> {
    let leader = profile_of(mission.leader());
    let mut planner = Planner::new(mission, leader, schedule)?;
    loop {
        let Some(agreed) = planner.step(mission, &profile_of, u16::MAX)? else {
            continue;
        };
        let chain = Walk::new(
            mission,
            agreed.target,
            agreed.ladder.is_plain(),
            &profile_of,
        );
        let next = if chain.place(0).is_some() {
            if planner.search.accept(agreed.target) {
                return Ok(agreed);
            }
            Ok(())
        } else {
            planner
                .search
                .refuse(mission, leader, agreed.target, agreed.most)
        };
        next?;
        planner.start_sweep(mission);
    }
}

impl Mission {
    /// Returns the position that relay `index` computes without messages. Each relay must have the altitude and power
    /// that the mission states.
    ///
    /// This position is, to the bit, the position on which relays agree by messages:
    /// `silent_places_equal_those_by_messages` in `host-tests/tests/chain.rs`. `None` if no target can be met.
    pub fn silent_place(&self, index: u16) -> Option<Placement> {
        let common = |_| self.config().common;
        let agreed = solve(self, Schedule::Bracketed, common).ok()?;
        let chain = Walk::new(self, agreed.target, agreed.ladder.is_plain(), &common);
        let x_m = chain.place(index)?;
        Some(common(index).on_line().cross_section.at(x_m))
    }
}
