//! Serial link: received bytes, transmit queue, driver-enable pin, and error counters.

use super::port::{Fault, SerialPort};
use crate::relay::{Port, Relay};
use crate::stats::bump;
use crate::time::{Duration, Instant, MonotonicClock};
use crate::wire::frame::MAX_FRAME;
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, OutputPin};
use heapless::Deque;

/// Maximum number of bytes read, and of failed reads, in one poll of a port.
#[doc(hidden)] // public because the documentation of public functions links to it
pub const READ_LIMIT: usize = 64;

/// Capacity of the transmit queue, bytes: the frame that the port is sending, and the next one.
const QUEUE: usize = 2 * MAX_FRAME;

/// Maximum pause between attempts to write to a port that accepts no bytes. The unit is the transmission time of a
/// byte.
const LONGEST_PAUSE: u32 = 128;

/// Placeholder type for a link without a driver-enable pin. Such a link is full duplex, or its radio switches between
/// sending and receiving by itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NoPin {}

impl ErrorType for NoPin {
    type Error = Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        match *self {}
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        match *self {}
    }
}

/// Returns the duration of a byte at `baud` bit/s, rounded up to a microsecond.
///
/// A byte has a start bit, 8 data bits and a stop bit. `baud` is at least 1; 0 counts as 1.
pub(crate) const fn byte_time(baud: u32) -> Duration {
    let baud = if baud == 0 { 1 } else { baud as u64 };
    Duration::from_micros(10_000_000_u64.div_ceil(baud))
}

/// Serial port of a relay with its transmit queue, and its driver-enable pin if it has one.
///
/// The pin is high from before the first byte of a frame until the last bit of the last queued frame has left the port,
/// and low otherwise. An [`Nb`](super::Nb) port reports when that bit has left. For an [`Io`](super::Io) port the time
/// is computed from the byte time, conservatively: every byte counts from the poll after the one that wrote it.
#[derive(Debug)]
pub struct SerialLink<P, D = NoPin> {
    port: P,
    pin: Option<D>,
    /// Last level of the driver-enable pin; `None` before the pin is first set, and after an error.
    level: Option<bool>,
    byte_time: Duration,
    waiting: Deque<u8, QUEUE>,
    clock: MonotonicClock,
    /// Last time at which the port accepted a byte, or at which a byte entered the empty queue.
    moved_at: Instant,
    /// Number of bytes written by the last poll. The transmission time of these bytes counts from the next poll,
    /// because the exact time of writing is unknown.
    uncounted: u32,
    /// Time at which all bytes written before the last poll have left the port.
    quiet_at: Instant,
    /// True if the last poll stopped reading at its limit, so that the port may have more bytes.
    unread: bool,
    stats: SerialStats,
}

impl<P: SerialPort> SerialLink<P> {
    /// Creates a link over `port` at `baud` bit/s, with 10 bits per byte.
    pub fn new(port: P, baud: u32) -> Self {
        Self::with_pin(port, baud, None)
    }
}

impl<P: SerialPort, D: OutputPin> SerialLink<P, D> {
    /// Creates a half-duplex link over `port` at `baud` bit/s, with 10 bits per byte. The driver-enable pin is high
    /// while this relay sends.
    ///
    /// The first poll sets the pin low, unless a frame is queued.
    pub fn half_duplex(port: P, baud: u32, pin: D) -> Self {
        Self::with_pin(port, baud, Some(pin))
    }

    fn with_pin(port: P, baud: u32, pin: Option<D>) -> Self {
        Self {
            port,
            pin,
            level: None,
            byte_time: byte_time(baud),
            waiting: Deque::new(),
            clock: MonotonicClock::new(Instant::ZERO),
            moved_at: Instant::ZERO,
            uncounted: 0,
            quiet_at: Instant::ZERO,
            unread: false,
            stats: SerialStats::default(),
        }
    }
}

impl<P: SerialPort, D: OutputPin> SerialLink<P, D> {
    /// Sets the driver-enable pin high, if there is one. Returns false on failure: then no bytes may be sent.
    fn raise(&mut self) -> bool {
        if let Some(pin) = &mut self.pin
            && self.level != Some(true)
        {
            if pin.set_high().is_err() {
                self.level = None;
                bump(&mut self.stats.pin);
                return false;
            }
            self.level = Some(true);
        }
        true
    }

    /// Sets the driver-enable pin low if all bytes have left the port.
    fn lower(&mut self, now: Instant) {
        let Some(pin) = self.pin.as_mut().filter(|_| self.level != Some(false)) else {
            return;
        };
        let by_time = self.uncounted == 0 && now >= self.quiet_at;
        let left = if let Ok(known) = self.port.has_left() {
            known.unwrap_or(by_time)
        } else {
            bump(&mut self.stats.write);
            by_time
        };
        if left {
            if pin.set_low().is_ok() {
                self.level = Some(false);
            } else {
                bump(&mut self.stats.pin);
            }
        }
    }
}

impl<P, D> SerialLink<P, D> {
    /// Returns the counters since the link was created.
    pub fn stats(&self) -> &SerialStats {
        &self.stats
    }

    /// Returns the port, for example to set a new baud rate by its driver.
    pub fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// Returns the port and the driver-enable pin. The transmit queue is discarded, and the pin keeps its level.
    pub fn release(self) -> (P, Option<D>) {
        (self.port, self.pin)
    }
}

