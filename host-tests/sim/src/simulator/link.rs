//! Single direction of a serial link: frames are sent one after the other at the baud rate.

use uav_relay::Duration;
use uav_relay::Instant;
use uav_relay::wire::frame::MAX_SWEEP;

/// Parameters of a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LinkSpec {
    /// Bits per second, at least 300; a byte takes ten bits.
    pub baud: u32,
    /// Delay from the last bit sent to the last bit received.
    pub latency: Duration,
}

impl Default for LinkSpec {
    /// 115 200 baud and 2 ms, as of a telemetry radio at short range.
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
