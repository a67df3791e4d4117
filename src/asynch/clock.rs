//! The time, as an executor has it.

use core::future::Future;

use crate::time::Instant;

/// The time and its timers, on whatever the executor has: `embassy-time`, `rtic-monotonics`, a virtual clock.
///
/// A delay alone (`embedded-hal-async`'s `DelayNs`) is not enough: a relay is told what time it is.
pub trait Clock {
    /// The time since an epoch of the caller's choosing; never less than before.
    fn now(&self) -> Instant;

    /// Completes once it is `at`, at once if it has been. It is dropped before that, and made anew, whenever something else comes
    /// first.
    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()>;
}

impl<C: Clock> Clock for &C {
    fn now(&self) -> Instant {
        C::now(self)
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        C::sleep_until(self, at)
    }
}
