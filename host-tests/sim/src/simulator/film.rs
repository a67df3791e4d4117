//! What a run looks like from outside, change by change.

use uav_relay::{Instant, Placement, Side};

/// A relay looks different from here on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shot {
    /// When.
    pub at: Instant,
    /// Which relay, from 1.
    pub relay: u16,
    /// Whether it is switched on.
    pub is_on: bool,
    /// Where it is told to fly, if anywhere; one that is switched off stays where it was told last.
    pub place: Option<Placement>,
    /// Frames that were put on any link so far.
    pub messages: u64,
}

/// A relay has handed over a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sent {
    /// When.
    pub at: Instant,
    /// Which relay, from 1.
    pub relay: u16,
    /// Toward which side; `None` where all in range hear it.
    pub to: Option<Side>,
}

/// A run, from its beginning to its end.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Film {
    /// How relays changed, in order.
    pub shots: Vec<Shot>,
    /// What they said, in order.
    pub sent: Vec<Sent>,
}
