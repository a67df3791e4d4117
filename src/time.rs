//! Points in time and spans of it, as integers: the crate is told the time and never reads a clock.

use core::ops::Add;

/// A point in time, in microseconds since an epoch of the caller's choosing.
///
/// Arithmetic saturates: a clock that runs past the end stands still instead of wrapping.
///
/// ```
/// use uav_relay::{Duration, Instant};
///
/// let start = Instant::from_millis(1_000);
/// assert_eq!((start + Duration::from_micros(250)).since(start).as_micros(), 250);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instant {
    micros: u64,
}

/// A span of time, in microseconds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration {
    micros: u64,
}

impl Instant {
    /// The epoch itself.
    pub const ZERO: Self = Self { micros: 0 };

    /// The instant `micros` microseconds after the epoch.
    pub const fn from_micros(micros: u64) -> Self {
        Self { micros }
    }

    /// The instant `millis` milliseconds after the epoch.
    pub const fn from_millis(millis: u64) -> Self {
        Self {
            micros: millis.saturating_mul(1_000),
        }
    }

    /// Microseconds since the epoch.
    pub const fn as_micros(self) -> u64 {
        self.micros
    }

    /// The span from `earlier` to `self`; zero when `earlier` is the later one.
    #[inline(never)] // as `add`
    pub const fn since(self, earlier: Self) -> Duration {
        Duration {
            micros: self.micros.saturating_sub(earlier.micros),
        }
    }
}

impl Duration {
    /// A span of `micros` microseconds.
    pub const fn from_micros(micros: u64) -> Self {
        Self { micros }
    }

    /// A span of `millis` milliseconds.
    pub const fn from_millis(millis: u64) -> Self {
        Self {
            micros: millis.saturating_mul(1_000),
        }
    }

    /// The span in microseconds.
    pub const fn as_micros(self) -> u64 {
        self.micros
    }

    /// `times` as long, saturating.
    #[inline(never)] // 70 bytes of flash where it stands
    pub const fn times(self, times: u32) -> Self {
        Self {
            micros: self.micros.saturating_mul(times as u64),
        }
    }
}

impl Add<Duration> for Instant {
    type Output = Self;

    #[inline(never)] // it stands in a hundred places
    fn add(self, span: Duration) -> Self {
        Self {
            micros: self.micros.saturating_add(span.micros),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Duration, Instant};

    #[test]
    fn arithmetic_saturates_at_both_ends() {
        let end = Instant::from_micros(u64::MAX);
        assert_eq!(end + Duration::from_millis(1), end);
        assert_eq!(Instant::ZERO.since(end), Duration::from_micros(0));
        assert_eq!(Instant::from_millis(u64::MAX), end);
        assert_eq!(
            Duration::from_micros(u64::MAX).times(2).as_micros(),
            u64::MAX
        );
        assert_eq!(
            Instant::from_millis(3).since(Instant::from_millis(1)),
            Duration::from_millis(2)
        );
    }
}
