//! One direction of a serial link: bytes take their time, one frame after the other.

use uav_relay::Duration;
use uav_relay::Instant;
use uav_relay::wire::frame::MAX_SWEEP;

/// What a link is like.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LinkSpec {
    /// Bits per second; a byte takes ten of them. At least 300.
    pub baud: u32,
    /// From the last bit sent to the last bit received.
    pub latency: Duration,
}

impl Default for LinkSpec {
    /// 115 200 baud and 2 ms, as a telemetry radio at short range has.
    fn default() -> Self {
        Self {
            baud: 115_200,
            latency: Duration::from_millis(2),
        }
    }
}

impl LinkSpec {
    /// How long `bytes` bytes occupy the line.
    pub fn line_time(&self, bytes: usize) -> Duration {
        let bits = 10_000_000_u64.saturating_mul(bytes as u64);
        Duration::from_micros(bits.div_ceil(u64::from(self.baud.max(300))))
    }

    /// The longest a sweep takes from one relay to the next, and a millisecond for computing.
    pub fn hop_time(&self) -> Duration {
        let frame = self.line_time(MAX_SWEEP).as_micros();
        Duration::from_micros(frame + self.latency.as_micros() + 1_000)
    }
}

/// A line, and until when it is busy.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    free: Instant,
}

impl Line {
    /// Sends `bytes` bytes as soon as the line is free; when they have arrived.
    pub fn send(&mut self, now: Instant, bytes: usize, spec: &LinkSpec) -> Instant {
        self.free = self.free.max(now) + spec.line_time(bytes);
        self.free + spec.latency
    }
}
