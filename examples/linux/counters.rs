//! Frame counters as JSON.

use serde_json::{Value, json};
use uav_relay::Stats;

/// Returns every counter of `stats`.
#[must_use]
pub fn counted(stats: &Stats) -> Value {
    json!({
        "sent": stats.sent,
        "repeats": stats.repeats,
        "sweeps": stats.passes_begun,
        "received": stats.received,
        "repeated": stats.repeated,
        "overheard": stats.overheard,
        "refused": stats.rejected(),
        "oversized": stats.oversized,
        "truncated": stats.truncated,
        "crc": stats.crc,
        "version": stats.version,
        "handshakes": stats.handshakes,
        "unsigned": stats.unsigned,
        "forged": stats.forged,
        "replayed": stats.replayed,
        "malformed": stats.malformed,
        "foreign": stats.foreign,
        "misaddressed": stats.misaddressed,
        "misdirected": stats.misdirected,
        "mission": stats.mission,
        "view": stats.view,
        "views": stats.views,
        "stale": stats.stale,
        "samples_rejected": stats.samples_rejected,
    })
}
