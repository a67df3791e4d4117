//! Cost of the drivers of a relay's ports for one sweep message, polled and asynchronous.

use core::cell::Cell;
use core::convert::Infallible;
use core::future::{Future, pending, poll_fn};
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use cortex_m_semihosting::hprintln;
use embedded_io_async::{ErrorType, Read, Write};
use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, Clock};
use uav_relay::serial::{Fault, Pair, SerialLink, SerialPort};
use uav_relay::{Instant, MAX_FRAME, Mission, Phase, Relay, Settings};

use super::counter::{instructions, next_frame, relay};
use super::missions::mission;

/// Bit rate of the ports, bit/s.
const BAUD: u32 = 115_200;

/// Serial port in memory. `coming` is the received frame with the range of its unread bytes; `gone` counts sent bytes.
struct Memory {
    coming: Cell<([u8; MAX_FRAME], usize, usize)>,
    gone: Cell<usize>,
}

impl Memory {
    const fn new(frame: [u8; MAX_FRAME], len: usize) -> Self {
        Self {
            coming: Cell::new((frame, 0, len)),
            gone: Cell::new(0),
        }
    }

    fn take(&self, into: &mut [u8]) -> usize {
        let (frame, from, len) = self.coming.get();
        let bytes = frame.get(from..len).unwrap_or_default();
        let count = bytes.len().min(into.len());
        for (place, byte) in into.iter_mut().zip(bytes) {
            *place = *byte;
        }
        self.coming.set((frame, from + count, len));
        count
    }

    fn give(&self, bytes: &[u8]) -> usize {
        self.gone.set(self.gone.get() + bytes.len());
        bytes.len()
    }
}

#[derive(Clone, Copy)]
struct End<'m>(&'m Memory);

impl SerialPort for End<'_> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        Ok(self.0.take(into))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        Ok(self.0.give(bytes))
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        Ok(None)
    }
}

impl ErrorType for End<'_> {
    type Error = Infallible;
}

impl Read for End<'_> {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|_| match self.0.take(into) {
            0 => Poll::Pending,
            count => Poll::Ready(Ok(count)),
        })
        .await
    }
}

impl Write for End<'_> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(self.0.give(bytes))
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

struct FixedClock(Instant);

impl Clock for FixedClock {
    fn now(&self) -> Instant {
        self.0
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        let passed = self.0 >= at;
        async move {
            if !passed {
                pending::<()>().await;
            }
        }
    }
}

/// Returns relay 2 of 3, and the first sweep message (search for positions) from relay 1.
///
/// The message is given as the bytes of its frame, their number, and the time of sending.
fn relay_and_sweep() -> Option<(Relay, [u8; MAX_FRAME], usize, Instant)> {
    const THREE: Mission = mission(3);
    let settings = Settings {
        predict: false,
        ..Settings::default()
    };
    let mut head = relay(1, settings, THREE);
    let mut now = Instant::ZERO;
    while head.phase() == Phase::Planning {
        now = head.poll_timeout().unwrap_or(now);
        head.handle_timeout(now);
    }
    let (frame, len) = next_frame(&mut head, now)?;
    Some((relay(2, settings, THREE), frame, len, now))
}

/// Measures the instructions for relay 2 to handle a sweep message, with blocking and async ports.
///
/// A sweep message tries several target SIRs along the chain.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn runners() {
    let Some((mut middle, frame, len, now)) = relay_and_sweep() else {
        return;
    };
    let (up, down) = (Memory::new(frame, len), Memory::new([0; MAX_FRAME], 0));
    let mut ports = Pair::new(
        SerialLink::new(End(&up), BAUD),
        SerialLink::new(End(&down), BAUD),
    );
    let mut polls = 0;
    let mut polled = 0;
    while down.gone.get() == 0 && polls < 9 {
        polled += instructions(|| ports.poll(now, &mut middle, |_| true));
        polls += 1;
    }
    hprintln!("polled_sweep {}", polled);
    hprintln!("polled_polls {}", polls);
    hprintln!("polled_gone {}", down.gone.get());
    ports.poll(now, &mut middle, |_| true);
    hprintln!(
        "polled_idle {}",
        instructions(|| ports.poll(now, &mut middle, |_| true))
    );
    let polled_size = size_of_val(&ports);
    hprintln!("polled_size {}", polled_size);
    async_runner();
}

fn async_runner() {
    let Some((mut middle, frame, len, now)) = relay_and_sweep() else {
        return;
    };
    let (up, down) = (
        Memory::new([0; MAX_FRAME], 0),
        Memory::new([0; MAX_FRAME], 0),
    );
    let time = FixedClock(now);
    let relay = AsyncRelay::new(&mut middle);
    let mut ports = AsyncPair::new(
        AsyncLink::new(End(&up), End(&up), BAUD),
        AsyncLink::new(End(&down), End(&down), BAUD),
    );
    let run = ports.run(&relay, &time, |_| true);
    hprintln!("async_size {}", size_of_val(&run));
    let mut run = pin!(run);
    let mut cx = Context::from_waker(Waker::noop());
    let mut poll = || {
        // The future never completes.
        let _ = run.as_mut().poll(&mut cx);
    };
    // Both ports wait for bytes.
    poll();
    poll();
    up.coming.set((frame, 0, len));
    let (mut polls, mut total) = (0, 0);
    while down.gone.get() == 0 && polls < 9 {
        total += instructions(&mut poll);
        polls += 1;
    }
    hprintln!("async_sweep {}", total);
    hprintln!("async_polls {}", polls);
    hprintln!("async_gone {}", down.gone.get());
    poll();
    hprintln!("async_idle {}", instructions(&mut poll));
}
