//! The last relay's verdict on one pass: by how much each target is met, and whether one of them is good enough to keep.

use super::PerTarget;
use super::ladder::Ladder;
use crate::mission::Mission;

/// What became of the targets of one sweep.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Verdict {
    /// The target, by its place in the ladder, that every relay now takes its place for.
    pub commit: Option<u8>,
    /// For each target that every hop can meet, by how much the chain overshoots, m: not negative when it closes.
    pub slacks: PerTarget,
}

impl Verdict {
    /// The verdict on a pass of `ladder`, whose targets are `targets`, from the slacks of those that every hop can meet.
    ///
    /// A target is committed when the next one up is known to be infeasible and no more than the mission's tolerance away,
    /// or when the ladder has no other target: the step of the paper's Algorithm 1.
    pub(crate) fn new(
        mission: &Mission,
        ladder: Ladder,
        targets: &[f32],
        slacks: PerTarget,
    ) -> Self {
        let met = met(&slacks);
        let commit = match (
            met.checked_sub(1).and_then(|best| targets.get(best)),
            targets.get(met),
        ) {
            (Some(best), Some(next)) => next - best <= mission.config().tolerance * best,
            (Some(_), None) => ladder.is_single(),
            (None, _) => false,
        };
        Self {
            commit: if commit {
                u8::try_from(met - 1).ok()
            } else {
                None
            },
            slacks,
        }
    }
}

/// One more than the place of the highest target that is met; 0 if none is.
///
/// Where every relay has the same altitude all targets below it are met too. In a field that varies, and with altitudes of
/// their own, some may not be, which takes nothing from the one that is.
pub(crate) fn met(slacks: &[f32]) -> usize {
    slacks
        .iter()
        .rposition(|slack| *slack >= 0.0)
        .map_or(0, |last| last + 1)
}
