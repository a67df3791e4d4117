//! Recording of a run, as played by the page.

use std::collections::BTreeMap;
use std::collections::btree_map::OccupiedEntry;

use serde::Serialize;
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::{Instant, Placement, Side};
use uav_relay_scenario::number::narrow;
use uav_relay_sim::cli::Prepared;
use uav_relay_sim::report::seconds;
use uav_relay_sim::simulator::outcome::{Outcome, Shot, Transmission};

/// Maximum number of states of the chain in a recording.
///
/// If there are more states, states that are close in time are merged.
const STANDS: usize = 600;

/// Maximum number of frames in a recording; later frames are left out.
const FRAMES: usize = 20_000;

#[derive(Serialize)]
pub(crate) struct FilmTold {
    /// States of the chain in order of time: one for each time at which something has changed.
    stands: Vec<StandTold>,
    /// Frames that were sent, each with its time in s, sender's index, and direction.
    ///
    /// Direction -1 is toward Tx, 1 toward Rx, and 0 to all relays in range.
    sent: Vec<(f64, u16, i8)>,
}

#[derive(Serialize)]
struct StandTold {
    at_s: f64,
    /// Relays that changed: index, true if switched on, and x, y, altitude in m.
    ///
    /// The position is `None` until the relay has agreed on a position.
    relays: Vec<(u16, bool, Option<[f32; 3]>)>,
    /// SIR of every hop, linear, from Tx to Rx.
    ///
    /// The hops connect the relays that are on and have a position. Empty if there are no such relays.
    sirs: Vec<f32>,
    /// SIR of every hop in the direction from Rx to Tx, linear; empty if data flows only from Tx to Rx.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    backs: Vec<f32>,
    /// Number of frames sent by all nodes from the start of the run until this state's time `at_s`.
    messages: u64,
    /// Interferer as the relays estimate it: power in W, x and y in m; `None` without an estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    believed: Option<[f32; 3]>,
}

#[derive(Default)]
struct Change {
    relays: BTreeMap<u16, (bool, Option<Placement>)>,
    messages: u64,
    /// New interference estimate of the relays.
    ///
    /// `None` if the estimate has not changed at this change's time, or if the relays do not measure.
    believed: Option<InterferenceEstimate>,
}

impl FilmTold {
    pub(crate) fn of(run: &Prepared<'_>, outcome: &Outcome) -> Self {
        let film = outcome.film.clone().unwrap_or_default();
        Self {
            stands: stands(run, changes(&film.shots, outcome)),
            sent: film.sent.iter().take(FRAMES).map(frame).collect(),
        }
    }
}

fn changes(shots: &[Shot], outcome: &Outcome) -> BTreeMap<Instant, Change> {
    let mut changes: BTreeMap<Instant, Change> = BTreeMap::new();
    for shot in shots {
        let change = changes.entry(shot.at).or_default();
        change.relays.insert(shot.relay, (shot.is_on, shot.place));
        change.messages = shot.messages;
    }
    for stand in &outcome.snapshots {
        changes.entry(stand.at).or_default().believed = Some(stand.believed.estimate);
    }
    let last = changes.entry(outcome.ended).or_default();
    last.messages = outcome.messages;
    thinned(changes)
}

/// Merges changes that are close in time, so that a recording has at most [`STANDS`] states.
///
/// A merged change has the time of the latest change in it.
fn thinned(all: BTreeMap<Instant, Change>) -> BTreeMap<Instant, Change> {
    let mut all = all;
    let mut apart_us = 1_000;
    while all.len() > STANDS {
        let mut kept: BTreeMap<Instant, Change> = BTreeMap::new();
        for (at, change) in all {
            let near = kept
                .last_entry()
                .filter(|last| at.as_micros() - last.key().as_micros() < apart_us);
            let before = near.map(OccupiedEntry::remove).unwrap_or_default();
            let mut relays = before.relays;
            relays.extend(change.relays);
            let both = Change {
                relays,
                messages: before.messages.max(change.messages),
                believed: change.believed.or(before.believed),
            };
            kept.insert(at, both);
        }
        all = kept;
        apart_us *= 2;
    }
    all
}

fn stands(run: &Prepared<'_>, changes: BTreeMap<Instant, Change>) -> Vec<StandTold> {
    let mut now: BTreeMap<u16, (bool, Option<Placement>)> = BTreeMap::new();
    let mut messages = 0;
    let mut believed = None;
    let tell = |(at, change): (Instant, Change)| {
        now.extend(&change.relays);
        messages = change.messages.max(messages);
        believed = change.believed.or(believed);
        let mut chain: Vec<(u16, Placement)> = now
            .iter()
            .filter_map(|(&index, &(is_on, place))| place.filter(|_| is_on).map(|at| (index, at)))
            .collect();
        chain.sort_by(|(_, one), (_, other)| one.x_m.total_cmp(&other.x_m));
        StandTold {
            at_s: seconds(at),
            relays: change.relays.into_iter().map(told).collect(),
            sirs: run.sirs_at(at, &chain).into_iter().map(narrow).collect(),
            backs: run
                .sirs_back_at(at, &chain)
                .into_iter()
                .map(narrow)
                .collect(),
            messages,
            believed: match believed {
                Some(InterferenceEstimate::Source { source, .. }) => {
                    Some([source.power_w, source.x_m, source.y_m])
                }
                _ => None,
            },
        }
    };
    changes.into_iter().map(tell).collect()
}

fn told(
    (index, (is_on, place)): (u16, (bool, Option<Placement>)),
) -> (u16, bool, Option<[f32; 3]>) {
    let place = place.map(|at| [at.x_m, at.y_m, at.altitude_m]);
    (index, is_on, place)
}

fn frame(sent: &Transmission) -> (f64, u16, i8) {
    let to = match sent.to {
        Some(Side::Upstream) => -1,
        Some(Side::Downstream) => 1,
        None => 0,
    };
    (seconds(sent.at), sent.relay, to)
}
