//! The counters of a relay, taken together.

use uav_relay::Stats;

/// Frames with the right check sequence: each is counted in one of these, at a relay with a key or without one. What is
/// unsigned without a key are messages, which have been counted as received.
pub const fn intact(stats: &Stats, key: bool) -> u32 {
    let unsigned = if key { stats.unsigned } else { 0 };
    stats.received
        + stats.overheard
        + stats.version
        + stats.handshakes
        + stats.malformed
        + stats.foreign
        + stats.misaddressed
        + unsigned
        + stats.forged
        + stats.replayed
}

/// Every counter, in the order of [`Stats`].
pub const fn all(stats: &Stats) -> [u32; 23] {
    let Stats {
        sent,
        repeats,
        sweeps,
        received,
        repeated,
        overheard,
        oversized,
        truncated,
        crc,
        version,
        handshakes,
        unsigned,
        forged,
        replayed,
        malformed,
        foreign,
        misaddressed,
        misdirected,
        mission,
        view,
        views,
        stale,
        samples_refused,
    } = *stats;
    [
        sent,
        repeats,
        sweeps,
        received,
        repeated,
        overheard,
        oversized,
        truncated,
        crc,
        version,
        handshakes,
        unsigned,
        forged,
        replayed,
        malformed,
        foreign,
        misaddressed,
        misdirected,
        mission,
        view,
        views,
        stale,
        samples_refused,
    ]
}
