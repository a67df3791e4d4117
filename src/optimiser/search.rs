//! Search for the highest target that the chain meets. The results of a pass select the targets of the next one.
//!
//! It implements both schedules of Algorithm 1. The paper's schedule tries gamma_0, gamma_0 - epsilon, ..., one in each
//! pass. The bracketed schedule tries a ladder of targets in each pass. A chain that meets a target also meets lower
//! ones, so the optimum is between the highest target that was met and the lowest that was missed. The slacks are
//! smooth in log gamma, so inverse interpolation places the dense middle of the next ladder. Its ends still span the
//! *bracket*: the range of targets that may be the highest feasible one.
//!
//! On a plain pass, in which no relay holds back, a target may be met while lower ones are missed; it then counts as met. All
//! other passes exclude no chain, so the lowest missed target bounds the SIR of every chain.
//!
//! A pass assumes that a relay's positions are an interval without holes. If a separation is binding there may be a
//! hole, and a relay whose required position is in it refuses. Then a plain pass finds a target that no relay can
//! refuse, and the interval between this target and the refused one is bisected. Every accepted target is flown; the
//! last pass is for the best one.

use core::ops::Range;

use super::ladder::Ladder;
use super::pass::{Verdict, met};
use crate::features::REVERSE;
use crate::mission::{Mission, MissionConfig, Profile};
use crate::place::Placement;
use crate::root::sqrt;
use crate::side::Heading;
use crate::sir::{self, Sender};

/// Schedule of the target SIRs that the leader tries in successive passes along the chain.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Schedule {
    /// Sixteen targets per pass along the chain, around the optimum interpolated from the last pass. The search ends
    /// once the optimum is known to the mission's tolerance.
    #[default]
    Bracketed,
    /// A single target per pass along the chain, falling in equal steps, as in the paper. The first target is the upper
    /// bound of the chain's SIR.
    FixedStep {
        /// Step epsilon between two targets, linear SIR, above 0. The type is f64, because the step is subtracted up to
        /// ten thousand times from the first target.
        step: f64,
    },
}

/// Error: the chain meets no target SIR, not even 1e-12 times the upper bound of its SIR.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Infeasible;

impl core::fmt::Display for Infeasible {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("no target SIR can be met by this chain")
    }
}

impl core::error::Error for Infeasible {}

const HIGHEST: f32 = 1e30;

/// Lowest target that the search tries, as a fraction of the upper bound of the chain's SIR.
const DEPTH: f32 = 1e-12;

/// Maximum difference of the targets by cubic and linear interpolation for use of the cubic one. The unit is the gap
/// between the two targets around the result.
const BEND: f32 = 0.25;

/// Maximum ratio of the bracket's width after a pass along the chain to its width before the pass. The bracket is the
/// interval that contains the best target. With a larger ratio the next targets are spread evenly over the bracket, not
/// around an interpolated optimum.
const PROGRESS: f32 = 0.25;

/// Number of passes along the chain after which the search ends with the best feasible target found.
const MOST_SWEEPS: u32 = 48;

/// State of the leader's search for the highest target SIR: the bracket and the next targets to try.
#[derive(Clone, Debug)]
pub struct Search {
    schedule: Schedule,
    tolerance: f32,
    /// Upper bound of the chain's SIR, linear. This is the maximum SIR of the hop between the leader and the end of the
    /// chain (Tx or Rx) next to it.
    ceiling: f32,
    /// First target of the fixed-step schedule (gamma_0 in the paper), or upper bound of the bracketed one.
    start: f32,
    feasible: Option<f32>,
    infeasible: Option<f32>,
    /// Relative width of the bracket before the last pass: `infeasible` / `feasible` - 1.
    width: f32,
    ladder: Ladder,
    tried: u32,
    /// True for plain passes, in which every relay takes the farthest x that meets the target. The paper's schedule has
    /// only plain passes. Plain passes are also used after a relay has refused a target. A relay refuses a target if it
    /// cannot take the x that the next relay requires.
    plain: bool,
    /// Lowest target SIR known to be infeasible for every chain; `None` if no such target is known.
    most: Option<f32>,
    /// Bisection for a target that all relays accept. `None` until a relay has refused a target.
    trials: Option<StandTrials>,
    both_ways: bool,
}

