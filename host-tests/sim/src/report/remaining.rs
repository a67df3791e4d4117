//! Relays that are in the chain at the end of a run, and those that are not.

use serde::Serialize;

use crate::simulator::outcome::{Ending, Outcome, RelayEnd};

/// Relay that is no longer in the chain.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LostReport {
    /// Relay number in the mission, from 1.
    pub index: u16,
    /// Last setpoint: distance from the transmitter, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f64>,
    /// Last setpoint: distance from the line, m, positive to the right.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f64>,
    /// Last setpoint: altitude, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h_m: Option<f64>,
    /// Last version of the relay's mission; absent without uploads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Reason: `silent`; `apart` (alive, cannot reach the others); `no quorum` (alive, no chain is left).
    pub why: &'static str,
}

/// Returns the relays of the chain at the end of the run, with their numbers from 1, in order from Tx.
///
/// The chain is the largest complete view, or all living relays if there is none. On separate links a failure is only reported:
/// all relays stay. Without a quorum there is no chain.
pub(super) fn left(outcome: &Outcome) -> Vec<(u16, &RelayEnd)> {
    let all: Vec<(u16, &RelayEnd)> = (1..).zip(&outcome.relays).collect();
    match outcome.ending {
        Ending::Broken => return all,
        Ending::NoQuorum => return Vec::new(),
        _ => {}
    }
    let living: Vec<_> = all
        .into_iter()
        .filter(|(_, relay)| relay.killed.is_none())
        .collect();
    let views = living.iter().map(|(_, relay)| relay.view);
    views
        .map(|view| {
            let part = living.iter().filter(|(_, relay)| relay.view == view);
            (view, part.copied().collect::<Vec<_>>())
        })
        .filter(|(_, part)| is_counted(part))
        .max_by_key(|(view, part)| (part.len(), *view))
        .map_or(living.clone(), |(_, part)| part)
}

/// Returns true if these are all relays of their view.
fn is_counted(part: &[(u16, &RelayEnd)]) -> bool {
    (1..)
        .zip(part)
        .all(|(place, (_, relay))| relay.index == place && usize::from(relay.relays) == part.len())
}

/// Reports the relays that are not in `left`.
pub(super) fn lost(outcome: &Outcome, left: &[(u16, &RelayEnd)]) -> Vec<LostReport> {
    (1..)
        .zip(&outcome.relays)
        .filter(|(index, _)| !left.iter().any(|(other, _)| other == index))
        .map(|(index, relay)| LostReport {
            index,
            x_m: relay.setpoint.map(|place| f64::from(place.x_m)),
            y_m: relay.setpoint.map(|place| f64::from(place.y_m)),
            h_m: relay.setpoint.map(|place| f64::from(place.altitude_m)),
            version: outcome.offered().map(|_| relay.version),
            why: match outcome.ending {
                _ if relay.killed.is_some() => "silent",
                Ending::NoQuorum => "no quorum",
                _ => "apart",
            },
        })
        .collect()
}
