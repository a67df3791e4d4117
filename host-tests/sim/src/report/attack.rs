//! Report of an attack: frames sent, their classification by the relays, and the effect.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Serialize;

use crate::simulator::attack::AttackKind;
use crate::simulator::outcome::{Moment, Outcome, TimelineEvent};

/// Counts of the attacker's frames of one kind, forged or replayed.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct AttackCountsReport {
    /// Number of frames that the attacker sent.
    pub sent: u64,
    /// Number of the attacker's frames that a relay mistook for frames of a neighbour and accepted.
    pub taken: u64,
    /// Number of the attacker's frames for each counter of the receiving relay that the frames incremented.
    ///
    /// `received` counts accepted frames. Each of the remaining counters stands for a reason of rejection.
    pub counted: BTreeMap<&'static str, u64>,
}

/// Result of a run with an attack, in comparison with the same run without the attack.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct AttackReport {
    /// True if the relays signed their frames.
    pub auth: bool,
    /// Numbers of forged frames: sent, accepted, and counted by the relays.
    pub forged: AttackCountsReport,
    /// Numbers of replayed frames: sent, accepted, and counted by the relays.
    pub replayed: AttackCountsReport,
    /// True if the attack changed the reason for which the run ended.
    pub ended_otherwise: bool,
    /// Number of relays for which the attack changed the final position or the target SIR.
    pub moved: u64,
    /// Largest distance, in x and altitude, by which the attack moved a relay's final position, m.
    ///
    /// Absent if one of the relays in `moved` has no position, either with or without the attack.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest_m: Option<f64>,
    /// Number of accepted positions with a target SIR that never occurs in the run without the attack. Each such
    /// position shows that the attack misled a relay.
    pub misled: u64,
    /// Number of views that the relays accepted under the attack. A view is an agreed set of the chain's members.
    pub formed: u64,
    /// Number of views that the relays accepted in the run without the attack. A view is an agreed set of the chain's
    /// members.
    pub formed_without: u64,
    /// Number of setpoints in the attacked run outside of the mission's limits or the geofence. Nonzero is a bug.
    pub unsafe_setpoints: u64,
}

impl AttackReport {
    /// Compares the outcomes of two runs: `outcome` with the attack, and `calm` without it.
    ///
    /// `auth` is true if the relays signed their frames.
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
            forged: attack_counts(outcome, AttackKind::Forge),
            replayed: attack_counts(outcome, AttackKind::Replay),
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

    /// Describes the harm done by the attack; `None` if it did no harm.
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
        for (one, kind) in [(&self.forged, "forged"), (&self.replayed, "replayed")] {
            if one.sent > 0 {
                let counted: Vec<String> = one
                    .counted
                    .iter()
                    .map(|(name, count)| format!("{count} {}", in_words(name)))
                    .collect();
                _ = writeln!(
                    text,
                    "attack on a chain {tags} signed frames: {} {kind} frames, {} accepted; the relays counted {}",
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
            (Some(harm), None) => writeln!(text, "{harm}, and some relays got no position at all"),
        };
        if self.misled > 0 {
            _ = writeln!(
                text,
                "during the attack relays accepted {} positions for target SIRs that do not occur in a run without the attack",
                self.misled
            );
        }
        if self.formed != self.formed_without {
            _ = writeln!(
                text,
                "agreements on the chain's members: {} with the attack, {} without it",
                self.formed, self.formed_without
            );
        }
        text
    }
}

/// Returns the target SIR of each position that a relay accepted. The values are bit patterns for exact comparison.
fn targets(outcome: &Outcome) -> impl Iterator<Item = u32> {
    let converged = |moment: &&Moment| moment.what == TimelineEvent::Converged;
    let moments = outcome.moments.iter().filter(converged);
    moments.filter_map(|moment| moment.target.map(f32::to_bits))
}

/// Returns the number of different views (memberships of the chain) that relays accepted.
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

/// Returns the name of a counter as it reads after a number of frames.
fn in_words(counter: &str) -> &str {
    match counter {
        "overheard" => "between other relays",
        "crc" => "with a wrong CRC",
        "mission" => "of another mission",
        "view" => "of another view",
        other => other,
    }
}

fn attack_counts(outcome: &Outcome, kind: AttackKind) -> AttackCountsReport {
    let counted: BTreeMap<&'static str, u64> = outcome
        .attack_counts
        .counted
        .iter()
        .filter(|((of, _), _)| *of == kind)
        .map(|((_, name), count)| (*name, *count))
        .collect();
    AttackCountsReport {
        sent: counted.values().sum(),
        taken: counted.get("received").copied().unwrap_or_default(),
        counted,
    }
}
