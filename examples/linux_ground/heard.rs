//! Which relays near by are heard, as far as they were spoken to: one that does not answer for a while is lost.

use std::collections::BTreeMap;

use uav_relay::{Duration, Ground, Instant};
use uav_relay_linux::log::Log;

use crate::report;

/// How long an answer is awaited: a handshake is lost now and then, and asked for again with the next measurement.
const PATIENCE: Duration = Duration::from_millis(5_000);

/// How a relay is that was heard once: that, or since when it does not answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Heard,
    Silent(Instant),
    Lost,
}

/// All that were.
#[derive(Debug, Default)]
pub(crate) struct Hearing(BTreeMap<u16, State>);

impl Hearing {
    /// Looks who answers, says what has changed, and when to come back at the latest.
    pub(crate) fn look(&mut self, now: Instant, ground: &Ground, log: &Log) -> Option<Instant> {
        for (node, answers) in ground.near() {
            let before = self.0.get(&node).copied();
            let state = match (before, answers) {
                (None, false) => continue,
                (_, true) => State::Heard,
                (Some(State::Heard), false) => State::Silent(now),
                (Some(State::Silent(since)), false) if since + PATIENCE <= now => State::Lost,
                (Some(other), false) => other,
            };
            self.0.insert(node, state);
            match (before, state) {
                (None | Some(State::Lost), State::Heard) => report::heard(log, now, node, true),
                (Some(State::Silent(_)), State::Lost) => report::heard(log, now, node, false),
                _ => {}
            }
        }
        let ends = self.0.values().filter_map(|state| match state {
            State::Silent(since) => Some(*since + PATIENCE),
            _ => None,
        });
        ends.min()
    }

    /// The relays that are heard.
    pub(crate) fn nodes(&self) -> Vec<u16> {
        let heard = self.0.iter().filter(|(_, state)| **state != State::Lost);
        heard.map(|(node, _)| *node).collect()
    }
}