pub(super) trait FrameLink {
    /// Passes up to [`READ_LIMIT`] received bytes to `relay`, as bytes received at the relay's `port`.
    fn receive(&mut self, now: Instant, port: Port, relay: &mut Relay);
    /// Returns true if one more frame of any length fits into the transmit queue.
    fn has_room(&self) -> bool;
    /// Queues a frame for sending. A frame that does not fit is dropped and counted.
    fn queue(&mut self, now: Instant, frame: &[u8]);
    /// Counts a frame that is dropped because it is for a port that this driver does not have.
    fn unrouted(&mut self);
    /// Writes as many queued bytes as the port accepts, and updates the driver-enable pin.
    fn transmit(&mut self, now: Instant);
    /// Returns the time by which this link must be polled again, later than `now`. `None` if nothing is pending.
    fn wake(&self, now: Instant) -> Option<Instant>;
}

impl<P: SerialPort, D: OutputPin> FrameLink for SerialLink<P, D> {
    fn receive(&mut self, now: Instant, port: Port, relay: &mut Relay) {
        let written = core::mem::take(&mut self.uncounted);
        let internal = self.clock.advance(now);
        if written > 0 {
            self.quiet_at = self.quiet_at.max(internal) + self.byte_time.times(written);
        }
        let mut buffer = [0; READ_LIMIT];
        let mut room = buffer.as_mut_slice();
        self.unread = true;
        for _ in 0..READ_LIMIT {
            if room.is_empty() {
                break;
            }
            match self.port.read(room) {
                Ok(0) => {
                    self.unread = false;
                    break;
                }
                Ok(count) => room = room.get_mut(count..).unwrap_or_default(),
                Err(fault) => self.stats.read_failed(fault),
            }
        }
        let len = READ_LIMIT - room.len();
        relay.handle_bytes(now, port, buffer.get(..len).unwrap_or_default());
    }

    fn has_room(&self) -> bool {
        QUEUE - self.waiting.len() >= MAX_FRAME
    }

    fn queue(&mut self, now: Instant, frame: &[u8]) {
        if frame.len() > QUEUE - self.waiting.len() {
            return bump(&mut self.stats.dropped);
        }
        if self.waiting.is_empty() {
            self.moved_at = self.clock.advance(now);
        }
        for &byte in frame {
            // There is room, as checked above.
            let _ = self.waiting.push_back(byte);
        }
    }

    fn unrouted(&mut self) {
        bump(&mut self.stats.unrouted);
    }

    fn transmit(&mut self, now: Instant) {
        let now = self.clock.advance(now);
        if !self.waiting.is_empty() && !self.raise() {
            return;
        }
        // A port that reports it is ready accepts at least one byte, so the loop ends.
        while let (front @ [_, ..], _) = self.waiting.as_slices() {
            match self.port.write(front) {
                Ok(0) => return,
                Ok(count) => {
                    self.moved_at = now;
                    for _ in 0..count.min(front.len()) {
                        let _ = self.waiting.pop_front();
                        self.uncounted = self.uncounted.saturating_add(1);
                    }
                }
                Err(_) => return bump(&mut self.stats.write),
            }
        }
        self.lower(now);
    }

    fn wake(&self, now: Instant) -> Option<Instant> {
        let driving = self.pin.is_some() && self.level != Some(false);
        if self.unread || (driving && self.waiting.is_empty()) {
            return Some(now + self.byte_time);
        }
        // A port that accepts nothing is tried again after a pause that equals the time since it last accepted a byte.
        let longest = self.byte_time.times(LONGEST_PAUSE);
        let stuck = self.clock.internal(now).since(self.moved_at);
        let pause = stuck.min(longest).max(self.byte_time);
        (!self.waiting.is_empty()).then(|| now + pause)
    }
}

/// Counters of one link since it was created. Each saturates at its maximum.
///
/// Errors in received frames are counted in [`Stats`](crate::Stats).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SerialStats {
    /// Number of bytes lost because they were not read in time.
    pub overrun: u32,
    /// Number of bytes that the serial port received without a stop bit (framing error).
    pub framing: u32,
    /// Number of bytes that the serial port received with the wrong parity bit.
    pub parity: u32,
    /// Number of bytes that the serial port received with noise on the line.
    pub noise: u32,
    /// Number of reads from the serial port that failed for a reason not counted above.
    pub other: u32,
    /// Number of failed writes, and of failed calls of `has_left`. A failed write is repeated.
    pub write: u32,
    /// Number of failed attempts to set the driver-enable pin. Each attempt is repeated.
    pub pin: u32,
    /// Number of frames dropped because the transmit queue was full: the port accepts no bytes. The relay sends
    /// important frames again.
    pub dropped: u32,
    /// Number of frames for a port that this driver does not have. The relay's [`Wiring`](crate::Wiring) then does not
    /// match the driver.
    pub unrouted: u32,
}

impl SerialStats {
    pub(crate) fn read_failed(&mut self, fault: Fault) {
        bump(match fault {
            Fault::Overrun => &mut self.overrun,
            Fault::Framing => &mut self.framing,
            Fault::Parity => &mut self.parity,
            Fault::Noise => &mut self.noise,
            Fault::Other => &mut self.other,
        });
    }
}
