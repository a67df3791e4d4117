//! Counters of the shared channel.

use serde::Serialize;

/// Counters of a channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct AirCounts {
    /// Frames sent.
    pub sent: u64,
    /// Receptions lost because frames overlapped.
    pub collided: u64,
    /// Receptions lost because the receiving node was sending.
    pub unheard: u64,
    /// Back-offs because of a busy channel.
    pub deferred: u64,
    /// Frames dropped because the radio's queue was full.
    pub dropped: u64,
    /// Total time of all frames on the air, µs.
    pub air_time_us: u64,
}
