//! The whole chain from the mission alone, without a message: the radio-silent form of Algorithm 1.
//!
//! It walks the hops with the very functions the relays use, so what it finds is what they agree on by messages, to the
//! bit. The leader predicts with it, a relay that must keep silent finds its own place with it, and so does a planner.

use super::PerTarget;
use super::ladder::Ladder;
use super::pass::{self, Behind, Link, origins};
use super::search::{Infeasible, Schedule, Search};
use super::walk::Walk;
use crate::mission::{Mission, Profile};
use crate::place::Placement;

/// A target the whole chain meets, as the ladder and the place in it that the last relay would commit.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Agreed {
    /// The ladder of the sweep that settles the chain.
    pub ladder: Ladder,
    /// Which of its targets.
    pub commit: u8,
    /// That target, linear SIR.
    pub target: f32,
    /// What no chain at these altitudes has, linear SIR; `None` with the paper's fixed step, which leaves chains out.
    pub most: Option<f32>,
    /// Sweeps it took to find.
    pub sweeps: u32,
}

/// A chain being solved, a few hops at a time. Its size does not depend on N.
#[derive(Clone, Debug)]
pub struct Planner {
    search: Search,
    reaches: PerTarget,
    /// The next reaches, as far as they are known.
    next: PerTarget,
    /// The relay whose reaches come next, 1 to N.
    index: u16,
    behind: Option<Behind>,
    sweeps: u32,
}

impl Planner {
    /// Starts to solve `mission`, whose leader holds `leader`.
    ///
    /// # Errors
    /// [`Infeasible`] where the receiver can have no SIR at all.
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

    /// Works through at most `hops` hops (at most 16 reaches each, in a field 128 of its points); `Ok(Some(..))` when the chain is solved.
    ///
    /// `profile_of` gives what relay 1..=N holds; it must answer the same every time.
    ///
    /// # Errors
    /// [`Infeasible`] when no target is left to try.
    #[inline(never)] // what it needs of the stack is given back before a sweep is begun
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
            };
            if !link.go_on(&targets, &self.reaches, &mut self.next) {
                continue;
            }
            self.reaches = core::mem::take(&mut self.next);
            if let Some(next) = mission.after(self.index) {
                self.behind = Some(Behind::of(profile));
                self.index = next;
                continue;
            }
            let verdict = pass::close(&link, *self.search.ladder(), &self.reaches);
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

/// Solves the chain in one go: at most about fifty sweeps over N hops with the bracketed schedule.
///
/// Where relays hold back, they are followed once more, as [`place`] does.
///
/// # Errors
/// [`Infeasible`] when no target can be met.
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
        let chain = Walk {
            mission,
            target: agreed.target,
            plain: agreed.ladder.is_plain(),
            profile_of: &profile_of,
        };
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

/// Where relay `index` stands when the chain takes `target`, on a `plain` pass or not.
fn placed(
    mission: &Mission,
    target: f32,
    plain: bool,
    index: u16,
    profile_of: impl Fn(u16) -> Profile,
) -> Option<Placement> {
    let chain = Walk {
        mission,
        target,
        plain,
        profile_of: &profile_of,
    };
    // Everybody must be able to, not only those on the way back to this one.
    chain.place(0)?;
    chain
        .place(index)
        .map(|x_m| profile_of(index).on_line().at.at(x_m))
}

/// Where relay `index` stands when the chain takes `target`, held back where that lets the others meet it.
///
/// `None` when the target cannot be met. At most N^2 reaches' worth of work.
pub fn place(
    mission: &Mission,
    target: f32,
    index: u16,
    profile_of: impl Fn(u16) -> Profile,
) -> Option<Placement> {
    placed(mission, target, false, index, &profile_of)
        .or_else(|| placed(mission, target, true, index, &profile_of))
}

impl Mission {
    /// Returns the place that relay `index` finds for itself without a message, where every relay holds what the mission has in common.
    ///
    /// Equal to the bit to what the chain settles on by messages: `silent_places_equal_those_by_messages` in
    /// `host-tests/tests/chain.rs`. `None` when no target can be met.
    pub fn silent_place(&self, index: u16) -> Option<Placement> {
        let common = |_| self.config().common;
        let agreed = solve(self, Schedule::Bracketed, common).ok()?;
        placed(self, agreed.target, agreed.ladder.is_plain(), index, common)
    }
}
