//! Frame counters as JSON, and the reasons of rejected frames in words.

use serde_json::{Value, json};
use uav_relay::{Duration, Instant, Stats};

/// Returns every counter of `stats` as a JSON object.
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

/// Interval between two checks of the frame counters.
const EVERY: Duration = Duration::from_millis(2_000);

/// Minimum number of frames rejected for one reason between two checks before the reason is logged.
const MANY: u32 = 3;

/// Minimum number of damaged frames between two checks before the log suggests a wrong baud rate.
///
/// The log does not suggest this if an intact frame was received between the two checks.
const DAMAGED: u32 = 10;

/// Detector of reasons why frames are rejected. The detector compares the counters with those at the last check.
#[derive(Debug, Default)]
pub struct RejectionReasons {
    last: Stats,
    check_at: Instant,
    reported: [bool; 5],
}

impl RejectionReasons {
    /// Returns a text about a reason for rejected frames that was not reported before; otherwise `None`.
    ///
    /// `signs` is true if this relay signs its frames.
    pub fn next_reason(&mut self, now: Instant, stats: &Stats, signs: bool) -> Option<String> {
        if now < self.check_at {
            return None;
        }
        self.check_at = now + EVERY;
        let last = core::mem::replace(&mut self.last, *stats);
        let more = |of: fn(&Stats) -> u32| of(stats).saturating_sub(of(&last));
        let whole = more(|stats| stats.received) + more(|stats| stats.handshakes);
        let damaged =
            more(|stats| stats.crc) + more(|stats| stats.truncated) + more(|stats| stats.oversized);
        let (foreign, forged) = (more(|stats| stats.foreign), more(|stats| stats.forged));
        let (unsigned, version) = (more(|stats| stats.unsigned), more(|stats| stats.version));
        let reasons = [
            (
                foreign >= MANY,
                foreign,
                "have another network number: is --network the same at all relays?",
            ),
            (
                forged >= MANY && more(|stats| stats.handshakes) == 0,
                forged,
                "have a wrong signature (tag): is the key in --key-file the same at all relays?",
            ),
            (
                signs && unsigned >= MANY,
                unsigned,
                "are not signed: does the sender have a --key-file?",
            ),
            (
                version >= MANY,
                version,
                if signs {
                    "have another version of the frame format: use the same software version at all relays"
                } else {
                    "are signed, but this relay has no --key-file; or their sender has another software version"
                },
            ),
            (
                whole == 0 && damaged >= DAMAGED,
                damaged,
                "are damaged: is --baud the same at both ends?",
            ),
        ];
        let new = |((is, count, why), told): ((bool, u32, &str), &mut bool)| {
            (is && !core::mem::replace(told, true)).then(|| format!("{count} frames {why}"))
        };
        reasons.into_iter().zip(&mut self.reported).find_map(new)
    }
}
