//! What a channel that relays share has to carry, and the timing that it needs.
//!
//! A chain that nothing happens to says so all the time: every half of `probe_after` a pulse goes to its end and back, and within
//! `probe_after` either neighbour may ask the other for a heartbeat and be answered. So each pair of neighbours sends at most eight frames
//! of some 32 bytes in `probe_after`. When a neighbour is silent these questions come eight times as often, frames that got lost are sent
//! again, and sweeps of 108 bytes go along the chain. So the eight frames may take 15 % of the channel: a channel that is
//! asked to carry more comes to a standstill when all relays are switched on, for who waits for its turn longer than an answer takes
//! sends again.
//!
//! | what goes in | unit |
//! | --- | --- |
//! | `baud` | bit/s on the channel; a byte takes ten |
//! | `in_range` | relays that share it at one place, itself among them: nine where a radio reaches four relays far |
//! | `overhead` | what a frame costs beside its bytes (preamble, turning from receiving to sending), in bytes |
//! | `probe_after` | s, as [`Settings::probe_after`](crate::Settings::probe_after) |
//!
//! The figures were found with simulated chains by carrier sense: up to a hundred relays in one range without losses, up to twenty with 30 % of
//! the frames lost.

use crate::time::Duration;
use crate::wire::frame::MAX_SWEEP;

/// Frames that two neighbours send to each other in `probe_after` at most.
const FRAMES: u64 = 8;

/// Bytes of each: a pulse with a tag.
const BYTES: u64 = 32;

/// The part of the channel that they may take: 3 of 20.
const SHARE: [u64; 2] = [3, 20];

const BITS: u64 = 10;

/// So many relays in one range are a chain of radios that reach four relays far: a frame waits for no more than its own time.
const NEAR: u16 = 9;

/// The most frame times that a frame waits for its turn.
const MOST_TURNS: u32 = 4;

/// Relays that share a channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ChannelLoad {
    /// Relays that hear each other, 1 to 1000.
    pub in_range: u16,
    /// What a frame costs beside its bytes, in bytes.
    pub overhead: u16,
}

impl ChannelLoad {
    /// Relays in range of each other whose radios sense the carrier as IEEE 802.15.4 has it: a frame costs 12 bytes beside its own.
    pub const fn of_radios(in_range: u16) -> Self {
        Self {
            in_range,
            overhead: 12,
        }
    }

    /// Bits that are sent unasked in one `probe_after`, times a second in µs, over the share that they may take.
    const fn needed(self) -> u64 {
        let pairs = self.in_range.saturating_sub(1) as u64;
        let bits = FRAMES * pairs * (BYTES + self.overhead as u64) * BITS;
        (bits * 1_000_000 * SHARE[1]).div_ceil(SHARE[0])
    }

    /// The least data rate that carries them, bit/s: 0 for a relay that is alone.
    ///
    /// ```
    /// use uav_relay::{ChannelLoad, Duration};
    ///
    /// let near = ChannelLoad { in_range: 9, overhead: 12 };
    /// assert_eq!(near.least_baud(Duration::from_millis(5_000)), 37_547);
    /// ```
    pub const fn least_baud(self, probe_after: Duration) -> u32 {
        let micros = match probe_after.as_micros() {
            0 => 1,
            micros => micros,
        };
        let baud = self.needed().div_ceil(micros);
        if baud > u32::MAX as u64 {
            return u32::MAX;
        }
        #[expect(clippy::cast_possible_truncation, reason = "it is not above the most")]
        let baud = baud as u32;
        baud
    }

    /// Whether a channel of `baud` bit/s carries them, where a silent neighbour is asked after `probe_after`: the one rule that `cargo chain`,
    /// `cargo provision` and the Linux companion go by.
    ///
    /// ```
    /// use uav_relay::{ChannelLoad, Duration};
    ///
    /// let all = ChannelLoad { in_range: 50, overhead: 12 };
    /// let usual = Duration::from_millis(5_000);
    /// let full = all.carried(57_600, usual).expect_err("a slow radio");
    /// assert_eq!((full.least_baud, full.most_in_range), (229_974, 13));
    /// // Signs of life that are fewer fit.
    /// assert_eq!(full.least_probe_after, Duration::from_millis(19_963));
    /// assert_eq!(all.carried(57_600, full.least_probe_after), Ok(()));
    /// ```
    ///
    /// # Errors
    /// [`ChannelFull`] says what would fit.
    pub const fn carried(self, baud: u32, probe_after: Duration) -> Result<(), ChannelFull> {
        let least_baud = self.least_baud(probe_after);
        if baud >= least_baud {
            return Ok(());
        }
        // In whole milliseconds, as options have it.
        let least_ms = self.least_probe_after(baud).as_micros().div_ceil(1_000);
        Err(ChannelFull {
            in_range: self.in_range,
            least_baud,
            least_probe_after: Duration::from_micros(least_ms.saturating_mul(1_000)),
            most_in_range: self.most_in_range(baud, probe_after),
        })
    }

