//! The tail's verdict on one sweep: by how much each target is met, and whether one of them is good enough to keep.

use super::PerTarget;
use super::ladder::Ladder;
use super::spacing::receiver_reach;
use crate::mission::{Mission, Profile};

/// What became of the targets of one sweep.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Verdict {
    /// The target, by its place in the ladder, that every relay now takes its place for.
    pub commit: Option<u8>,
    /// For each target that every hop can meet, reach + `d_max` - D in metres: not negative when the chain closes.
    pub slacks: PerTarget,
}

impl Verdict {
    /// The tail's verdict, from its own `reaches` for the targets of `ladder` and the profile it sends with.
    ///
    /// A target is committed when the next one up is known to be infeasible and no more than the mission's tolerance away,
    /// or when the ladder has no other target: the step of the paper's Algorithm 1.
    pub fn reach(mission: &Mission, profile: Profile, ladder: &Ladder, reaches: &[f32]) -> Self {
        let targets = ladder.targets();
        let mut slacks = PerTarget::new();
        for (&target, &place) in targets.iter().zip(reaches) {
            let Some(last_hop) = receiver_reach(mission, profile, target) else {
                break;
            };
            let slack = place - mission.config().distance_m + last_hop;
            if slacks.push(slack).is_err() {
                break;
            }
        }
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

/// How many targets, from the lowest, are met.
pub(crate) fn met(slacks: &[f32]) -> usize {
    slacks.iter().take_while(|slack| **slack >= 0.0).count()
}
