//! Time and timers of an executor.

use core::future::Future;

use crate::time::Instant;

/// Time and timers of an executor: `embassy-time`, `rtic-monotonics`, a virtual clock. A delay alone (`embedded-hal-async`'s
/// `DelayNs`) is not enough, because the relay needs the current time.
pub trait Clock {
    /// Returns the time since an arbitrary epoch; never decreases.
    fn now(&self) -> Instant;

    /// Completes at time `at`, at once if that has passed. The future is dropped and created anew whenever another event comes
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
