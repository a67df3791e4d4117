//! Recorded state changes and transmissions of the relays, for an animation.

use uav_relay::{Instant, Placement, Side};

/// Changed state of a relay.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shot {
    /// Time of the change.
    pub at: Instant,
    /// Relay number, from 1.
    pub relay: u16,
    /// True while the relay is switched on.
    pub is_on: bool,
    /// Setpoint, if any; a relay that is switched off keeps its last one.
    pub place: Option<Placement>,
    /// Frames sent on all links so far.
    pub messages: u64,
}

/// Transmission of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sent {
    /// Time of the transmission.
    pub at: Instant,
    /// Relay number, from 1.
    pub relay: u16,
    /// Direction of the transmission; `None` on a shared channel.
    pub to: Option<Side>,
}

/// Film of a whole run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Film {
    /// State changes, in order of time.
    pub shots: Vec<Shot>,
    /// Transmissions, in order of time.
    pub sent: Vec<Sent>,
}
