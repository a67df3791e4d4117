//! Links between drones, with faults and latency of frames. They have no clock of their own.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use chacha20::ChaCha8Rng;
use rand::SeedableRng;
use uav_relay::MAX_FRAME;

use super::emulator::SPEED;
use uav_relay_sim::simulator::faults::{Faults, Injected, LinkSpec};

/// Maximum number of bytes collected while a link waits for a delimiter.
const LONGEST: usize = 2 * MAX_FRAME;

/// Simulated links between drones, with latency and faults. Senders and receivers have indices.
///
/// The caller chooses the indices.
#[derive(Debug)]
pub struct Medium {
    link: LinkSpec,
    faults: Faults,
    rng: ChaCha8Rng,
    injected: Injected,
    /// Receivers and bytes of the frames in transit, by time of arrival and order of sending.
    flying: BTreeMap<(Instant, u64), (usize, Vec<u8>)>,
    order: u64,
    /// State of each sender's link: bytes since the last delimiter, and time when the link becomes idle.
    lines: Vec<(Vec<u8>, Instant)>,
}

impl Medium {
    /// Creates the links of `senders` sending ports. No bytes are in transit at `now`.
    ///
    /// Times in `link` are on the drones' clocks. `seed` is for the random `faults`.
    pub fn new(senders: usize, link: LinkSpec, faults: Faults, seed: u64, now: Instant) -> Self {
        Self {
            link,
            faults,
            rng: ChaCha8Rng::seed_from_u64(seed),
            injected: Injected::default(),
            flying: BTreeMap::new(),
            order: 0,
            lines: vec![(Vec::new(), now); senders],
        }
    }

    /// Accepts bytes from `sender`. Each complete frame goes to all `receivers`, with separate faults.
    pub fn send(&mut self, now: Instant, sender: usize, bytes: &[u8], receivers: &[usize]) {
        for &byte in bytes {
            let Some((frame, _)) = self.lines.get_mut(sender) else {
                return;
            };
            frame.push(byte);
            if byte == 0 || frame.len() >= LONGEST {
                let frame = std::mem::take(frame);
                self.put(now, sender, &frame, receivers);
            }
        }
    }

    fn put(&mut self, now: Instant, sender: usize, frame: &[u8], receivers: &[usize]) {
        let Some((_, free)) = self.lines.get_mut(sender) else {
            return;
        };
        *free = now.max(*free) + wall(self.link.line_time(frame.len()));
        let arrives = *free + wall(self.link.latency);
        for &receiver in receivers {
            let arrivals = self.faults.inject(frame, &mut self.rng, &mut self.injected);
            for arrival in arrivals {
                let late = u32::try_from(arrival.late).unwrap_or(u32::MAX);
                let at = arrives + wall(self.link.hop_time()).saturating_mul(late);
                let frame = (receiver, arrival.bytes);
                self.flying.insert((at, self.order), frame);
                self.order += 1;
            }
        }
    }

    /// Returns the index of a receiver, and bytes that have arrived there by `now`, if any.
    pub fn receive(&mut self, now: Instant) -> Option<(usize, Vec<u8>)> {
        if self.next()? > now {
            return None;
        }
        self.flying.pop_first().map(|(_, frame)| frame)
    }

    /// Returns the time of the next arrival, if any bytes are in transit.
    pub fn next(&self) -> Option<Instant> {
        self.flying.keys().next().map(|(at, _)| *at)
    }

    /// Returns how many frames were lost, corrupted, duplicated and reordered so far.
    pub const fn injected(&self) -> Injected {
        self.injected
    }
}

fn wall(span: uav_relay::Duration) -> Duration {
    Duration::from_micros(span.as_micros()).div_f64(SPEED)
}
