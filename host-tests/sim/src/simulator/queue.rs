//! What happens when, in order: a virtual clock that jumps from one happening to the next.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use uav_relay::{Instant, Port};

use super::attack::Strike;
use super::medium::AirEvent;

/// Something that happens to one relay.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Happening {
    /// Bytes arrive.
    Bytes {
        /// Where.
        port: Port,
        /// What.
        bytes: Vec<u8>,
    },
    /// It may have something to do.
    Wake,
    /// Bytes arrive on the ground.
    Heard {
        /// What.
        bytes: Vec<u8>,
    },
    /// The ground may have something to do.
    Ask,
    /// An upload begins; its number stands in place of the relay's.
    Upload,
    /// All drones fly on for a step.
    Fly,
    /// Its drone's autopilot is switched off and on.
    Restart,
    /// It goes silent.
    Kill,
    /// It is switched on again.
    Boot,
    /// A partition begins or ends, or a relay ceases to hear another one or hears it again.
    Part,
    /// Something is due on the shared channel; the relay is of no account.
    Air(AirEvent),
    /// All relays measure the interference where they are.
    Listen,
    /// The attacker sends a frame to one of the relays.
    Strike(Strike),
}

/// One happening, at its time. Equal times keep the order in which they were put in.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Entry {
    at: Instant,
    order: u64,
    /// Which relay, counted from 0.
    relay: usize,
    happening: Happening,
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

/// The happenings to come.
#[derive(Debug, Default)]
pub struct Queue {
    entries: BinaryHeap<Reverse<Entry>>,
    order: u64,
}

impl Queue {
    /// Puts in that `happening` happens to `relay` (from 0) at `at`.
    pub fn put(&mut self, at: Instant, relay: usize, happening: Happening) {
        self.entries.push(Reverse(Entry {
            at,
            order: self.order,
            relay,
            happening,
        }));
        self.order += 1;
    }

    /// The next happening: when, to which relay, what.
    pub fn take(&mut self) -> Option<(Instant, usize, Happening)> {
        let Reverse(entry) = self.entries.pop()?;
        Some((entry.at, entry.relay, entry.happening))
    }
}
