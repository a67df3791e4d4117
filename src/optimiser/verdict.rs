//! Verdict of the last relay on one pass: the slacks of the targets, and the target to commit, if any.

use super::PerTarget;
use super::ladder::Ladder;
use crate::mission::Mission;

/// Result of the targets of one sweep.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Verdict {
    /// Index of the committed target in the ladder; every relay then takes its position for it.
    pub commit: Option<u8>,
    /// Slack for each target that every hop can meet, m: 0 or more if the chain closes.
    pub slacks: PerTarget,
}

impl Verdict {
    /// Returns the verdict on a pass of `ladder`, with its `targets`, from the slacks of those that every hop can meet. A target
    /// is committed if the next higher one is known to be infeasible and within the mission's tolerance, or if the ladder has no
    /// other target: the step of the paper's Algorithm 1.
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

/// Returns the index of the highest target that is met, plus one; 0 if none is. If every relay has the same altitude, all lower
/// targets are met too. In a varying field, and with different altitudes, some may be missed, and the highest one still counts.
pub(crate) fn met(slacks: &[f32]) -> usize {
    slacks
        .iter()
        .rposition(|slack| *slack >= 0.0)
        .map_or(0, |last| last + 1)
}
