//! What is tried when a target was agreed on that somebody could not stand for.
//!
//! A pass takes the places of a relay for a stretch without holes. Where a separation binds there may be one, and the relay that is
//! told to stand in it refuses. Then a plain pass, which holds nobody back, finds what can be had for certain, and the targets between
//! that and what was refused are halved. Every one that is accepted is flown; the last pass is of the best.

use super::{DEPTH, Infeasible, Search};
use crate::mission::{Mission, Profile};
use crate::placement::ladder::Ladder;
use crate::placement::verdict::Verdict;
use crate::root::sqrt;

/// Targets that are agreed on to see whether everybody can stand where the others need it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trials {
    /// The lowest that was refused.
    pub(super) high: f32,
    /// The highest that was not, and its pass.
    pub(super) best: Option<(f32, Ladder)>,
    /// Whether that is agreed on for good.
    pub(super) over: bool,
}

impl Search {
    /// Whether `verdict`, which commits nothing, is on a pass that was to be agreed on: somebody cannot stand where another needs
    /// it. Then the target that was.
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
            trials: Some(Trials {
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
    pub(super) fn try_next(&mut self) -> Result<(), Infeasible> {
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
