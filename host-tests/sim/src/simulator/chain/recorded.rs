//! Recording of transmitted frames.

use std::fmt::Write as _;

use uav_relay::{Instant, Port, Side};

use super::super::faults::Arrival;
use super::super::record::{Link, OnAir};
use super::receiver::Receiver;
use super::state::Chain;

impl Chain {
    /// Removes and returns the frames sent by `until`, ordered by their end, if recording is on.
    pub fn frames(&mut self, until: Instant) -> Vec<OnAir> {
        self.record
            .as_mut()
            .map(|record| record.take(until))
            .unwrap_or_default()
    }

    /// Returns the time of a frame's last bit from its arrival time.
    pub(super) fn sent_at(&self, arrives: Instant) -> Instant {
        let latency = self.setup.link.latency.as_micros();
        Instant::from_micros(arrives.as_micros().saturating_sub(latency))
    }

    pub(super) fn keep_frame(&mut self, at: Instant, link: Link, frame: &[u8], note: String) {
        if let Some(record) = &mut self.record {
            record.put(at, link, frame, note);
        }
    }

    /// Appends to `note` the faults of `frame` on its path to `receiver`.
    pub(super) fn remark(
        &self,
        note: &mut String,
        receiver: Receiver,
        frame: &[u8],
        arrivals: &[Arrival],
    ) {
        if self.record.is_none() {
            return;
        }
        let mut fates = Vec::new();
        match arrivals {
            [] => fates.push("lost"),
            [_] => {}
            _ => fates.push("twice"),
        }
        if arrivals.iter().any(|arrival| arrival.bytes != frame) {
            fates.push("changed");
        }
        if arrivals.iter().any(|arrival| arrival.late > 0) {
            fates.push("late");
        }
        if fates.is_empty() {
            return;
        }
        let whom = match receiver {
            Receiver::Relay(at) => format!("relay {}", at + 1),
            Receiver::Ground(at) => match self.stations.get(at).map(|station| station.end) {
                Some(Side::Downstream) => "Rx".to_owned(),
                _ => "Tx".to_owned(),
            },
        };
        if !note.is_empty() {
            note.push_str("; ");
        }
        _ = write!(note, "at {whom}: {}", fates.join(", "));
    }
}

/// Returns the link at `port` of relay `index` (from 0).
pub(super) fn link(index: usize, port: Port) -> Link {
    let number = u16::try_from(index).unwrap_or(u16::MAX);
    match port {
        Port::Shared => Link::Shared,
        Port::Upstream => Link::After(number),
        Port::Downstream => Link::After(number.saturating_add(1)),
    }
}
