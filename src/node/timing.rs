//! What the layers have in common in keeping time.

use crate::time::{Duration, Instant};

/// How long a relay rests between two portions of a computation, so that a caller's loop gets its turn.
pub(crate) const PAUSE: Duration = Duration::from_micros(250);

/// The earlier of two times.
pub(crate) fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    [a, b].into_iter().flatten().min()
}
