//! Asynchronous port: reader, writer, frame queue, and driver-enable pin.

use core::cell::RefCell;
use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;
use embassy_futures::yield_now;
use embedded_hal::digital::OutputPin;
use embedded_io_async::{Read, Write};
use heapless::Deque;

use crate::asynch::relay::AsyncRelay;
use crate::relay::Port;
use crate::serial::{Fault, NoPin, READ_LIMIT, byte_time};
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::frame::{FrameBuf, MAX_FRAME};

/// Pause after a failure of a port or the end of its stream, in byte times (11 ms at 115 200 baud).
const PAUSE: u32 = 128;

/// Time in byte times for which the driver-enable pin stays high after the last byte's computed end.
///
/// The first byte time covers a byte that the port may still be sending. The second covers the tolerance of the port's
/// clock.
const PIN_HOLD: u32 = 2;

/// Delimiter byte that ends every frame. After a frame that was cut off, an extra delimiter is sent before the next
/// frame.
const DELIMITER: [u8; 1] = [0];

/// Link of a port: reader and writer, frame queue, and driver-enable pin if there is one.
///
/// The pin is high from before the first byte of a frame until the last queued frame has left, and low otherwise. A
/// frame has left after the writer's `flush` and after the transmission time of its bytes, whichever is later. The
/// reason is that `flush` of some HALs does not empty a FIFO.
#[derive(Debug)]
pub struct AsyncLink<R, W, D = NoPin> {
    rx: R,
    tx: Sender<W, D>,
    queue: RefCell<Frames>,
}

/// Sending half of a link: the port's writer, and the driver-enable pin if there is one.
#[derive(Debug)]
struct Sender<W, D> {
    tx: W,
    pin: Option<D>,
    byte_time: Duration,
    /// Time at which all bytes written so far have left the port, computed from the baud rate.
    quiet_at: Instant,
    /// True if the last frame is possibly incomplete, because a write failed or was cancelled.
    cut: bool,
}

impl<R: Read, W: Write> AsyncLink<R, W> {
    /// Creates a link over a reader and a writer at `baud` bit/s, with 10 bits per byte.
    pub fn new(rx: R, tx: W, baud: u32) -> Self {
        Self::with_pin(rx, tx, baud, None)
    }
}

impl<R: Read, W: Write, D: OutputPin> AsyncLink<R, W, D> {
    /// Creates a link with a driver-enable pin, which is high while this relay sends.
    pub fn half_duplex(rx: R, tx: W, baud: u32, pin: D) -> Self {
        Self::with_pin(rx, tx, baud, Some(pin))
    }

    fn with_pin(rx: R, tx: W, baud: u32, pin: Option<D>) -> Self {
        Self {
            rx,
            tx: Sender {
                tx,
                pin,
                byte_time: byte_time(baud),
                quiet_at: Instant::ZERO,
                cut: false,
            },
            queue: RefCell::new(Frames::new()),
        }
    }

    /// Returns the future that receives, the future that sends, and the queue of frames to send.
    pub(super) fn ends<'l>(
        &'l mut self,
        port: Port,
        relay: &'l AsyncRelay<'_>,
        clock: &'l impl Clock,
    ) -> (
        impl Future<Output = Infallible> + 'l,
        impl Future<Output = Infallible> + 'l,
        &'l RefCell<Frames>,
    ) {
        let waiting = &self.queue;
        let pause = self.tx.byte_time.times(PAUSE);
        let receives = receive(&mut self.rx, port, relay, clock, pause);
        let sends = self.tx.run(port, waiting, relay, clock, pause);
        (receives, sends, waiting)
    }
}

impl<R, W, D> AsyncLink<R, W, D> {
    /// Returns reader, writer and pin. Queued frames are lost, and the pin keeps its level.
    pub fn release(self) -> (R, W, Option<D>) {
        (self.rx, self.tx.tx, self.tx.pin)
    }
}