impl Search {
    /// Creates a search by the leader of `mission` with the profile `leader`. The remaining relays can have different
    /// profiles.
    ///
    /// # Errors
    /// [`Infeasible`] if a relay above the receiver gives the receiver an SIR of 0, because the interferer is
    /// at the receiver.
    pub fn new(mission: &Mission, leader: Profile, schedule: Schedule) -> Result<Self, Infeasible> {
        let MissionConfig {
            distance_m, common, ..
        } = *mission.config();
        let above_receiver = |profile: Profile| Placement::on_line(distance_m, profile.altitude_m);
        // Ceilings of the hops at both ends, and the SIR of a chain of equal relays without any step.
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
        let (start, met) = with_way_back(mission, leader, start, met);
        // A subnormal target has no digits left to search with; the lowest of a ladder is up to eight times below `DEPTH`.
        if !(start >= 8.0 * f32::MIN_POSITIVE / DEPTH) {
            return Err(Infeasible);
        }
        // With very low interference they may exceed f32.
        let (ceiling, start) = (ceiling.min(HIGHEST), start.min(HIGHEST));
        let plain = schedule != Schedule::Bracketed;
        let ladder = if plain {
            Ladder::single(start)
        } else {
            // Half of the met target leaves a margin for rounding.
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
            both_ways: mission.reverse() > 0.0,
        })
    }

    /// Returns the target SIRs (ladder) for the next pass along the chain.
    pub const fn ladder(&self) -> &Ladder {
        &self.ladder
    }

    /// Replaces the next list of targets by `ladder`, the leader's prediction. If the prediction is right, the pass
    /// with these targets ends the search. If `ladder` is for a plain pass, all later passes are plain, too.
    pub(crate) fn begin_with(&mut self, ladder: Ladder) {
        self.plain |= ladder.is_plain();
        self.ladder = ladder.plainly(self.plain);
    }

    /// Returns the lowest target known to be infeasible for every chain; `None` if no such target is known.
    ///
    /// `slacks` are the chain's slacks, m, for the targets of the last pass. Plain passes prove nothing, because they
    /// do not try all chains. `None` for data in both directions.
    pub fn most(&self, slacks: &[f32]) -> Option<f32> {
        if REVERSE && self.both_ways {
            // For data in both directions it is not proven that reaches and held positions exclude no chain.
            return None;
        }
        if self.plain || self.trials.is_some() {
            return self.most;
        }
        let missed = self.ladder.targets().get(met(slacks)).copied();
        let known = self.infeasible.unwrap_or(self.ceiling * 1.000_001);
        Some(missed.map_or(known, |missed| missed.min(known)))
    }

    /// Continues the search after a pass along the chain. `slacks` are the chain's slacks, m, for the first targets of
    /// [`Search::ladder`]: those that every hop can meet. A slack is the maximum length of the chain for a target,
    /// minus the distance from Tx to Rx.
    ///
    /// Constant work: at most some 200 floating-point operations and three logarithms.
    ///
    /// # Errors
    /// [`Infeasible`] if no target is left to try.
    pub fn advance(&mut self, slacks: &[f32]) -> Result<(), Infeasible> {
        self.tried = self.tried.saturating_add(1);
        if let Some(trials) = &mut self.trials
            && !self.plain
        {
            // The result differs from before, because a relay has changed.
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
            // No plain chain is feasible, but one with relays that hold back may be.
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
            // A target that was met is missed now, because a relay has changed.
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
        // No chain exceeds the ceiling of its first hop.
        let high = self.infeasible.unwrap_or(self.ceiling * 1.000_001);
        if low >= high {
            // With different altitudes relays may meet a target and miss a lower one; the target then counts as met.
            self.infeasible = None;
            self.width = f32::INFINITY;
            return Ok(Ladder::single(low));
        }
        Ok(self.inside(low, high, &targets, slacks))
    }

    #[inline(never)] // keeps its stack apart from that of `targets`
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
            // A quarter of the tolerance in the middle: the root may be in a neighbouring gap and still be close enough.
            Some(centre) => Ladder::around(centre, self.tolerance / 4.0, low, high),
            None => Ladder::between(low, high),
        }
    }
}

