//! What the layers have in common in keeping time.

use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// How long a relay rests between two portions of a computation, so that a caller's loop gets its turn.
pub(crate) const PAUSE: Duration = Duration::from_micros(250);

/// How many times `dead_after` a lease may take at most.
const LONGEST: u32 = 8;

/// The longest that a relay holds what was agreed on without hearing more.
pub(crate) const fn longest_lease(settings: &Settings) -> Duration {
    settings.dead_after.times(LONGEST)
}

/// How long the first pass may take through a chain of `all` relays and back: where every other frame is lost a hop takes some ten times as
/// long as it can, either way.
pub(crate) fn first_pass(settings: &Settings, all: u16) -> Duration {
    settings.hop_time.times(24 * u32::from(all))
}

/// Tenths of a second, rounded up.
#[inline(never)] // called from several places
pub(crate) fn tenths(span: Duration) -> u16 {
    // In words of 32 bits: nothing else in a relay divides 64 by more than a power of two, and the routine for it takes 900 bytes of flash.
    let micros = u32::try_from(span.as_micros().div_ceil(32)).unwrap_or(u32::MAX);
    u16::try_from(micros.div_ceil(3_125)).unwrap_or(u16::MAX)
}

/// The earlier of two times.
pub(crate) fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    [a, b].into_iter().flatten().min()
}
