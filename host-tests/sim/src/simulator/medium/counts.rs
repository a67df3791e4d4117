//! What has happened on the air.

use serde::Serialize;

/// Counters of a channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct AirCounts {
    /// Frames that were sent.
    pub sent: u64,
    /// Receptions that were lost because frames overlapped.
    pub collided: u64,
    /// Receptions that were lost because the node was sending itself.
    pub unheard: u64,
    /// Times that a node found the channel busy and waited.
    pub deferred: u64,
    /// Frames that found the queue of their radio full.
    pub dropped: u64,
    /// How long all frames together were on the air, µs.
    pub air_time_us: u64,
}