/// Lowers the targets `start` and `met` to allow for data from Rx to Tx, and returns both.
///
/// `start`, the upper bound of the search, becomes at most the maximum SIR of the backward hop to Tx. `met`, a feasible
/// target for data toward Rx, becomes at most the SIRs of the backward hops to Tx and from Rx. These SIRs are divided
/// by the required ratio of backward to forward SIR.
fn with_way_back(mission: &Mission, leader: Profile, start: f32, met: f32) -> (f32, f32) {
    let MissionConfig {
        distance_m, common, ..
    } = *mission.config();
    let reverse = mission.reverse();
    if !(reverse > 0.0) {
        return (start, met);
    }
    let to_tx = |x_m| {
        let from = Placement::on_line(x_m, leader.altitude_m);
        sir::at_transmitter(mission, from, leader.power_w) / reverse
    };
    let above_receiver = Placement::on_line(distance_m, common.altitude_m);
    let from_rx = Sender::receiver(mission).sir_at(mission, distance_m, above_receiver) / reverse;
    (
        start.min(to_tx(0.0)),
        met.min(to_tx(distance_m)).min(from_rx),
    )
}

/// Returns the target at which the chain's slack is 0, by cubic interpolation of ln(target). The slack is the maximum
/// length of the chain minus the distance from Tx to Rx.
///
/// The cubic curve passes through the slacks of the two highest targets that are met and of the two lowest that are
/// missed. `None` if linear interpolation gives a target that differs by more than [`BEND`]: the slack then jumps, and
/// no interpolated target is meaningful.
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

/// Returns the value at 0 of the polynomial through `points`, pairs of x and value. `None` unless the x strictly fall
/// from point to point.
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

/// Bisection for the highest target that all relays accept. A relay refuses a target if it cannot take the position
/// that the next relay requires.
#[derive(Clone, Copy, Debug)]
struct StandTrials {
    high: f32,
    /// Highest target that all relays accepted, and the ladder (list of targets) for another pass with it. `None` until
    /// a target is accepted.
    best: Option<(f32, Ladder)>,
    /// True once the bisection has ended. The best target found is then the result.
    over: bool,
}

impl Search {
    /// Returns the target that a relay has refused in the last pass; `None` if there is none.
    ///
    /// A relay refuses a target if it cannot take the position that the next relay requires. The refusing relay deletes
    /// the committed target from `verdict`, the result of the pass. The refused target follows from the slacks in
    /// `verdict`.
    #[inline(never)] // keeps its stack apart from the rest of the search
    pub fn refused(&self, mission: &Mission, verdict: &Verdict) -> Option<f32> {
        let targets = self.ladder.targets();
        let due = Verdict::new(mission, self.ladder, &targets, verdict.slacks.clone());
        let due = due
            .commit
            .filter(|_| !self.plain && verdict.commit.is_none())?;
        targets.get(usize::from(due)).copied()
    }

    /// Records that all relays accepted the target SIR `target`; returns true if the search is over.
    pub fn accept(&mut self, target: f32) -> bool {
        let own = Ladder::single(target).plainly(self.plain);
        let Some(trials) = &mut self.trials else {
            return true;
        };
        let last = trials.over;
        trials.best = Some((target, own));
        // The best target is the current one, and the final one if no other is left.
        last || self.try_next().is_err() || self.trials.is_some_and(|trials| trials.over)
    }

    /// Continues after a relay refused its required position for `target`.
    ///
    /// The search first makes plain passes, in which every relay takes the farthest x that meets a target. So no relay
    /// can refuse the target that they find. The interval from this target to the refused one is then bisected. `most`
    /// is a target that no chain can meet, if known.
    ///
    /// # Errors
    /// [`Infeasible`] if no target is left.
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

    /// Selects the next target of the bisection. Once the interval is within the mission's tolerance, it selects the
    /// best accepted target, and the search ends.
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
