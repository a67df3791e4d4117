//! The search for the highest target that the chain can meet: which targets to try next, from what the last ones gave.
//!
//! Both schedules of Algorithm 1 are one path. The paper's tries gamma_0, gamma_0 - epsilon, ... one a sweep. The bracketed
//! one tries a ladder of targets a sweep; feasibility is monotone in the target, so the answer lies between the highest
//! that was met and the lowest that was not, and the slacks, smooth in log gamma, tell where: inverse interpolation puts
//! the next ladder's dense middle there while its ends still span the bracket.
//!
//! On a plain pass, which holds nobody back, a target may be met while lower ones are not: what is met is met. All other passes
//! leave no chain out, so the lowest target that has been missed is a bound of what any chain can have.
//!
//! A pass takes the places of a relay for a stretch without holes. Where a separation binds there may be one, and the relay that is
//! told to stand in it refuses. Then a plain pass, which holds nobody back, finds what can be had for certain, and the targets between
//! that and what was refused are halved. Every one that is accepted is flown; the last pass is of the best.

use core::ops::Range;

use super::ladder::Ladder;
use super::verdict::{Verdict, met};
use crate::mission::{Heading, Mission, MissionConfig, Profile};
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::{self, Sender};

/// Which targets the leader tries.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Schedule {
    /// Sixteen targets a sweep around the interpolated optimum, until it is known to the mission's tolerance.
    #[default]
    Bracketed,
    /// The paper's: one target a sweep, from the highest any chain can meet downward.
    FixedStep {
        /// Epsilon, linear SIR, above 0. In f64: it is taken up to ten thousand times from one start.
        step: f64,
    },
}

/// No target down to a millionth of a millionth of the ceiling can be met.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Infeasible;

impl core::fmt::Display for Infeasible {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("no target SIR can be met by this chain")
    }
}

impl core::error::Error for Infeasible {}

/// The highest target that is tried.
const HIGHEST: f32 = 1e30;

/// How far below the ceiling the search gives up.
const DEPTH: f32 = 1e-12;

/// How far, as a part of the gap between two targets, a smooth slack may make the cubic's root differ from the line's.
const BEND: f32 = 0.25;

/// How much of a bracket a sweep must cut off for the interpolation to be trusted with the next one.
const PROGRESS: f32 = 0.25;

/// Sweeps after which the search settles for the best target it has met.
const MOST_SWEEPS: u32 = 48;

/// The state of a search: the bracket so far and the ladder to try next.
#[derive(Clone, Debug)]
pub struct Search {
    schedule: Schedule,
    tolerance: f32,
    /// What the leader's own end of the chain can have at most, hence the chain.
    ceiling: f32,
    /// The first target of the fixed-step schedule: the paper's gamma_0.
    start: f32,
    /// Highest target known to be met.
    feasible: Option<f32>,
    /// Lowest target known not to be met.
    infeasible: Option<f32>,
    /// infeasible / feasible - 1 before the last sweep.
    width: f32,
    ladder: Ladder,
    /// Sweeps whose verdict has come in.
    tried: u32,
    /// Whether nobody holds back: as in the paper, and where a chain that did has turned out not to be one.
    plain: bool,
    /// The lowest target that no chain can meet, as far as known.
    most: Option<f32>,
    /// What is tried once somebody was held back to where it could not be.
    trials: Option<StandTrials>,
}

impl Search {
    /// A search by the leader of `mission`, which holds `leader`; the other relays need not hold what the mission has in common.
    ///
    /// # Errors
    /// [`Infeasible`] where even a relay right above the receiver gives it no SIR: an interferer standing at the receiver.
    pub fn new(mission: &Mission, leader: Profile, schedule: Schedule) -> Result<Self, Infeasible> {
        let MissionConfig {
            distance_m, common, ..
        } = *mission.config();
        let above_receiver = |profile: Profile| Placement::on_line(distance_m, profile.altitude_m);
        // What the hop at either end can have at most, and what a chain of equals meets that takes no step at all.
        let (ceiling, start, met) = match mission.heading() {
            Heading::TowardRx => {
                let ceiling = sir::first_hop_ceiling(mission, leader.altitude_m);
                let last = sir::at_receiver(mission, above_receiver(common), common.power_w);
                let met = Sender::transmitter(mission).sir_at(mission, 0.0, above_receiver(leader));
                (ceiling, ceiling.min(last), met)
            }
            Heading::TowardTx => {
                let ceiling = sir::at_receiver(mission, above_receiver(leader), leader.power_w);
                let above_transmitter = Placement::on_line(0.0, leader.altitude_m);
                let met = sir::at_receiver(mission, above_transmitter, leader.power_w);
                (ceiling, ceiling, met)
            }
        };
        // A subnormal target has no digits left to search with; the lowest of a ladder is up to eight times below `DEPTH`.
        if !(start >= 8.0 * f32::MIN_POSITIVE / DEPTH) {
            return Err(Infeasible);
        }
        // In a quiet field they may be above any f32, and no ladder ends there.
        let (ceiling, start) = (ceiling.min(HIGHEST), start.min(HIGHEST));
        let plain = schedule != Schedule::Bracketed;
        let ladder = if plain {
            Ladder::single(start)
        } else {
            // Half of what is met leaves room for rounding.
            Ladder::spanning(met.min(start).max(start * DEPTH) / 2.0, start * 1.01)
        };
        Ok(Self {
            schedule,
            tolerance: mission.config().tolerance,
            ceiling,
            start,
            feasible: None,
            infeasible: None,
            width: f32::INFINITY,
            ladder: ladder.plainly(plain),
            tried: 0,
            plain,
            most: None,
            trials: None,
        })
    }

