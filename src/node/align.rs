//! Algorithms 1 and 4 on board: a relay's share of a sweep of targets, and of its verdict.

use super::MEMBERSHIP;
use crate::mission::Mission;
use crate::placement::PerTarget;
use crate::placement::ladder::Ladder;
use crate::placement::pass::{self, Behind};
use crate::placement::verdict::Verdict;
use crate::sir::Station;

/// A sweep, as one relay sees it.
#[derive(Clone, Debug)]
pub(crate) struct Sweeping {
    pub(crate) ladder: Ladder,
    /// What it came with, as [`told`] sums it up.
    pub(crate) told: u32,
    /// Whether it is of relays where the joint method has them, and if this one has not worked that out yet, from which relay the pass
    /// came; `reaches` are that one's then.
    pub(crate) chosen: bool,
    pub(crate) put_off: Option<Option<Behind>>,
    /// Whether a relay after this one differs from what the mission says of all.
    pub(crate) own: bool,
    /// This relay's place for each target.
    pub(crate) reaches: PerTarget,
    pub(crate) verdict: Verdict,
}

impl Sweeping {
    pub(crate) const fn new(ladder: Ladder) -> Self {
        Self {
            ladder,
            told: 0,
            chosen: false,
            put_off: None,
            own: false,
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
        own: Station,
        end_m: Option<f32>,
        measured_per_w: Option<f32>,
        from: &PerTarget,
    ) -> bool {
        self.told = told(behind, from);
        let targets = self.ladder.targets();
        let reaches = &mut self.reaches;
        match end_m {
            Some(end_m) => {
                let own = (index, own);
                pass::extend_chosen(mission, behind, own, end_m, &targets, from, reaches);
            }
            None => pass::extend(mission, behind, index, own, &targets, from, reaches),
        }
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

/// What the relay before says of itself, summed up: it says the same whenever it says the same pass, unless it was rebooted.
/// 0 where nothing can be done about that.
pub(crate) fn told(behind: Option<Behind>, from: &PerTarget) -> u32 {
    if !MEMBERSHIP {
        return 0;
    }
    let held = behind.map_or([0.0; 3], |behind| {
        let Station { at, power_w } = behind.relay;
        [at.y_m, at.altitude_m, power_w]
    });
    held.iter().chain(from).fold(0, |sum: u32, value| {
        sum.rotate_left(5).wrapping_add(value.to_bits())
    })
}
