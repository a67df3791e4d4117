//! Event queue of the virtual clock.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use uav_relay::{Instant, Port};

use super::attack::AttackKind;
use super::medium::AirEvent;

/// Event of a relay or of the whole run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum QueuedEvent {
    /// Bytes arrive at the relay.
    Bytes {
        /// Receiving port.
        port: Port,
        /// Received bytes.
        bytes: Vec<u8>,
    },
    /// The relay's timer expires.
    Wake,
    /// Bytes arrive at a ground station.
    Heard {
        /// Received bytes.
        bytes: Vec<u8>,
    },
    /// A ground station's timer expires.
    Ask,
    /// An upload begins; the relay index is the upload's number.
    Upload,
    /// Time step of all drones.
    Fly,
    /// The autopilot of the relay's drone restarts.
    Restart,
    /// The relay goes silent.
    Kill,
    /// The relay is switched on again.
    Boot,
    /// A partition or a one-way link failure begins or ends.
    Part,
    /// An event of the shared channel; the relay index is unused.
    Air(AirEvent),
    /// Interference measurement of all relays.
    Listen,
    /// The attacker sends a frame to a relay.
    AttackKind(AttackKind),
}

/// Queued event. Events of the same time keep their order of insertion.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Entry {
    at: Instant,
    order: u64,
    relay: usize,
    happening: QueuedEvent,
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.at, self.order).cmp(&(other.at, other.order))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Pending events.
#[derive(Debug, Default)]
pub struct Queue {
    entries: BinaryHeap<Reverse<Entry>>,
    order: u64,
}

impl Queue {
    /// Schedules `happening` for `relay` (from 0) at `at`.
    pub fn put(&mut self, at: Instant, relay: usize, happening: QueuedEvent) {
        self.entries.push(Reverse(Entry {
            at,
            order: self.order,
            relay,
            happening,
        }));
        self.order += 1;
    }

    /// Removes the next event and returns its time, relay and kind.
    pub fn take(&mut self) -> Option<(Instant, usize, QueuedEvent)> {
        let Reverse(entry) = self.entries.pop()?;
        Some((entry.at, entry.relay, entry.happening))
    }
}
