//! Detected failures of relays.

use std::collections::BTreeMap;

use serde::Serialize;

use super::timeline::seconds;
use crate::simulator::outcome::{Outcome, TimelineEvent};

/// Detected failure of a relay.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct SilenceReport {
    /// Failed relay.
    pub silent: u16,
    /// Neighbour that detected the failure.
    pub noticed_by: u16,
    /// Detection time, s of virtual time.
    pub at_s: f64,
}

/// Reports which neighbours detected the relays that failed. False detections over bad links are left out.
pub(super) fn silences(outcome: &Outcome) -> Vec<SilenceReport> {
    let killed = |index: u16| {
        let at = usize::from(index).checked_sub(1);
        at.and_then(|at| outcome.relays.get(at))
            .is_some_and(|relay| relay.killed.is_some())
    };
    let mut silences: BTreeMap<(u16, u16), f64> = BTreeMap::new();
    for moment in &outcome.moments {
        let Some(other) = moment.other else {
            continue;
        };
        match moment.what {
            TimelineEvent::Lost(_) if killed(other) => {
                silences.insert((moment.relay, other), seconds(moment.at));
            }
            TimelineEvent::Found(_) => {
                silences.remove(&(moment.relay, other));
            }
            _ => {}
        }
    }
    let reports = silences
        .into_iter()
        .map(|((noticed_by, silent), at_s)| SilenceReport {
            silent,
            noticed_by,
            at_s,
        });
    reports.collect()
}
