//! Conversion between the autopilot's clock and the relay's. It gives measurement times of positions, and the time sent to the
//! autopilot.

use crate::time::{Duration, Instant};

/// Backward step of the autopilot's clock that shows a restart.
const RESTARTED_US: i64 = 2_000_000;

/// Half of the window of the anchor, which is the minimum delay of the last one to two halves.
const HALF: Duration = Duration::from_millis(4_000);

/// Minimum number of messages in each half. A gap and the burst after it then do not move the anchor.
const LEAST: u8 = 8;

/// Assumed maximum drift of the clocks: one part in 2^10. With more drift the anchor lags behind by the drift of two halves.
const DRIFT: u32 = 10;

/// Minimum difference between the relay's clock and the autopilot's, µs. It is that of the message with the minimum delay.
///
/// A message can be late because the link is slow, and it can seem late because the autopilot's clock has lost time. An anchor that
/// is never renewed takes the second for the first for good. An anchor that is renewed within 4 s to 8 s of messages corrects this,
/// and a late message then counts as late for that long.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RemoteClock {
    known: Option<Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    /// Minimum difference in the previous half, and in the present one.
    least: [i64; 2],
    since: Instant,
    messages: u8,
    /// Time of the last message on both clocks, the autopilot's in µs.
    last: (Instant, i64),
}

impl RemoteClock {
    /// Returns the time at which a message was created, on the relay's clock. The message arrived at `now` and was created
    /// `boot_ms` after the autopilot's start. Returns `None` if the autopilot has restarted.
    pub(super) fn hear(&mut self, now: Instant, boot_ms: u32) -> Option<Instant> {
        let said = i64::from(boot_ms) * 1_000;
        let difference = now.as_micros().cast_signed().saturating_sub(said);
        let known = self.known.get_or_insert(Known {
            least: [difference; 2],
            since: now,
            messages: 0,
            last: (now, said),
        });
        let (before, said_before) = core::mem::replace(&mut known.last, (now, said));
        let back = said_before.saturating_sub(said);
        if back > RESTARTED_US {
            self.known = None;
            self.hear(now, boot_ms);
            return None;
        }
        // Messages arrive in order: a clock that goes back has lost time, and the link is not slower for that.
        let lost = back.max(0);
        let drifted = (now.since(before).as_micros() >> DRIFT).cast_signed();
        if now.since(known.since) >= HALF && known.messages >= LEAST {
            let [_, this] = known.least;
            known.least = [this, difference];
            known.since = now;
            known.messages = 0;
        }
        known.messages = known.messages.saturating_add(1);
        known.least = known.least.map(|least| least + lost + drifted);
        let [_, this] = &mut known.least;
        *this = difference.min(*this);
        let [earlier, this] = known.least;
        let late = difference.saturating_sub(earlier.min(this)).max(0);
        let now = now.as_micros();
        Some(Instant::from_micros(
            now.saturating_sub(late.cast_unsigned()),
        ))
    }
}

/// Returns milliseconds, which wrap after 49 days as the autopilot's do. The division has two steps with instructions of the
/// target: a 64-bit division takes a kilobyte of flash.
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

    /// Returns the apparent age of each message of a flight, ms. `said` gives the autopilot's clock at a time, `delay` the link's
    /// delay.
    fn ages(said: impl Fn(u64) -> u64, delay: impl Fn(u64) -> u64) -> heapless::Vec<u64, 512> {
        let mut clock = RemoteClock::default();
        let mut all = heapless::Vec::new();
        for made in (0..80_000).step_by(200) {
            let came = at(made + delay(made));
            let boot_ms = u32::try_from(said(made)).expect("short");
            let true_at = clock.hear(came, boot_ms).expect("no restart");
            all.push(came.since(true_at).as_micros() / 1_000)
                .expect("room");
        }
        all
    }

    #[test]
    fn what_comes_late_was_true_earlier() {
        let mut clock = RemoteClock::default();
        assert_eq!(clock.hear(at(10_000), 500), Some(at(10_000)));
        assert_eq!(clock.hear(at(10_200), 700), Some(at(10_200)));
        let late = clock.hear(at(10_480), 900).expect("no restart");
        assert_eq!(at(10_480).since(late).as_micros() / 1_000, 79, "80 ms late");
        // A faster message shows that all earlier ones were late.
        assert_eq!(clock.hear(at(10_550), 1_100), Some(at(10_550)));
        let late = clock.hear(at(10_800), 1_300).expect("no restart");
        assert_eq!(at(10_800).since(late).as_micros() / 1_000, 49, "50 ms late");
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

    /// Checks a simulator on a loaded machine.
    #[test]
    fn a_clock_that_runs_one_percent_slow_is_never_blind() {
        let ages = ages(|ms| ms - ms / 100, |_| 5);
        let most = ages.iter().max();
        assert!(most.is_some_and(|most| *most < 120), "{most:?} ms");
    }

    #[test]
    fn a_clock_that_stops_for_a_moment_is_followed_within_eight_seconds() {
        let ages = ages(
            |ms| if ms < 20_000 { ms } else { ms - 1_500 },
            |ms| if (20_000..20_001).contains(&ms) { 5 } else { 6 },
        );
        assert!(ages.iter().skip(145).all(|age| *age < 20), "{ages:?}");
    }

    /// Checks that a link with a growing delay is not trusted at first.
    #[test]
    fn a_delay_that_grows_is_late_at_first() {
        let ages = ages(|ms| ms, |ms| if ms < 20_000 { 5 } else { 1_500 });
        assert!(ages.iter().skip(101).take(15).all(|age| *age > 1_000));
        assert!(ages.iter().skip(145).all(|age| *age < 20));
    }

    /// Checks messages that a cable delivers at once after 7 s: the age of the first one is 7 s.
    #[test]
    fn a_burst_after_a_gap_is_old() {
        let held = 20_000..27_000;
        let ages = ages(
            |ms| ms,
            |ms| if held.contains(&ms) { 27_000 - ms } else { 5 },
        );
        for (i, age) in ages.iter().enumerate().skip(100).take(35) {
            let expected = 27_000 - 200 * u64::try_from(i).expect("small");
            assert!(age.abs_diff(expected) < 40, "{i}: {age}, {expected}");
        }
        assert!(ages.iter().skip(136).all(|age| *age < 40));
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
