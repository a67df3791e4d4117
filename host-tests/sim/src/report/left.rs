//! Who is left of a chain, and who is not.

use serde::Serialize;

use crate::simulator::outcome::{Ending, Outcome, RelayEnd};

/// A relay that is not in the chain any more.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LostReport {
    /// Its number in the mission, from 1.
    pub index: u16,
    /// Where it was told to fly last: distance from the transmitter, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f64>,
    /// Distance from the line there, m: to its right above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f64>,
    /// Altitude there, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h_m: Option<f64>,
    /// Version of the mission that it flies, or flew when it went silent; absent where nothing was uploaded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// `silent` if it went silent; `apart` if it lives but cannot reach the others; `cut` if it lives and no chain is left.
    pub why: &'static str,
}

/// The relays that are in the chain when the run has ended, each with its number from 1, in order from Tx.
///
/// That is the largest part whose relays have all been counted with each other; where there is none, all that live. On wires
/// a break is only reported: there nobody is left out. Where no part is large enough to go on, there is no chain.
pub(super) fn left(outcome: &Outcome) -> Vec<(u16, &RelayEnd)> {
    let all: Vec<(u16, &RelayEnd)> = (1..).zip(&outcome.relays).collect();
    match outcome.ending {
        Ending::Broken => return all,
        Ending::Cut => return Vec::new(),
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

/// Whether these are all the relays of their view.
fn is_counted(part: &[(u16, &RelayEnd)]) -> bool {
    (1..)
        .zip(part)
        .all(|(place, (_, relay))| relay.index == place && usize::from(relay.relays) == part.len())
}

/// The relays that are not among those left.
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
                Ending::Cut => "cut",
                _ => "apart",
            },
        })
        .collect()
}