/// Reads bytes from a port and passes them to the relay, forever.
async fn receive<R: Read>(
    rx: &mut R,
    port: Port,
    relay: &AsyncRelay<'_>,
    clock: &impl Clock,
    pause: Duration,
) -> Infallible {
    let mut buffer = [0; READ_LIMIT];
    loop {
        let (read, waited) = track_pending(rx.read(&mut buffer)).await;
        // There is no `await` between reading bytes and passing them to the relay.
        match read {
            Ok(count @ 1..) => {
                let bytes = buffer.get(..count).unwrap_or_default();
                relay.lend(|relay| relay.handle_bytes(clock.now(), port, bytes));
                relay.notify_runner();
                if !waited {
                    yield_now().await;
                }
            }
            // The stream has ended, but may continue.
            Ok(0) => clock.sleep_until(clock.now() + pause).await,
            Err(_) => {
                relay.count(port, |stats| stats.read_failed(Fault::Other));
                // Reading continues at once after a single bad byte. But a port whose every read fails must not block
                // the other tasks.
                yield_now().await;
                if !waited {
                    clock.sleep_until(clock.now() + pause).await;
                }
            }
        }
    }
}

impl<W: Write, D: OutputPin> Sender<W, D> {
    /// Sends the frames of the queue and drives the driver-enable pin, forever.
    async fn run(
        &mut self,
        port: Port,
        waiting: &RefCell<Frames>,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        pause: Duration,
    ) -> Infallible {
        // With this initial state the first iteration sets the pin low.
        let mut high = true;
        let mut frame = [0; MAX_FRAME];
        loop {
            if is_empty(waiting) && high {
                self.flush(port, relay, clock).await;
                if is_empty(waiting) && self.drive(false, port, relay, clock, pause).await {
                    high = false;
                }
                continue;
            }
            let len = next(waiting, relay, &mut frame).await;
            while !self.drive(true, port, relay, clock, pause).await {}
            high = true;
            let frame = frame.get(..len).unwrap_or_default();
            while !self.send(frame, clock).await {
                relay.count(port, |stats| bump(&mut stats.write));
                clock.sleep_until(clock.now() + pause).await;
            }
        }
    }

    /// Sends `frame`; returns true on success. If the previous frame is possibly incomplete, a delimiter is sent first.
    async fn send(&mut self, frame: &[u8], clock: &impl Clock) -> bool {
        if self.cut && !self.write(&DELIMITER, clock).await {
            return false;
        }
        // If this future is dropped before the last byte is written, the next frame starts with a delimiter.
        self.cut = true;
        if !self.write(frame, clock).await {
            return false;
        }
        self.cut = false;
        true
    }

    /// Writes all `bytes` to the port; returns true on success.
    async fn write(&mut self, mut bytes: &[u8], clock: &impl Clock) -> bool {
        while !bytes.is_empty() {
            let begun = clock.now();
            let count = match self.tx.write(bytes).await {
                Ok(count @ 1..) => count.min(bytes.len()),
                Ok(0) | Err(_) => return false,
            };
            let taken = u32::try_from(count).unwrap_or(u32::MAX);
            self.quiet_at = self.quiet_at.max(begun) + self.byte_time.times(taken);
            bytes = bytes.get(count..).unwrap_or_default();
        }
        true
    }

    /// Waits until every written byte has left the port. The driver-enable pin must stay high until then. Does nothing
    /// without a pin.
    async fn flush(&mut self, port: Port, relay: &AsyncRelay<'_>, clock: &impl Clock) {
        if self.pin.is_some() && self.quiet_at > Instant::ZERO {
            if self.tx.flush().await.is_err() {
                relay.count(port, |stats| bump(&mut stats.write));
            }
            let left_at = self.quiet_at.max(clock.now()) + self.byte_time.times(PIN_HOLD);
            clock.sleep_until(left_at).await;
        }
    }

    /// Sets the driver-enable pin high or low. Returns true on success, and if there is no pin. If setting the pin
    /// fails, the function waits for the time `pause` and returns false.
    async fn drive(
        &mut self,
        high: bool,
        port: Port,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        pause: Duration,
    ) -> bool {
        let Some(pin) = &mut self.pin else {
            return true;
        };
        let set = if high { pin.set_high() } else { pin.set_low() };
        if set.is_err() {
            relay.count(port, |stats| bump(&mut stats.pin));
            clock.sleep_until(clock.now() + pause).await;
        }
        set.is_ok()
    }
}

fn is_empty(waiting: &RefCell<Frames>) -> bool {
    waiting.try_borrow().is_ok_and(|waiting| waiting.is_empty())
}

