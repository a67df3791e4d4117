//! Report of an attack: frames sent, their classification by the relays, and the effect.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Serialize;

use crate::simulator::attack::AttackKind;
use crate::simulator::outcome::{Moment, Outcome, TimelineEvent};

/// Attacker's frames of one kind.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct StruckReport {
    /// Frames sent.
    pub sent: u64,
    /// Frames that a relay accepted as a neighbour's.
    pub taken: u64,
    /// Frames by the relay's counter that grew; `received` are the accepted ones.
    pub counted: BTreeMap<&'static str, u64>,
}

/// Result of an attack.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct AttackReport {
    /// True if frames carried tags.
    pub auth: bool,
    /// Forged frames.
    pub forged: StruckReport,
    /// Replayed frames.
    pub replayed: StruckReport,
    /// True if the run with the attack ended differently from the run without the attack.
    pub ended_otherwise: bool,
    /// Relays whose final position or target differs from the run without the attack.
    pub moved: u64,
    /// Largest displacement of those relays (x and altitude), m; absent if one has no position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest_m: Option<f64>,
    /// Positions that relays accepted for targets that do not occur without the attack.
    pub misled: u64,
    /// Views that the chain formed.
    pub formed: u64,
    /// Views that the chain forms without the attack.
    pub formed_without: u64,
    /// Setpoints outside their limits; nonzero is a bug.
    pub unsafe_setpoints: u64,
}

impl AttackReport {
    /// Compares a run with an attack to `calm`, the same run without it.
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
            forged: struck(outcome, AttackKind::Forge),
            replayed: struck(outcome, AttackKind::Replay),
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

    /// Describes the harm done by the attack; `None` if there was none.
    pub fn harm(&self) -> Option<String> {
        match (self.moved, self.ended_otherwise) {
            (0, false) => None,
            (0, true) => Some("the attack changed how the run ended".to_owned()),
            (1, _) => Some("the attack moved 1 relay".to_owned()),
            (moved, _) => Some(format!("the attack moved {moved} relays")),
        }
    }

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
                    "attack on a chain {tags} tags: {} {kind} frames, {} accepted; counted as {}",
                    one.sent,
                    one.taken,
                    counted.join(", ")
                );
            }
        }
        _ = match (self.harm(), self.farthest_m) {
            (None, _) => writeln!(
                text,
                "the final position of every relay is bit-identical to that of a run without the attack"
            ),
            (Some(harm), Some(far)) => writeln!(text, "{harm}, by {far:.3} m at most"),
            (Some(harm), None) => writeln!(text, "{harm}, and some got no position at all"),
        };
        if self.misled > 0 {
            _ = writeln!(
                text,
                "meanwhile, relays took {} positions for target SIRs that do not occur without the attack",
                self.misled
            );
        }
        if self.formed != self.formed_without {
            _ = writeln!(
                text,
                "agreed memberships (views) of the chain: {}, without the attack {}",
                self.formed, self.formed_without
            );
        }
        text
    }
}

/// Returns the accepted targets as bit patterns.
fn targets(outcome: &Outcome) -> impl Iterator<Item = u32> {
    let converged = |moment: &&Moment| moment.what == TimelineEvent::Converged;
    let moments = outcome.moments.iter().filter(converged);
    moments.filter_map(|moment| moment.target.map(f32::to_bits))
}

/// Returns the number of accepted views.
fn formed(outcome: &Outcome) -> u64 {
    let views: BTreeSet<u32> = outcome
        .moments
        .iter()
        .filter_map(|moment| match moment.what {
            TimelineEvent::ViewAccepted { view, .. } => Some(view),
            _ => None,
        })
        .collect();
    views.len() as u64
}

fn struck(outcome: &Outcome, kind: AttackKind) -> StruckReport {
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
