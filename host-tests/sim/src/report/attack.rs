//! What an attacker sent, how the relays counted it, and what it changed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Serialize;

use crate::simulator::attack::Strike;
use crate::simulator::outcome::{Moment, Outcome, Turning};

/// Frames of one kind.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct StruckReport {
    /// Frames sent.
    pub sent: u64,
    /// Of those, frames that a relay took for a neighbour's.
    pub taken: u64,
    /// All of them, by the relay's counter that grew; `received` are those taken.
    pub counted: BTreeMap<&'static str, u64>,
}

/// What an attack came to.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct AttackReport {
    /// Whether frames carried tags.
    pub auth: bool,
    /// Forged frames.
    pub forged: StruckReport,
    /// Recorded frames that were sent again.
    pub replayed: StruckReport,
    /// Whether the run ended otherwise than the same run without the attack.
    pub ended_otherwise: bool,
    /// Relays that ended at another place, or for another target, than without the attack.
    pub moved: u64,
    /// How far from there they ended at most, m; absent if one of them ended without a place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest_m: Option<f64>,
    /// How many places relays took on the way for a target that nobody holds without the attack.
    pub misled: u64,
    /// How often the chain formed anew.
    pub formed: u64,
    /// How often it does without the attack.
    pub formed_without: u64,
    /// How often a relay was told to fly to a place that it must not: a bug if not 0.
    pub unsafe_setpoints: u64,
}

impl AttackReport {
    /// What came of a run with an attack, beside `calm`, the same run without it.
    pub fn new(auth: bool, outcome: &Outcome, calm: &Outcome) -> Self {
        let moved = outcome
            .relays
            .iter()
            .zip(&calm.relays)
            .filter(|(one, other)| {
                one.setpoint != other.setpoint
                    || one.target.map(f32::to_bits) != other.target.map(f32::to_bits)
            });
        let far = moved.clone().map(|(one, other)| {
            let (one, other) = (one.setpoint?, other.setpoint?);
            Some(f64::from(
                (one.x_m - other.x_m).hypot(one.altitude_m - other.altitude_m),
            ))
        });
        Self {
            auth,
            forged: struck(outcome, Strike::Forge),
            replayed: struck(outcome, Strike::Replay),
            ended_otherwise: outcome.ending != calm.ending,
            farthest_m: far
                .collect::<Option<Vec<f64>>>()
                .map(|far| far.into_iter().fold(0.0, f64::max)),
            moved: moved.count() as u64,
            misled: targets(outcome)
                .filter(|target| !targets(calm).any(|other| other == *target))
                .count() as u64,
            formed: formed(outcome),
            formed_without: formed(calm),
            unsafe_setpoints: outcome.unsafe_setpoints,
        }
    }

    /// What it did that it should not have been able to; `None` if nothing.
    pub fn harm(&self) -> Option<String> {
        match (self.moved, self.ended_otherwise) {
            (0, false) => None,
            (0, true) => Some("the attack changed how the run ended".to_owned()),
            (1, _) => Some("the attack moved 1 relay".to_owned()),
            (moved, _) => Some(format!("the attack moved {moved} relays")),
        }
    }

    /// A few lines.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let tags = if self.auth { "with" } else { "without" };
        for (one, kind) in [(&self.forged, "forged"), (&self.replayed, "recorded")] {
            if one.sent > 0 {
                let counted: Vec<String> = one
                    .counted
                    .iter()
                    .map(|(name, count)| format!("{count} {name}"))
                    .collect();
                _ = writeln!(
                    text,
                    "attack on a chain {tags} tags: {} {kind} frames, {} taken; counted as {}",
                    one.sent,
                    one.taken,
                    counted.join(", ")
                );
            }
        }
        _ = match (self.harm(), self.farthest_m) {
            (None, _) => writeln!(
                text,
                "every relay ended where it ends without the attack, to the bit"
            ),
            (Some(harm), Some(far)) => writeln!(text, "{harm}, by {far:.3} m at most"),
            (Some(harm), None) => writeln!(text, "{harm}, and some got no place at all"),
        };
        if self.misled > 0 {
            _ = writeln!(
                text,
                "on the way, relays took {} places for false targets",
                self.misled
            );
        }
        if self.formed != self.formed_without {
            _ = writeln!(
                text,
                "the chain formed anew {} times, without the attack {}",
                self.formed, self.formed_without
            );
        }
        text
    }
}

/// The targets that relays took places for, as their bits.
fn targets(outcome: &Outcome) -> impl Iterator<Item = u32> {
    let converged = |moment: &&Moment| moment.what == Turning::Converged;
    let moments = outcome.moments.iter().filter(converged);
    moments.filter_map(|moment| moment.target.map(f32::to_bits))
}

/// How many views of the chain anybody agreed to.
fn formed(outcome: &Outcome) -> u64 {
    let views: BTreeSet<u32> = outcome
        .moments
        .iter()
        .filter_map(|moment| match moment.what {
            Turning::Reformed { view, .. } => Some(view),
            _ => None,
        })
        .collect();
    views.len() as u64
}

fn struck(outcome: &Outcome, kind: Strike) -> StruckReport {
    let counted: BTreeMap<&'static str, u64> = outcome
        .struck
        .counted
        .iter()
        .filter(|((of, _), _)| *of == kind)
        .map(|((_, name), count)| (*name, *count))
        .collect();
    StruckReport {
        sent: counted.values().sum(),
        taken: counted.get("received").copied().unwrap_or_default(),
        counted,
    }
}
