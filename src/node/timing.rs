//! Durations that several layers share.

use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Pause between two portions of a computation, so that the caller's loop can run.
pub(crate) const PAUSE: Duration = Duration::from_micros(250);

/// Maximum duration of a lease, as a multiple of `dead_after`.
const LONGEST: u32 = 8;

/// Returns the maximum duration of a lease.
pub(crate) const fn longest_lease(settings: &Settings) -> Duration {
    settings.dead_after.times(LONGEST)
}

/// Returns the maximum round trip of the first pass through `all` relays with half of the frames lost.
pub(crate) fn first_pass(settings: &Settings, all: u16) -> Duration {
    settings.hop_time.times(24 * u32::from(all))
}

/// Converts a duration to tenths of a second, rounded up.
#[inline(never)] // called from several places
pub(crate) fn tenths(span: Duration) -> u16 {
    // Uses 32-bit words: the 64-bit division, which nothing else in a relay needs, takes 900 bytes of flash.
    let micros = u32::try_from(span.as_micros().div_ceil(32)).unwrap_or(u32::MAX);
    u16::try_from(micros.div_ceil(3_125)).unwrap_or(u16::MAX)
}

/// Returns the earlier of two times; `None` is later than any.
pub(crate) fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    [a, b].into_iter().flatten().min()
}
