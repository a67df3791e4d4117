//! Who noticed that a relay went silent.

use std::collections::BTreeMap;

use serde::Serialize;

use super::timeline::seconds;
use crate::simulator::outcome::{Outcome, Turning};

/// A relay whose silence was noticed.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct SilenceReport {
    /// The relay that went silent.
    pub silent: u16,
    /// The neighbour that noticed.
    pub noticed_by: u16,
    /// When it had been silent for long enough, s of virtual time.
    pub at_s: f64,
}

/// Who noticed the relays that really went silent; over a bad link a living one may be missed for a while as well.
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
            Turning::Lost(_) if killed(other) => {
                silences.insert((moment.relay, other), seconds(moment.at));
            }
            Turning::Found(_) => {
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