    /// The targets to try now.
    pub const fn ladder(&self) -> &Ladder {
        &self.ladder
    }

    /// Tries `ladder` next instead: the one by which the leader, having solved the chain beforehand, expects a commit.
    ///
    /// Where that is plain, all are.
    pub(crate) fn begin_with(&mut self, ladder: Ladder) {
        self.plain |= ladder.is_plain();
        self.ladder = ladder.plainly(self.plain);
    }

    /// The lowest target that no chain can meet, once the last pass gave these `slacks`; `None` of plain passes alone.
    pub fn most(&self, slacks: &[f32]) -> Option<f32> {
        if self.plain || self.trials.is_some() {
            return self.most;
        }
        let missed = self.ladder.targets().get(met(slacks)).copied();
        let known = self.infeasible.unwrap_or(self.ceiling * 1.000_001);
        Some(missed.map_or(known, |missed| missed.min(known)))
    }

    /// Takes the slacks of [`Search::ladder`], in metres for as many targets as every hop could meet, and moves on.
    ///
    /// Constant work: at most some 200 floating-point operations and three logarithms.
    ///
    /// # Errors
    /// [`Infeasible`] when no target is left to try.
    pub fn advance(&mut self, slacks: &[f32]) -> Result<(), Infeasible> {
        self.tried = self.tried.saturating_add(1);
        if let Some(trials) = &mut self.trials
            && !self.plain
        {
            // A relay has changed.
            trials.high = trials
                .high
                .min(self.ladder.targets().first().copied().unwrap_or(0.0));
            return self.try_next();
        }
        let next = match self.schedule {
            Schedule::FixedStep { step } => self.step_down(step),
            Schedule::Bracketed => self.narrow(slacks),
        };
        match next {
            Ok(next) => self.ladder = next.plainly(self.plain),
            // No plain chain at all: others may do.
            Err(Infeasible) => self.try_next()?,
        }
        Ok(())
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "a target is an f32; the subtraction is what needs the width"
    )]
    fn step_down(&self, step: f64) -> Result<Ladder, Infeasible> {
        let target = (f64::from(self.start) - f64::from(self.tried) * step) as f32;
        if target >= f32::MIN_POSITIVE {
            Ok(Ladder::single(target))
        } else {
            Err(Infeasible)
        }
    }

    fn narrow(&mut self, slacks: &[f32]) -> Result<Ladder, Infeasible> {
        let targets = self.ladder.targets();
        let met = met(slacks);
        let best = met
            .checked_sub(1)
            .and_then(|last| targets.get(last))
            .copied();
        let worst = targets.get(met).copied();
        if self.ladder.is_single() && best.is_none() {
            // What had been met is not any more: a relay has changed.
            self.feasible = None;
        }
        self.feasible = best.into_iter().chain(self.feasible).reduce(f32::max);
        self.infeasible = worst.into_iter().chain(self.infeasible).reduce(f32::min);
        let Some(low) = self.feasible else {
            let high = self.infeasible.ok_or(Infeasible)?;
            let hopeless = high <= self.start * DEPTH || self.tried >= MOST_SWEEPS;
            return if hopeless {
                Err(Infeasible)
            } else {
                Ok(Ladder::between((high / 1e3).max(f32::MIN_POSITIVE), high))
            };
        };
        // No chain meets more than its first hop can have.
        let high = self.infeasible.unwrap_or(self.ceiling * 1.000_001);
        if low >= high {
            // With altitudes of their own, relays may meet a target and miss a lower one. What is met is met.
            self.infeasible = None;
            self.width = f32::INFINITY;
            return Ok(Ladder::single(low));
        }
        Ok(self.inside(low, high, &targets, slacks))
    }

    /// The next ladder inside a bracket.
    #[inline(never)] // its stack is not for working out the targets
    fn inside(&mut self, low: f32, high: f32, targets: &[f32], slacks: &[f32]) -> Ladder {
        let width = (high - low) / low;
        let stalled = width > PROGRESS * self.width;
        self.width = width;
        if width <= self.tolerance || low.next_up() >= high || self.tried >= MOST_SWEEPS {
            return Ladder::single(low);
        }
        let centre = if stalled {
            None
        } else {
            interpolate(targets, slacks)
        };
        match centre.filter(|centre| low < *centre && *centre < high) {
            // A quarter of the tolerance in the middle: the root may lie in a neighbouring gap and still be close enough.
            Some(centre) => Ladder::around(centre, self.tolerance / 4.0, low, high),
            None => Ladder::between(low, high),
        }
    }
}

