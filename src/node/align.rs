//! Algorithms 1 and 4 on board: a relay's share of a sweep of targets, and of its verdict.

use crate::mission::{Mission, Profile};
use crate::placement::PerTarget;
use crate::placement::ladder::Ladder;
use crate::placement::pass::{self, Behind};
use crate::placement::verdict::Verdict;

/// A sweep, as one relay sees it.
#[derive(Clone, Debug)]
pub(crate) struct Sweeping {
    pub(crate) ladder: Ladder,
    /// This relay's place for each target.
    pub(crate) reaches: PerTarget,
    pub(crate) verdict: Verdict,
}

impl Sweeping {
    pub(crate) const fn new(ladder: Ladder) -> Self {
        Self {
            ladder,
            reaches: PerTarget::new(),
            verdict: Verdict {
                commit: None,
                slacks: PerTarget::new(),
            },
        }
    }

    /// Works out this relay's reaches from those of the relay before; at the last relay, the verdict too: whether it has.
    pub(crate) fn reach(
        &mut self,
        mission: &Mission,
        behind: Option<Behind>,
        index: u16,
        own: Profile,
        measured_per_w: Option<f32>,
        from: &PerTarget,
    ) -> bool {
        let targets = self.ladder.targets();
        pass::extend(
            mission,
            behind,
            index,
            own,
            &targets,
            from,
            &mut self.reaches,
        );
        let last = mission.after(index).is_none();
        if last {
            self.verdict = pass::close(mission, own, measured_per_w, self.ladder, &self.reaches);
        }
        last
    }

    /// Takes a verdict that has come back, if it fits: what is committed must be met, by a target this relay has a place for.
    pub(crate) fn take(&mut self, verdict: &Verdict) -> bool {
        let slacks = &verdict.slacks;
        let met = |target: u8| {
            slacks
                .get(usize::from(target))
                .is_some_and(|slack| *slack >= 0.0)
        };
        let fits = slacks.len() <= self.reaches.len() && verdict.commit.is_none_or(met);
        if fits {
            self.verdict = verdict.clone();
        }
        fits
    }

    /// The place that this relay takes by the verdict, m along x, and the target it is for.
    pub(crate) fn agreed(&self) -> Option<(f32, f32)> {
        let commit = usize::from(self.verdict.commit?);
        let target = *self.ladder.targets().get(commit)?;
        Some((*self.reaches.get(commit)?, target))
    }
}
