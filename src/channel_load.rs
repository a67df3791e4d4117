//! Minimum data rate and timing of a radio channel that relays share.
//!
//! An idle chain sends keep-alive traffic: every half of `probe_after` a lease renewal travels to its end and back, and within
//! `probe_after` each neighbour may request a heartbeat and receive the reply. So each pair of neighbours sends at most eight
//! frames of about 32 bytes in `probe_after`. When a neighbour is silent, heartbeat requests are eight times as frequent, lost
//! frames are retransmitted, and sweeps of 108 bytes travel along the chain. The eight frames may therefore take 15 % of the
//! channel. A channel with a higher load collapses when all relays are switched on, because a relay that waits for the channel
//! longer than its retransmission timer sends again.
//!
//! | input | unit |
//! | --- | --- |
//! | `baud` | bit/s on the channel; a byte takes ten |
//! | `in_range` | relays in range of each other; nine if a radio reaches four relays in each direction |
//! | `overhead` | cost of a frame beyond its bytes (preamble, turnaround), in bytes |
//! | `probe_after` | s, as [`Settings::probe_after`](crate::Settings::probe_after) |
//!
//! The figures come from chains simulated with carrier sense: up to a hundred relays in one range without losses, twenty with 30
//! % loss.

use crate::time::Duration;
use crate::wire::MAX_SWEEP;

/// Maximum number of frames that two neighbours of an idle chain send within the time `probe_after`. A chain is idle
/// while all relays hold their positions.
const FRAMES: u64 = 8;

/// Length in bytes of a frame that an idle chain sends: a lease renewal with its authentication tag.
const BYTES: u64 = 32;

/// Maximum fraction of the channel's capacity that the frames of an idle chain may take: 3/20. The rest is left for
/// other messages, for retransmissions, and for waits until the channel is free.
const SHARE: [u64; 2] = [3, 20];

const BITS: u64 = 10;

/// Maximum number of relays in range at which a transmission is assumed to take one frame time.
///
/// With more than nine relays a transmission is assumed to take two frame times, with more than 18 three, up to
/// [`MOST_TURNS`], because it waits for the channel. The nine relays are this relay, four toward Tx and four toward Rx.
const NEAR: u16 = 9;

/// Maximum time assumed for one transmission including the wait for the channel, in frame times.
const MOST_TURNS: u32 = 4;

/// Load of a radio channel: the number of relays that share it, and the overhead of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ChannelLoad {
    /// Number of relays in range of each other, 1 to 1000.
    pub in_range: u16,
    /// Overhead of a frame (preamble, turnaround of the radio), as a number of bytes of the same duration.
    pub overhead: u16,
}

impl ChannelLoad {
    /// Creates the load of `in_range` relays whose radios sense the carrier as in IEEE 802.15.4. The overhead is 12
    /// bytes per frame.
    pub const fn of_radios(in_range: u16) -> Self {
        Self {
            in_range,
            overhead: 12,
        }
    }

    /// Returns the minimum data rate for this load, bit/s, times `probe_after` in microseconds.
    ///
    /// The result is the number of bits that an idle chain sends within `probe_after`, divided by the permitted
    /// fraction [`SHARE`] of the channel, times 1e6.
    const fn needed(self) -> u64 {
        let pairs = self.in_range.saturating_sub(1) as u64;
        let bits = FRAMES * pairs * (BYTES + self.overhead as u64) * BITS;
        (bits * 1_000_000 * SHARE[1]).div_ceil(SHARE[0])
    }

    /// Returns the minimum data rate of a channel that carries this load, bit/s; 0 for a single relay.
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

    /// Checks that a channel of `baud` bit/s has enough capacity for these relays with this `probe_after`.
    ///
    /// `cargo chain`, `cargo provision` and the Linux companion use this check.
    ///
    /// ```
    /// use uav_relay::{ChannelLoad, Duration};
    ///
    /// let all = ChannelLoad { in_range: 50, overhead: 12 };
    /// let usual = Duration::from_millis(5_000);
    /// let full = all.carried(57_600, usual).expect_err("a slow radio");
    /// assert_eq!((full.least_baud, full.most_in_range), (229_974, 13));
    /// // A longer `probe_after` reduces the load.
    /// assert_eq!(full.least_probe_after, Duration::from_millis(19_963));
    /// assert_eq!(all.carried(57_600, full.least_probe_after), Ok(()));
    /// ```
    ///
    /// # Errors
    /// [`ChannelFull`] states what would fit.
    pub const fn carried(self, baud: u32, probe_after: Duration) -> Result<(), ChannelFull> {
        let least_baud = self.least_baud(probe_after);
        if baud >= least_baud {
            return Ok(());
        }
        // Rounded up to whole milliseconds, the unit of the command-line options.
        let least_ms = self.least_probe_after(baud).as_micros().div_ceil(1_000);
        Err(ChannelFull {
            in_range: self.in_range,
            least_baud,
            least_probe_after: Duration::from_micros(least_ms.saturating_mul(1_000)),
            most_in_range: self.most_in_range(baud, probe_after),
        })
    }

