//! Frame faults on any link: loss, corruption, duplication and reordering, with a counter for each.

use std::collections::HashMap;

use chacha20::ChaCha8Rng;
use rand::RngExt;
use uav_relay::wire::frame::MAX_SWEEP;
use uav_relay::{Duration, Instant};

/// Probability of each fault per frame, 0 to 0.9. Faults are independent: several may affect one frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Faults {
    /// The frame never arrives.
    pub loss: f64,
    /// Frame corruption: one to eight bytes change; the delimiter may be among them.
    pub corrupt: f64,
    /// The frame arrives twice.
    pub duplicate: f64,
    /// The frame arrives so late that later frames may overtake it.
    pub reorder: f64,
}

/// Counts of the injected faults.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Injected {
    /// Lost frames.
    pub lost: u64,
    /// Corrupted frames.
    pub corrupted: u64,
    /// Duplicated frames.
    pub duplicated: u64,
    /// Delayed frames.
    pub reordered: u64,
}

/// Arrival of a frame at a receiver.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Arrival {
    /// Received bytes.
    pub bytes: Vec<u8>,
    /// Extra delay in frame times.
    pub late: u64,
}

impl Faults {
    /// High rates of all four faults at once.
    pub const BAD_DAY: Self = Self {
        loss: 0.3,
        corrupt: 0.15,
        duplicate: 0.1,
        reorder: 0.1,
    };

    /// Returns true if all probabilities are 0.
    pub fn none(&self) -> bool {
        *self == Self::default()
    }

    /// Draws the faults of `frame`. Returns no, one or two arrivals.
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

/// Burst state of all links; each direction of a link is independent.
#[derive(Debug)]
pub struct Bursts {
    /// Mean share of lost frames, equal to the share of time in the bad state.
    share: f64,
    /// Probability per frame of the transition from good to bad.
    worsens: f64,
    /// Probability per frame of the transition from bad to good: the inverse of the mean burst length.
    heals: f64,
    /// True for a bad link, by sender and receiver.
    bad: HashMap<(usize, usize), bool>,
}

impl Bursts {
    /// Creates the model: a `share` of lost frames, 0 to 0.9, and a mean burst `length`. The length is at least
    /// [`Bursts::shortest`].
    pub fn new(share: f64, length: f64) -> Self {
        let heals = 1.0 / length.max(1.0);
        Self {
            share,
            worsens: (share * heals / (1.0 - share)).min(1.0),
            heals,
            bad: HashMap::new(),
        }
    }

    /// Returns the mean burst length of independent losses with probability `share`. The model's lower limit.
    pub fn shortest(share: f64) -> f64 {
        1.0 / (1.0 - share)
    }

    /// Returns true if the link's next frame is lost.
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
    /// The relay that does not receive, from 1.
    pub by: u16,
    /// The relay that is not received, from 1.
    pub of: u16,
    /// Start time.
    pub from: Instant,
    /// End time; `None` if the failure is permanent.
    pub until: Option<Instant>,
}

impl OneWayFailure {
    /// Returns true if this failure keeps `by` from receiving `of` at `now`.
    pub fn applies(&self, by: u16, of: u16, now: Instant) -> bool {
        (self.by, self.of) == (by, of)
            && now >= self.from
            && self.until.is_none_or(|until| now < until)
    }
}

/// Parameters of a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LinkSpec {
    /// Bits per second, at least 300; a byte takes ten bits.
    pub baud: u32,
    /// Delay from the last bit sent to the last bit received.
    pub latency: Duration,
}

impl Default for LinkSpec {
    /// Returns 115 200 baud and a latency of 2 ms, as of a telemetry radio at short range.
    fn default() -> Self {
        Self {
            baud: 115_200,
            latency: Duration::from_millis(2),
        }
    }
}

impl LinkSpec {
    /// Returns the transmission time of `bytes` bytes.
    pub fn line_time(&self, bytes: usize) -> Duration {
        let bits = 10_000_000_u64.saturating_mul(bytes as u64);
        Duration::from_micros(bits.div_ceil(u64::from(self.baud.max(300))))
    }

    /// Returns the longest time of a sweep message per hop, with 1 ms for computing.
    pub fn hop_time(&self) -> Duration {
        let frame = self.line_time(MAX_SWEEP).as_micros();
        Duration::from_micros(frame + self.latency.as_micros() + 1_000)
    }
}

/// Serial line with the time until which it is busy.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    free: Instant,
}

impl Line {
    /// Sends `bytes` bytes once the line is free. Returns the arrival time.
    pub fn send(&mut self, now: Instant, bytes: usize, spec: &LinkSpec) -> Instant {
        self.free = self.free.max(now) + spec.line_time(bytes);
        self.free + spec.latency
    }
}
