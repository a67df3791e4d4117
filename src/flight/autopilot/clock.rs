//! The autopilot's clock on the relay's clock: when a position was measured. The relay's own clock, as the autopilot is told of it.

use crate::time::{Duration, Instant};

/// A clock that goes back by more than this has begun anew.
const RESTARTED_US: i64 = 2_000_000;

/// The anchor is the least delay of the last one to two of these.
const HALF: Duration = Duration::from_millis(4_000);

/// Messages in each of them at least, so that a gap and the burst after it do not move the anchor.
const LEAST: u8 = 8;

/// The clocks drift apart by less than one part in 2^10, or the anchor lags behind by what they drift in two halves.
const DRIFT: u32 = 10;

/// Differences between the relay's clock and the autopilot's, µs. The least of them belongs to the message with the least delay.
///
/// A message can be late since the link is slow, and it can seem to be late since the autopilot's clock has lost time. An anchor that
/// is never renewed takes the second for the first for good. One that is renewed within seconds, from 4 s to 8 s of messages, leaves a
/// late message late for that long.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RemoteClock {
    known: Option<Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    /// The least difference in the half before this one, and in this one.
    least: [i64; 2],
    since: Instant,
    messages: u8,
    /// Time of the last message on both clocks, the autopilot's in µs.
    last: (Instant, i64),
}

impl RemoteClock {
    /// Takes a message that came at `now` and was made `boot_ms` after the autopilot began. Returns when it was made, or `None` where the
    /// autopilot has begun anew.
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
        // Messages come in order: a clock that goes back has lost time, and the link is no slower for that.
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

    /// How late each message of a flight seems, ms: `said` gives the autopilot's clock at a time, `delay` the link's delay.
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
        // A quicker one shows that all before were late.
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

    /// A simulator on a loaded machine.
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

    /// So the link is not believed at first.
    #[test]
    fn a_delay_that_grows_is_late_at_first() {
        let ages = ages(|ms| ms, |ms| if ms < 20_000 { 5 } else { 1_500 });
        assert!(ages.iter().skip(101).take(15).all(|age| *age > 1_000));
        assert!(ages.iter().skip(145).all(|age| *age < 20));
    }

    /// What a cable has kept for 7 s comes at once: the first of it is as old as it is.
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