/// The target at which the slack is zero: log target as a cubic in the slack through the four points about its change of sign.
///
/// `None` where the cubic and the straight line disagree: the slack jumps there, and a root of either means nothing.
fn interpolate(targets: &[f32], slacks: &[f32]) -> Option<f32> {
    let met = met(slacks);
    let reference = *targets.get(met.checked_sub(1)?)?;
    let root_within = |window: Range<usize>| {
        let mut points: heapless::Vec<(f32, f32), 4> = heapless::Vec::new();
        for (&target, &slack) in targets.get(window.clone())?.iter().zip(slacks.get(window)?) {
            points
                .push((slack, libm::log1pf((target - reference) / reference)))
                .ok()?;
        }
        neville_at_zero(&mut points)
    };
    let gap = libm::log1pf((targets.get(met)? - reference) / reference);
    let line = root_within(met - 1..met + 1)?;
    let cubic = root_within(met.saturating_sub(2)..(met + 2).min(slacks.len()))?;
    let trusted = (0.0..=gap).contains(&cubic) && (cubic - line).abs() <= BEND * gap;
    trusted.then(|| reference + reference * libm::expm1f(cubic))
}

/// The polynomial through `points` (abscissa, value) at abscissa 0; `None` unless the abscissae fall strictly.
fn neville_at_zero(points: &mut [(f32, f32)]) -> Option<f32> {
    for order in 1..points.len() {
        for i in 0..points.len() - order {
            let (far, (_, upper)) = (points.get(i + order)?.0, *points.get(i + 1)?);
            let (near, lower) = *points.get(i)?;
            if !(near > far) {
                return None;
            }
            points.get_mut(i)?.1 = (near * upper - far * lower) / (near - far);
        }
    }
    points.first().map(|point| point.1)
}

/// Targets that are agreed on to see whether everybody can stand where the others need it.
#[derive(Clone, Copy, Debug)]
struct StandTrials {
    /// The lowest that was refused.
    high: f32,
    /// The highest that was not, and its pass.
    best: Option<(f32, Ladder)>,
    /// Whether that is agreed on for good.
    over: bool,
}

impl Search {
    /// Whether `verdict`, which commits nothing, is on a pass that was to be agreed on: somebody cannot stand where another needs
    /// it. Then the target that was.
    #[inline(never)] // its stack is not for the search that goes on
    pub fn refused(&self, mission: &Mission, verdict: &Verdict) -> Option<f32> {
        let targets = self.ladder.targets();
        let due = Verdict::new(mission, self.ladder, &targets, verdict.slacks.clone());
        let due = due
            .commit
            .filter(|_| !self.plain && verdict.commit.is_none())?;
        targets.get(usize::from(due)).copied()
    }

    /// A target was agreed on; whether that is all.
    pub fn accept(&mut self, target: f32) -> bool {
        let own = Ladder::single(target).plainly(self.plain);
        let Some(trials) = &mut self.trials else {
            return true;
        };
        let last = trials.over;
        trials.best = Some((target, own));
        // The best is what is held: once no other is left to try, it is that.
        last || self.try_next().is_err() || self.trials.is_some_and(|trials| trials.over)
    }

    /// `target` was to be agreed on, and `refused`. First a plain pass tells what can be had for certain; between that and what was
    /// refused the targets are then halved.
    ///
    /// # Errors
    /// [`Infeasible`] when none is left.
    pub fn refuse(
        &mut self,
        mission: &Mission,
        leader: Profile,
        target: f32,
        most: Option<f32>,
    ) -> Result<(), Infeasible> {
        if let Some(trials) = &mut self.trials {
            trials.high = target;
            return self.try_next();
        }
        let fresh = Self::new(mission, leader, self.schedule)?;
        *self = Self {
            plain: true,
            most,
            trials: Some(StandTrials {
                high: target,
                best: None,
                over: false,
            }),
            ladder: fresh.ladder.plainly(true),
            ..fresh
        };
        Ok(())
    }

    /// The next target that may be agreed on with somebody held back; at the end the best once more, if it is not held.
    fn try_next(&mut self) -> Result<(), Infeasible> {
        let trials = self.trials.as_mut().ok_or(Infeasible)?;
        if trials.over {
            return Err(Infeasible);
        }
        let (low, high) = (
            trials.best.map_or(trials.high / 4.0, |best| best.0),
            trials.high,
        );
        let near = high <= low * (1.0 + self.tolerance) || low.next_up() >= high;
        self.ladder = match trials.best {
            Some((_, best)) if near => {
                trials.over = true;
                best
            }
            None if low <= self.start * DEPTH => return Err(Infeasible),
            Some(_) => Ladder::single(sqrt(low) * sqrt(high)),
            None => Ladder::single(low),
        };
        self.plain = self.ladder.is_plain();
        Ok(())
    }
}