/// Moves the next queued frame into `frame`, and completes with the frame's length, bytes. This future registers no
/// waker: the task that queues a frame must wake the task that polls this future.
fn next<'f>(
    waiting: &'f RefCell<Frames>,
    relay: &'f AsyncRelay<'_>,
    frame: &'f mut [u8; MAX_FRAME],
) -> impl Future<Output = usize> + 'f {
    poll_fn(|_| {
        let Ok(mut waiting) = waiting.try_borrow_mut() else {
            return Poll::Pending;
        };
        let was_full = !waiting.has_room();
        match waiting.pop(frame) {
            0 => Poll::Pending,
            len => {
                if was_full {
                    // The relay may have more frames to send.
                    relay.notify_runner();
                }
                Poll::Ready(len)
            }
        }
    })
}

/// Awaits `future`. Returns its output, and true if the future was pending at least once.
///
/// If `future` was never pending, the caller must yield to the executor, so that a port that is always ready does not
/// block other tasks.
pub(super) async fn track_pending<F: Future>(future: F) -> (F::Output, bool) {
    let mut future = pin!(future);
    let mut waited = false;
    let output = poll_fn(|cx| {
        let polled = future.as_mut().poll(cx);
        waited |= polled.is_pending();
        polled
    })
    .await;
    (output, waited)
}

/// Capacity of a frame queue, bytes: two frames of maximum length. The frame that the port is sending is not in the
/// queue.
const CAPACITY: usize = 2 * MAX_FRAME;

/// Queued frames in the order of sending, each with its delimiter.
#[derive(Debug)]
pub(super) struct Frames(Deque<u8, CAPACITY>);

impl Frames {
    pub(super) const fn new() -> Self {
        Self(Deque::new())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns true if one more frame of any length fits into the queue.
    pub(super) fn has_room(&self) -> bool {
        CAPACITY.saturating_sub(self.0.len()) >= MAX_FRAME
    }

    /// Queues a complete frame for sending. Returns false if there is no room for it.
    pub(super) fn push(&mut self, frame: &[u8]) -> bool {
        let fits = frame.len() <= CAPACITY.saturating_sub(self.0.len());
        if fits {
            for &byte in frame {
                // The capacity was checked above.
                let _ = self.0.push_back(byte);
            }
        }
        fits
    }

    /// Moves the first queued frame into `frame` and returns its length, bytes; 0 if there is none.
    pub(super) fn pop(&mut self, frame: &mut FrameBuf) -> usize {
        let mut len = 0;
        for place in frame {
            let Some(byte) = self.0.pop_front() else {
                break;
            };
            *place = byte;
            len += 1;
            if byte == 0 {
                break;
            }
        }
        len
    }
}

/// Time and timers of an executor, for example `embassy-time`, `rtic-monotonics` or a virtual clock. A delay alone
/// (`embedded-hal-async`'s `DelayNs`) is not enough, because the relay needs the current time.
pub trait Clock {
    /// Returns the present time since an arbitrary start. The result never decreases from call to call.
    fn now(&self) -> Instant;

    /// Completes at time `at`, or at once if `at` is in the past. If a different event comes first, the future is
    /// dropped, and a new one is created later.
    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()>;
}

impl<C: Clock> Clock for &C {
    fn now(&self) -> Instant {
        C::now(self)
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        C::sleep_until(self, at)
    }
}

#[cfg(test)]
mod tests {
    use super::{Frames, MAX_FRAME};

    #[test]
    fn the_queue_keeps_frames_whole_and_in_order() {
        let mut frames = Frames::new();
        let mut longest = [7; MAX_FRAME];
        longest[MAX_FRAME - 1] = 0;
        assert!(frames.push(&[1, 2, 0]) && frames.push(&longest));
        assert!(!frames.has_room());
        assert!(!frames.push(&longest), "three bytes short");
        assert!(frames.push(&[3, 0]));
        let mut frame = [0; MAX_FRAME];
        assert_eq!(frames.pop(&mut frame), 3);
        assert_eq!(frame[..3], [1, 2, 0]);
        assert_eq!(frames.pop(&mut frame), MAX_FRAME);
        assert_eq!(frame, longest);
        assert_eq!((frames.pop(&mut frame), frame[0]), (2, 3));
        assert_eq!(frames.pop(&mut frame), 0);
        assert!(frames.is_empty() && frames.has_room());
    }
}
