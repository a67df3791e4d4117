//! Instants and durations as integers. The crate receives the time from its caller and never reads a clock.
//!
//! Random numbers (`Jitter`) are for timing and session numbers only; positions never depend on them.

use core::ops::Add;

/// A point in time, in microseconds since an epoch of the caller's choosing.
///
/// Arithmetic saturates instead of wrapping.
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

/// A duration, in microseconds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration {
    micros: u64,
}

impl Instant {
    /// Instant of the epoch: 0 microseconds.
    pub const ZERO: Self = Self { micros: 0 };

    /// Returns the instant `micros` microseconds after the epoch.
    pub const fn from_micros(micros: u64) -> Self {
        Self { micros }
    }

    /// Returns the instant `millis` milliseconds after the epoch.
    pub const fn from_millis(millis: u64) -> Self {
        Self {
            micros: millis.saturating_mul(1_000),
        }
    }

    /// Returns the microseconds since the epoch.
    pub const fn as_micros(self) -> u64 {
        self.micros
    }

    /// Returns the time from `earlier` to this instant; zero if `earlier` is later.
    #[inline(never)] // as `add`
    pub const fn since(self, earlier: Self) -> Duration {
        Duration {
            micros: self.micros.saturating_sub(earlier.micros),
        }
    }
}

impl Duration {
    /// Returns a duration of `micros` microseconds.
    pub const fn from_micros(micros: u64) -> Self {
        Self { micros }
    }

    /// Returns a duration of `millis` milliseconds.
    pub const fn from_millis(millis: u64) -> Self {
        Self {
            micros: millis.saturating_mul(1_000),
        }
    }

    /// Returns the duration in microseconds.
    pub const fn as_micros(self) -> u64 {
        self.micros
    }

    /// Returns the duration times `times`, saturating.
    #[inline(never)] // otherwise 70 bytes of flash at each call
    pub const fn times(self, times: u32) -> Self {
        Self {
            micros: self.micros.saturating_mul(times as u64),
        }
    }
}

impl Add<Duration> for Instant {
    type Output = Self;

    #[inline(never)] // called from about a hundred places
    fn add(self, span: Duration) -> Self {
        Self {
            micros: self.micros.saturating_add(span.micros),
        }
    }
}

/// Maximum backward step of the caller's time that counts as calls in the wrong order. A larger step counts as a change
/// of the caller's clock.
const DISORDER: Duration = Duration::from_millis(100);

/// Maximum advance of internal time in one call, about 140 years. Without this limit, one wrong reading of the clock
/// could take internal time to its maximum, and no timer would expire any more.
const LONGEST: Duration = Duration::from_micros(1 << 52);

/// Clock that converts the caller's time to internal time, which never runs backward. The caller's time can step
/// forward or backward.
///
/// | caller's time | internal time |
/// | --- | --- |
/// | up to 140 years after the latest | advances as much |
/// | later than that | advances by 140 years |
/// | up to 100 ms before the latest | stands still until the caller's time has caught up |
/// | earlier than that | goes on from the latest, in step with the caller's time from now on |
///
/// Timers continue after a backward step. The step extends a lease at most by the time between two calls.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MonotonicClock {
    /// Latest time of the caller's clock to which this clock has advanced.
    latest: Instant,
    /// Internal time at which the caller's clock showed `latest`. The internal time never runs backward.
    internal: Instant,
}

impl MonotonicClock {
    /// Creates a clock whose internal time equals the caller's time until the caller's clock jumps.
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            latest: now,
            internal: now,
        }
    }

    /// Advances the clock to the caller's time, and returns the internal time, which never runs back.
    pub(crate) fn advance(&mut self, now: Instant) -> Instant {
        if now >= self.latest {
            self.internal = self.internal + now.since(self.latest).min(LONGEST);
            self.latest = now;
        } else if self.latest.since(now) > DISORDER {
            self.latest = now;
        }
        self.internal
    }

    /// Returns the internal time as of the last call of [`advance`](Self::advance).
    pub(crate) const fn now(&self) -> Instant {
        self.internal
    }

    /// Converts the caller's time `at` to internal time.
    pub(crate) fn internal(&self, at: Instant) -> Instant {
        shifted(at, self.latest, self.internal)
    }

    /// Converts the internal time `at` to the caller's time.
    pub(crate) fn external(&self, at: Instant) -> Instant {
        shifted(at, self.internal, self.latest)
    }
}

/// Converts `at` from a first clock to a second clock: `to` + (`at` - `from`). The first clock shows `from` when the
/// second shows `to`.
fn shifted(at: Instant, from: Instant, to: Instant) -> Instant {
    let back = from.since(at).as_micros();
    Instant::from_micros((to + at.since(from)).as_micros().saturating_sub(back))
}

/// Generator of pseudorandom numbers for timing and session numbers. It is xorshift (Marsaglia 2003, 13-17-5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jitter(u32);

impl Jitter {
    pub(crate) const NONE: Self = Self(0);

    /// Creates a generator; distinct seeds give distinct numbers.
    pub(crate) const fn new(seed: u32) -> Self {
        // Any odd multiplier keeps distinct seeds distinct; the generator must not start at zero.
        match seed.wrapping_mul(0x9E37_79B1) {
            0 => Self(1),
            state => Self(state),
        }
    }

    /// Returns the next pseudorandom number, never 0.
    pub(crate) const fn draw(&mut self) -> u32 {
        let mut state = self.0;
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        self.0 = state;
        state
    }

    /// Returns `span` plus a random time of up to an eighth of `span`. Relays on a shared channel then do not
    /// transmit at the same time again and again.
    #[inline(never)] // called from many places
    pub(crate) fn spread(&mut self, span: Duration) -> Duration {
        // Multiplication scales the random part, since a Cortex-M has no division of this width.
        let eighth = (span.as_micros() / 8 + 1).min(u64::from(u32::MAX));
        let random = (u64::from(self.draw()) * eighth) >> 32;
        Duration::from_micros(span.as_micros().saturating_add(random))
    }

    /// Returns the next pseudorandom number, from 1 to 65535.
    pub(crate) const fn number(&mut self) -> u16 {
        let [_, a, b, _] = self.draw().to_le_bytes();
        match u16::from_le_bytes([a, b]) {
            0 => 1,
            number => number,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Duration, Instant, MonotonicClock};

    fn ms(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    #[test]
    fn internal_time_never_runs_backward() {
        let mut clock = MonotonicClock::new(ms(1_000));
        assert_eq!(clock.advance(ms(5_000)), ms(5_000));
        // Out-of-order calls.
        assert_eq!(clock.advance(ms(4_950)), ms(5_000));
        assert_eq!(clock.advance(ms(5_010)), ms(5_010));
        // The clock steps back by five seconds, then continues.
        assert_eq!(clock.advance(ms(10)), ms(5_010));
        assert_eq!(clock.advance(ms(20)), ms(5_020));
        assert_eq!(clock.internal(ms(15)), ms(5_015));
        assert_eq!(clock.external(ms(5_120)), ms(120));
        assert_eq!(clock.external(ms(4_000)), Instant::ZERO);
        // The clock steps forward by an hour, then to the maximum and back.
        assert_eq!(clock.advance(ms(3_600_020)), ms(3_605_020));
        let end = Instant::from_micros(u64::MAX);
        let far = ms(3_605_020) + super::LONGEST;
        let later = far + Duration::from_millis(1);
        assert_eq!(clock.advance(end), far);
        assert_eq!(clock.external(later), end);
        assert_eq!(clock.advance(ms(7)), far);
        assert_eq!(clock.advance(ms(8)), later);
    }

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
