//! Recorded frames, ordered by the end of their transmission.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use uav_relay::Instant;

/// Link of a frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Link {
    /// The shared channel.
    Shared,
    /// The link between this node and the next one; Tx is node 0.
    After(u16),
}

/// Transmitted frame.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct OnAir {
    /// Time of its last bit.
    pub at: Instant,
    /// Order of transmission, for frames that end at the same time.
    order: u64,
    /// Link of the frame.
    pub link: Link,
    /// Bytes as sent.
    pub bytes: Vec<u8>,
    /// Faults on the path; empty if all receivers got the frame intact and in time.
    pub note: String,
}

/// Recorded frames that were not read yet.
#[derive(Debug, Default)]
pub struct Record {
    frames: BinaryHeap<Reverse<OnAir>>,
    order: u64,
}

impl Record {
    /// Adds a frame.
    pub fn put(&mut self, at: Instant, link: Link, bytes: &[u8], note: String) {
        self.frames.push(Reverse(OnAir {
            at,
            order: self.order,
            link,
            bytes: bytes.to_vec(),
            note,
        }));
        self.order += 1;
    }

    /// Removes and returns the frames that ended by `until`.
    pub fn take(&mut self, until: Instant) -> Vec<OnAir> {
        let mut over = Vec::new();
        while let Some(Reverse(next)) = self.frames.peek()
            && next.at <= until
        {
            over.extend(self.frames.pop().map(|Reverse(frame)| frame));
        }
        over
    }
}
