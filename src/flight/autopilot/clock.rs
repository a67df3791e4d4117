//! The autopilot's clock, on the relay's: when a position was true. The relay's own, as it tells the autopilot.

use crate::time::{Duration, Instant};

/// A clock that is this much behind what it was has begun anew: no message is on its way so long.
const RESTARTED: Duration = Duration::from_millis(2_000);

/// The clocks drift apart by less than one part in 2^10.
const DRIFT: u32 = 10;

/// The shortest time that a message was on its way, and what has been said by it. A message that came late does not move the clock.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RemoteClock {
    /// When a message came, and what its sender's clock said, µs.
    anchor: Option<(Instant, u64)>,
}

impl RemoteClock {
    /// A message that came at `now` was made `boot_ms` after the autopilot began: when that was, or `None` where it has begun anew.
    pub(super) fn hear(&mut self, now: Instant, boot_ms: u32) -> Option<Instant> {
        let said = u64::from(boot_ms) * 1_000;
        let Some((at, then)) = self.anchor else {
            self.anchor = Some((now, said));
            return Some(now);
        };
        let passed = now.since(at).as_micros();
        let meant = i128::from(said) - i128::from(then);
        // How much later than the quickest one this message came.
        let late = i128::from(passed) - meant;
        let restarted = late > i128::from(RESTARTED.as_micros());
        let allowed = passed >> DRIFT;
        if restarted || late < i128::from(allowed) {
            self.anchor = Some((now, said));
        }
        if restarted {
            return None;
        }
        let late = u64::try_from(late).unwrap_or(0);
        Some(Instant::from_micros(now.as_micros().saturating_sub(late)))
    }
}

/// Milliseconds, which wrap after 49 days as the autopilot's do. In two steps that the target has an instruction for: a division of 64 bits
/// is a kilobyte of flash.
#[expect(clippy::cast_possible_truncation, reason = "eight years are 48 bits")]
pub(super) const fn millis(micros: u64) -> u32 {
    let high = (micros >> 16) as u32;
    let low = ((high % 1_000) << 16) | (micros & 0xFFFF) as u32;
    ((high / 1_000) << 16).wrapping_add(low / 1_000)
}

#[cfg(test)]
mod tests {
    use super::{RemoteClock, millis};
    use crate::time::Instant;

    const fn at(ms: u64) -> Instant {
        Instant::from_millis(ms)
    }

    #[test]
    fn what_comes_late_was_true_earlier() {
        let mut clock = RemoteClock::default();
        assert_eq!(clock.hear(at(10_000), 500), Some(at(10_000)));
        assert_eq!(clock.hear(at(10_200), 700), Some(at(10_200)));
        assert_eq!(clock.hear(at(10_480), 900), Some(at(10_400)), "80 ms late");
        // A quicker one shows that all before were late.
        assert_eq!(clock.hear(at(10_550), 1_100), Some(at(10_550)));
        assert_eq!(clock.hear(at(10_800), 1_300), Some(at(10_750)));
    }

    #[test]
    fn a_clock_that_drifts_is_followed() {
        let mut clock = RemoteClock::default();
        // The relay's is faster by 500 in a million: it gains half a second.
        for i in 0..5_000_u32 {
            let now = Instant::from_micros(u64::from(i) * 200_100);
            let true_at = clock.hear(now, i * 200).expect("the same start");
            assert!(now.since(true_at).as_micros() <= 100, "{i}");
        }
    }

    #[test]
    fn a_clock_that_begins_anew_is_noticed_once() {
        let mut clock = RemoteClock::default();
        assert!(clock.hear(at(100_000), 90_000).is_some());
        assert_eq!(clock.hear(at(101_000), 50), None);
        assert_eq!(clock.hear(at(101_200), 250), Some(at(101_200)));
    }

    #[test]
    fn milliseconds_are_those_of_a_division() {
        let mut micros = 0_u64;
        for step in 0..40_000_u64 {
            let wrapped = u32::try_from(micros / 1_000 % (1 << 32));
            assert_eq!(Ok(millis(micros)), wrapped, "{micros}");
            micros = (micros * 3 + step) % (1 << 48);
        }
    }
}