    const fn most_in_range(self, baud: u32, probe_after: Duration) -> u16 {
        let pair = Self {
            in_range: 2,
            ..self
        };
        let needed = pair.needed();
        let room = probe_after.as_micros().saturating_mul(baud as u64);
        let pairs = room / if needed == 0 { 1 } else { needed };
        // Fewer than `in_range`, since that many do not fit.
        let most = self.in_range.saturating_sub(1) as u64;
        #[expect(clippy::cast_possible_truncation, reason = "it is not above the most")]
        let pairs = if pairs < most {
            pairs as u16
        } else {
            most as u16
        };
        pairs.saturating_add(1)
    }

    /// Returns the lowest permissible value of the relays' setting `probe_after` at `baud` bit/s.
    ///
    /// The setting `dead_after` should be three times `probe_after`.
    pub const fn least_probe_after(self, baud: u32) -> Duration {
        let baud = if baud == 0 { 1 } else { baud as u64 };
        Duration::from_micros(self.needed().div_ceil(baud))
    }

    /// Returns the minimum [`Settings::hop_time`](crate::Settings::hop_time) on a channel of `baud` bit/s.
    ///
    /// It is the time to transmit a message of 100 bytes, including the wait for the shared channel, plus `latency`.
    /// The latency is the time from the end of a transmission to the end of the receiver's computation.
    pub const fn hop_time(self, baud: u32, latency: Duration) -> Duration {
        let baud = if baud == 0 { 1 } else { baud as u64 };
        let sweep = (MAX_SWEEP as u64 * BITS * 1_000_000).div_ceil(baud);
        let turns = self.turns() as u64;
        Duration::from_micros(latency.as_micros().saturating_add(sweep * turns))
    }

    /// Returns the time assumed for one transmission including the wait for the channel, in frame times.
    const fn turns(self) -> u32 {
        match self.in_range.div_ceil(NEAR) as u32 {
            0 => 1,
            turns if turns > MOST_TURNS => MOST_TURNS,
            turns => turns,
        }
    }
}

/// Error of [`ChannelLoad::carried`]: the channel is overloaded. Each field except `in_range` states one way to avoid
/// this: a faster channel, a longer `probe_after`, or fewer relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ChannelFull {
    /// Number of relays in range of each other, with which the channel is overloaded.
    pub in_range: u16,
    /// Minimum data rate of a channel that carries these relays, bit/s.
    pub least_baud: u32,
    /// Minimum [`Settings::probe_after`](crate::Settings::probe_after) for these relays, in whole ms.
    ///
    /// [`Settings::dead_after`](crate::Settings::dead_after) should be three times this value.
    pub least_probe_after: Duration,
    /// Maximum number of relays in range that this channel carries with the given `probe_after`.
    pub most_in_range: u16,
}

impl core::fmt::Display for ChannelFull {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let ms = self.least_probe_after.as_micros() / 1_000;
        write!(
            f,
            "too slow for {} relays in range of each other: use at least {} bit/s, or --probe-after-ms {ms}, or at most {} relays in range of each other",
            self.in_range, self.least_baud, self.most_in_range
        )
    }
}

impl core::error::Error for ChannelFull {}

#[cfg(test)]
mod tests {
    use super::ChannelLoad;
    use crate::features::AUTH;
    use crate::time::Duration;

    const USUAL: Duration = Duration::from_millis(5_000);

    fn least(in_range: u16) -> u32 {
        let overhead = 12;
        ChannelLoad { in_range, overhead }.least_baud(USUAL)
    }

    #[test]
    fn the_least_data_rates_are_the_measured_ones() {
        let rates = [1, 2, 8, 9, 20, 50, 100].map(least);
        assert_eq!(rates, [0, 4_694, 32_854, 37_547, 89_174, 229_974, 464_640]);
    }

    #[test]
    fn half_the_least_data_rate_needs_twice_the_timing() {
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
    fn many_relays_in_range_lengthen_a_hop_to_four_frames() {
        let latency = Duration::from_millis(3);
        let times = [1, 9, 10, 19, 100].map(|in_range| {
            let load = ChannelLoad {
                in_range,
                overhead: 12,
            };
            load.hop_time(108_000, latency).as_micros()
        });
        // 120 bytes of ten bits each; without `auth` a sweep has no tag and is shorter.
        let frame = if AUTH { 10_000 } else { 9_260 };
        let expected = [1, 1, 2, 3, 4].map(|times| 3_000 + times * frame);
        assert_eq!(times, expected);
    }

    #[test]
    fn no_input_overflows() {
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
