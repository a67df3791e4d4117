//! Sums of a relay's counters.

use uav_relay::Stats;

/// Returns the number of received frames with a valid CRC, computed as a sum of counters.
///
/// Each such frame is counted in exactly one of these counters. `key` is true if the relay has a signing key. Only with
/// a key it counts unsigned frames in `unsigned`; without a key it accepts them.
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

/// Returns every counter of a relay with its name, in the order of [`Stats`].
pub const fn named(stats: &Stats) -> [(&'static str, u32); 23] {
    // All fields are named, so that the compiler reports a new counter.
    let Stats {
        sent,
        repeats,
        passes_begun: sweeps,
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
        samples_rejected,
    } = *stats;
    [
        ("sent", sent),
        ("repeats", repeats),
        ("sweeps", sweeps),
        ("received", received),
        ("repeated", repeated),
        ("overheard", overheard),
        ("oversized", oversized),
        ("truncated", truncated),
        ("crc", crc),
        ("version", version),
        ("handshakes", handshakes),
        ("unsigned", unsigned),
        ("forged", forged),
        ("replayed", replayed),
        ("malformed", malformed),
        ("foreign", foreign),
        ("misaddressed", misaddressed),
        ("misdirected", misdirected),
        ("mission", mission),
        ("view", view),
        ("views", views),
        ("stale", stale),
        ("samples_rejected", samples_rejected),
    ]
}

/// Returns every counter of a relay, in the order of [`Stats`].
pub fn all(stats: &Stats) -> [u32; 23] {
    named(stats).map(|(_, count)| count)
}
