//! The frames that were put on the air, in the order in which they ended.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use uav_relay::Instant;

/// Where a frame was sent.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Link {
    /// On the channel that all share.
    Shared,
    /// On the link from this node to the one after it; Tx is node 0.
    After(u16),
}

/// A frame that was put on the air.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct OnAir {
    /// When its last bit was sent.
    pub at: Instant,
    /// Frames that end at the same time are in the order in which they were handed over.
    order: u64,
    /// Where.
    pub link: Link,
    /// The frame as it was sent.
    pub bytes: Vec<u8>,
    /// What became of it on the way; empty if it has arrived at all that hear it, as it was sent and in time.
    pub note: String,
}

/// The frames that nobody has taken yet.
#[derive(Debug, Default)]
pub struct Record {
    frames: BinaryHeap<Reverse<OnAir>>,
    order: u64,
}

impl Record {
    /// One more.
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

    /// Those that have ended by `until`, each of them once.
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
