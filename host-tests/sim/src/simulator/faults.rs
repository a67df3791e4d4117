//! Frame faults on any link: loss, corruption, duplication and reordering, with a counter for each.

use std::collections::HashMap;

use chacha20::ChaCha8Rng;
use rand::RngExt;
use uav_relay::wire::frame::MAX_SWEEP;
use uav_relay::{Duration, Instant};

/// Probability of each fault of a frame, 0 to 0.9. Faults are independent: one frame may have several.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Faults {
    /// Probability that a frame never arrives.
    pub loss: f64,
    /// Probability that one to eight bytes of a frame change. The delimiter can be one of these bytes.
    pub corrupt: f64,
    /// Probability that a frame arrives twice.
    pub duplicate: f64,
    /// Probability that a frame arrives so late that later frames may overtake it.
    pub reorder: f64,
}

/// Counts of the frame faults that the simulated links caused.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Injected {
    /// Number of frames that were sent but never arrived.
    pub lost: u64,
    /// Number of frames whose bytes were changed.
    pub corrupted: u64,
    /// Number of frames that arrived twice.
    pub duplicated: u64,
    /// Number of frames that arrived late, so that later frames could overtake them.
    pub reordered: u64,
}

/// Arrival of a frame at a receiver.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Arrival {
    /// Bytes of the frame as received, with changes by faults.
    pub bytes: Vec<u8>,
    /// Delay of the frame by simulated faults, as a multiple of [`LinkSpec::hop_time`].
    pub late: u64,
}

impl Faults {
    /// Fault probabilities of a bad link: 30 % lost, 15 % corrupted, 10 % duplicated and 10 % delayed.
    pub const BAD_DAY: Self = Self {
        loss: 0.3,
        corrupt: 0.15,
        duplicate: 0.1,
        reorder: 0.1,
    };

    /// Returns true if the probabilities of all faults are 0.
    pub fn none(&self) -> bool {
        *self == Self::default()
    }

    /// Draws the faults of a frame, and counts them in `injected`. Returns the frame's arrivals: none, one or two.
    pub fn inject(
        &self,
        frame: &[u8],
        rng: &mut ChaCha8Rng,
        injected: &mut Injected,
    ) -> Vec<Arrival> {
        if self.none() {
            return vec![Arrival {
                bytes: frame.to_vec(),
                late: 0,
            }];
        }
        if rng.random_bool(self.loss) {
            injected.lost += 1;
            return Vec::new();
        }
        let copies = if rng.random_bool(self.duplicate) {
            injected.duplicated += 1;
            2
        } else {
            1
        };
        (0..copies)
            .map(|_| {
                let mut bytes = frame.to_vec();
                if rng.random_bool(self.corrupt) {
                    injected.corrupted += 1;
                    for _ in 0..rng.random_range(1..=8) {
                        let at = rng.random_range(0..bytes.len());
                        if let Some(byte) = bytes.get_mut(at) {
                            *byte ^= rng.random_range(1..=u8::MAX);
                        }
                    }
                }
                let late = if rng.random_bool(self.reorder) {
                    injected.reordered += 1;
                    rng.random_range(1..=12)
                } else {
                    0
                };
                Arrival { bytes, late }
            })
            .collect()
    }
}

/// Model of bursts of losses (Gilbert-Elliott). Each direction of a link is in a good or a bad state.
///
/// In the bad state the link loses all frames, in the good state no frames.
#[derive(Debug)]
pub struct Bursts {
    /// Mean fraction of frames that the link loses, 0 to 1. It is equal to the probability of the bad state.
    share: f64,
    /// Probability that a link in the good state is in the bad state for the next frame.
    worsens: f64,
    /// Probability that a link in the bad state is in the good state for the next frame.
    ///
    /// It is the inverse of the mean length of a burst, frames.
    heals: f64,
    /// State of each link by its sending and receiving node: true if the link is in the bad state.
    bad: HashMap<(usize, usize), bool>,
}

impl Bursts {
    /// Creates the model for a mean fraction `share` of lost frames, 0 to 0.9.
    ///
    /// `length` is the mean length of a burst, frames: at least [`Bursts::shortest`].
    pub fn new(share: f64, length: f64) -> Self {
        let heals = 1.0 / length.max(1.0);
        Self {
            share,
            worsens: (share * heals / (1.0 - share)).min(1.0),
            heals,
            bad: HashMap::new(),
        }
    }

    /// Returns the mean number of successive losses if each frame is lost with the probability `share`.
    ///
    /// The result is the smallest mean length that [`Bursts::new`] accepts.
    pub fn shortest(share: f64) -> f64 {
        1.0 / (1.0 - share)
    }

    /// Returns true if the next frame from node `from` to node `to` is lost.
    pub fn loses(&mut self, from: usize, to: usize, rng: &mut ChaCha8Rng) -> bool {
        let share = self.share;
        let Some(bad) = self.bad.get_mut(&(from, to)) else {
            let bad = rng.random_bool(share);
            self.bad.insert((from, to), bad);
            return bad;
        };
        let turns = if *bad { self.heals } else { self.worsens };
        *bad ^= rng.random_bool(turns);
        *bad
    }
}

/// Period in which relay `by` does not receive relay `of`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OneWayFailure {
    /// Number of the relay that does not receive relay `of`, from 1.
    pub by: u16,
    /// Number of the relay that relay `by` does not receive, from 1.
    pub of: u16,
    /// Start of the one-way link failure.
    pub from: Instant,
    /// End of the one-way link failure; `None` if it is permanent.
    pub until: Option<Instant>,
}

impl OneWayFailure {
    /// Returns true if this failure prevents relay `by` from receiving relay `of` at the time `now`.
    pub fn applies(&self, by: u16, of: u16, now: Instant) -> bool {
        (self.by, self.of) == (by, of)
            && now >= self.from
            && self.until.is_none_or(|until| now < until)
    }
}

/// Data rate and latency of a serial link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LinkSpec {
    /// Data rate of the link, bit/s, at least 300. A byte takes ten bits.
    pub baud: u32,
    /// Time from the sending of a bit to its arrival.
    pub latency: Duration,
}

impl Default for LinkSpec {
    /// Returns a link of 115 200 baud and 2 ms latency, typical of a telemetry radio at short range.
    fn default() -> Self {
        Self {
            baud: 115_200,
            latency: Duration::from_millis(2),
        }
    }
}

impl LinkSpec {
    /// Returns the time that the link needs to send `bytes` bytes, without its latency.
    pub fn line_time(&self, bytes: usize) -> Duration {
        let bits = 10_000_000_u64.saturating_mul(bytes as u64);
        Duration::from_micros(bits.div_ceil(u64::from(self.baud.max(300))))
    }

    /// Returns the time that a message of maximum length needs from one relay to the next. The time includes the
    /// latency of the link, and 1 ms for computing.
    pub fn hop_time(&self) -> Duration {
        let frame = self.line_time(MAX_SWEEP).as_micros();
        Duration::from_micros(frame + self.latency.as_micros() + 1_000)
    }
}

/// Serial line that sends one frame after the other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    free: Instant,
}

impl Line {
    /// Sends a frame of `bytes` bytes as soon as the line is free. Returns the time of its arrival.
    pub fn send(&mut self, now: Instant, bytes: usize, spec: &LinkSpec) -> Instant {
        self.free = self.free.max(now) + spec.line_time(bytes);
        self.free + spec.latency
    }
}
