//! Nearby relays that answer this station. A relay that does not answer for a while is lost.

use std::collections::BTreeMap;

use uav_relay::{Duration, Ground, Instant};
use uav_relay_linux::log::Log;

use crate::report;

/// Time without an answer after which a relay counts as lost.
///
/// It is long enough for a second handshake if the first one was lost.
const LOST_AFTER: Duration = Duration::from_millis(5_000);

/// State of a nearby relay that has answered this station at least once.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Heard,
    Silent(Instant),
    Lost,
}

#[derive(Debug, Default)]
pub(crate) struct NearbyRelays(BTreeMap<u16, State>);

impl NearbyRelays {
    /// Records which nearby relays answer this station, and logs changes.
    ///
    /// Returns the time at which a silent relay will count as lost; `None` if no relay is silent.
    pub(crate) fn update(&mut self, now: Instant, ground: &Ground, log: &Log) -> Option<Instant> {
        for (node, answers) in ground.relays_in_reach() {
            let before = self.0.get(&node).copied();
            let state = match (before, answers) {
                (None, false) => continue,
                (_, true) => State::Heard,
                (Some(State::Heard), false) => State::Silent(now),
                (Some(State::Silent(since)), false) if since + LOST_AFTER <= now => State::Lost,
                (Some(other), false) => other,
            };
            self.0.insert(node, state);
            match (before, state) {
                (None | Some(State::Lost), State::Heard) => report::received(log, now, node, true),
                (Some(State::Silent(_)), State::Lost) => report::received(log, now, node, false),
                _ => {}
            }
        }
        let ends = self.0.values().filter_map(|state| match state {
            State::Silent(since) => Some(*since + LOST_AFTER),
            _ => None,
        });
        ends.min()
    }

    pub(crate) fn nodes(&self) -> Vec<u16> {
        let heard = self.0.iter().filter(|(_, state)| **state != State::Lost);
        heard.map(|(node, _)| *node).collect()
    }
}