    /// How many relays in one range such a channel carries.
    const fn most_in_range(self, baud: u32, probe_after: Duration) -> u16 {
        let pair = Self {
            in_range: 2,
            ..self
        };
        let needed = pair.needed();
        let room = probe_after.as_micros().saturating_mul(baud as u64);
        let pairs = room / if needed == 0 { 1 } else { needed };
        // Fewer than there are, since these are too many.
        let most = self.in_range.saturating_sub(1) as u64;
        #[expect(clippy::cast_possible_truncation, reason = "it is not above the most")]
        let pairs = if pairs < most {
            pairs as u16
        } else {
            most as u16
        };
        pairs.saturating_add(1)
    }

    /// The least `probe_after` with which a channel of `baud` bit/s carries them; `dead_after` is to be three times that.
    pub const fn least_probe_after(self, baud: u32) -> Duration {
        let baud = if baud == 0 { 1 } else { baud as u64 };
        Duration::from_micros(self.needed().div_ceil(baud))
    }

    /// The least [`Settings::hop_time`](crate::Settings::hop_time) on a channel of `baud` bit/s, where a frame that has been sent takes
    /// `latency` to arrive and be computed with: a sweep's time, and its wait for its turn where many share the channel.
    pub const fn hop_time(self, baud: u32, latency: Duration) -> Duration {
        let baud = if baud == 0 { 1 } else { baud as u64 };
        let sweep = (MAX_SWEEP as u64 * BITS * 1_000_000).div_ceil(baud);
        let turns = self.turns() as u64;
        Duration::from_micros(latency.as_micros().saturating_add(sweep * turns))
    }

    /// For how many frames' time a frame is under way.
    const fn turns(self) -> u32 {
        match self.in_range.div_ceil(NEAR) as u32 {
            0 => 1,
            turns if turns > MOST_TURNS => MOST_TURNS,
            turns => turns,
        }
    }
}

/// What a channel that does not carry its relays needs: one of the three.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ChannelFull {
    /// Relays that hear each other.
    pub in_range: u16,
    /// The least data rate that carries them, bit/s.
    pub least_baud: u32,
    /// The least [`Settings::probe_after`](crate::Settings::probe_after) with which the channel carries them, in whole milliseconds.
    /// [`Settings::dead_after`](crate::Settings::dead_after) is to be three times that.
    pub least_probe_after: Duration,
    /// How many of them it carries.
    pub most_in_range: u16,
}

impl core::fmt::Display for ChannelFull {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let ms = self.least_probe_after.as_micros() / 1_000;
        write!(
            f,
            "{} relays share the channel at one place: it needs {} bit/s, or --probe-after-ms {ms} with three times that for --dead-after-ms, or at most {} relays in range",
            self.in_range, self.least_baud, self.most_in_range
        )
    }
}

impl core::error::Error for ChannelFull {}

#[cfg(test)]
mod tests {
    use super::ChannelLoad;
    use crate::time::Duration;

    const USUAL: Duration = Duration::from_millis(5_000);

    fn least(in_range: u16) -> u32 {
        let overhead = 12;
        ChannelLoad { in_range, overhead }.least_baud(USUAL)
    }

    #[test]
    fn the_least_data_rates_are_those_that_were_found() {
        let rates = [1, 2, 8, 9, 20, 50, 100].map(least);
        assert_eq!(rates, [0, 4_694, 32_854, 37_547, 89_174, 229_974, 464_640]);
    }

    #[test]
    fn a_channel_as_slow_as_is_allowed_needs_the_usual_timing_and_one_half_as_fast_twice_that() {
        for in_range in [2, 9, 20, 1_000] {
            let load = ChannelLoad {
                in_range,
                overhead: 12,
            };
            let baud = load.least_baud(USUAL);
            assert!(load.least_probe_after(baud) <= USUAL);
            assert!(load.least_probe_after(baud - 1) > USUAL);
            let twice = load.least_probe_after(baud / 2).as_micros();
            assert!((9_990_000..10_005_000).contains(&twice), "{twice}");
        }
    }

    #[test]
    fn where_many_share_the_channel_a_hop_takes_up_to_four_frames_time() {
        let latency = Duration::from_millis(3);
        let times = [1, 9, 10, 19, 100].map(|in_range| {
            let load = ChannelLoad {
                in_range,
                overhead: 12,
            };
            load.hop_time(108_000, latency).as_micros()
        });
        // 120 bytes of ten bits each; without `auth` a sweep is shorter by its tag.
        let frame = if cfg!(feature = "auth") {
            10_000
        } else {
            9_260
        };
        let expected = [1, 1, 2, 3, 4].map(|times| 3_000 + times * frame);
        assert_eq!(times, expected);
    }

    #[test]
    fn nothing_that_is_asked_overflows() {
        let load = ChannelLoad {
            in_range: u16::MAX,
            overhead: u16::MAX,
        };
        let never = Duration::from_micros(0);
        assert_eq!(load.least_baud(never), u32::MAX);
        assert!(load.least_probe_after(0) > USUAL);
        let most = Duration::from_micros(u64::MAX);
        assert_eq!(load.hop_time(0, most), most);
    }
}
