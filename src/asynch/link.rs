//! One port: a reader, a writer, the frames that wait for it, and its driver-enable pin.

use core::cell::RefCell;
use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;

use embassy_futures::yield_now;
use embedded_hal::digital::OutputPin;
use embedded_io_async::{Read, Write};

use super::clock::Clock;
use super::frames::Frames;
use super::relay::AsyncRelay;
use crate::relay::Port;
use crate::serial::{Fault, NoPin, READ_LIMIT, byte_time};
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::frame::MAX_FRAME;

/// How long a port that has failed is left alone, in byte times.
const PAUSE: u32 = 128;

/// How long the pin stays high behind the last byte, in byte times: one for the byte that is on the line, one for clocks that differ.
const HOLD: u32 = 2;

/// What ends a frame, and all that was left of one.
const DELIMITER: [u8; 1] = [0];

/// A port's reader and its writer, the frames that wait, and its driver-enable pin if it has one.
///
/// The pin is high from before the first byte of a frame until the last waiting frame has left, and low otherwise: when the writer's
/// `flush` says so, or when its bytes have had the time they take, whichever is later. (`flush` of some HALs leaves a FIFO full.)
#[derive(Debug)]
pub struct AsyncLink<R, W, D = NoPin> {
    rx: R,
    tx: Sender<W, D>,
    waiting: RefCell<Frames>,
}

/// The writer's side.
#[derive(Debug)]
struct Sender<W, D> {
    tx: W,
    pin: Option<D>,
    byte_time: Duration,
    /// When every byte that was handed over has left, if each did as soon as it could.
    quiet_at: Instant,
    /// Whether the line may have seen the beginning of a frame and not its end.
    cut: bool,
}

impl<R: Read, W: Write> AsyncLink<R, W> {
    /// A link over a reader and a writer at `baud` bit/s, with ten bits a byte.
    pub fn new(rx: R, tx: W, baud: u32) -> Self {
        Self::with_pin(rx, tx, baud, None)
    }
}

impl<R: Read, W: Write, D: OutputPin> AsyncLink<R, W, D> {
    /// The same with a pin that is high while this relay sends.
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
            waiting: RefCell::new(Frames::new()),
        }
    }

    /// What receives for good, what sends for good, and the frames between the relay and the latter.
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
        let waiting = &self.waiting;
        let pause = self.tx.byte_time.times(PAUSE);
        let receives = receive(&mut self.rx, port, relay, clock, pause);
        let sends = self.tx.run(port, waiting, relay, clock, pause);
        (receives, sends, waiting)
    }
}

impl<R, W, D> AsyncLink<R, W, D> {
    /// Reader, writer and pin. What was waiting is gone, and the pin stays as it is.
    pub fn release(self) -> (R, W, Option<D>) {
        (self.rx, self.tx.tx, self.tx.pin)
    }
}

/// Hands the relay what comes in, for good.
async fn receive<R: Read>(
    rx: &mut R,
    port: Port,
    relay: &AsyncRelay<'_>,
    clock: &impl Clock,
    pause: Duration,
) -> Infallible {
    let mut buffer = [0; READ_LIMIT];
    loop {
        let (read, waited) = watched(rx.read(&mut buffer)).await;
        // No `await` stands between a byte that was read and the relay.
        match read {
            Ok(count @ 1..) => {
                let bytes = buffer.get(..count).unwrap_or_default();
                relay.lend(|relay| relay.handle_bytes(clock.now(), port, bytes));
                relay.poke();
                if !waited {
                    yield_now().await;
                }
            }
            // The end of a stream that may go on.
            Ok(0) => clock.sleep_until(clock.now() + pause).await,
            Err(_) => {
                relay.count(port, |stats| stats.read_failed(Fault::Other));
                // One bad byte is no reason to miss the next; a port that only fails must not keep everybody from their work.
                yield_now().await;
                if !waited {
                    clock.sleep_until(clock.now() + pause).await;
                }
            }
        }
    }
}

impl<W: Write, D: OutputPin> Sender<W, D> {
    /// Sends what waits, for good.
    async fn run(
        &mut self,
        port: Port,
        waiting: &RefCell<Frames>,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        pause: Duration,
    ) -> Infallible {
        // Low until there is something to say.
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

    /// Sends a frame, behind a delimiter if the one before it may have been cut short; whether it could.
    async fn send(&mut self, frame: &[u8], clock: &impl Clock) -> bool {
        if self.cut && !self.write(&DELIMITER, clock).await {
            return false;
        }
        // Whatever becomes of this future before the last byte is out: the next frame begins with a delimiter.
        self.cut = true;
        if !self.write(frame, clock).await {
            return false;
        }
        self.cut = false;
        true
    }

    /// Writes all of these bytes; whether it could.
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

    /// Waits until every byte has left, where a pin depends on it.
    async fn flush(&mut self, port: Port, relay: &AsyncRelay<'_>, clock: &impl Clock) {
        if self.pin.is_some() && self.quiet_at > Instant::ZERO {
            if self.tx.flush().await.is_err() {
                relay.count(port, |stats| bump(&mut stats.write));
            }
            let left_at = self.quiet_at.max(clock.now()) + self.byte_time.times(HOLD);
            clock.sleep_until(left_at).await;
        }
    }

    /// Sets the pin, if there is one; whether it could. Where it could not, some time has gone by.
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

/// Completes with the length of the first frame that waits, once there is one. Whoever puts it there wakes this task.
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
                    // The relay may have more to say.
                    relay.poke();
                }
                Poll::Ready(len)
            }
        }
    })
}

/// What comes of `future`, and whether it was waited for: if not, its caller has the executor to give back.
pub(super) async fn watched<F: Future>(future: F) -> (F::Output, bool) {
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
