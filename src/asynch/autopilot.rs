//! Link to an autopilot on an asynchronous port, next to the relay of the same drone.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use core::fmt;
use core::future::{Future, poll_fn};
use core::task::{Poll, Waker};

use embassy_futures::select::{Either3, select, select3};
use embassy_futures::yield_now;
use embedded_io_async::{Read, Write};

use super::link::Clock;
use super::link::track_pending;
use super::relay::{AsyncRelay, store_waker, wake};
use crate::event::Event;
use crate::flight::autopilot::{Autopilot, AutopilotEvent};
use crate::serial::READ_LIMIT;
use crate::time::Duration;

/// Pause after an operation on the autopilot's port has failed, or has transferred no byte.
///
/// Also the minimum time between two data exchanges with the relay that a timer starts. Received bytes and events of
/// the relay start an exchange at once.
const PAUSE: Duration = Duration::from_millis(10);

/// Link to a drone's autopilot that several tasks share.
///
/// One task runs the port. Others pass events to the link or wait for its events. The link passes the drone's position
/// and control state to the relay, and the setpoint to the autopilot. All tasks run on the executor of the relay's
/// ports, as with [`AsyncRelay`].
pub struct AsyncAutopilot {
    link: RefCell<Autopilot>,
    /// Signal that starts a data exchange with the relay. Raised by received bytes and by events of the relay.
    exchange_signal: Signal,
    /// Signal that starts the transmission of frames to the autopilot.
    send_signal: Signal,
    /// Waker of the task that waits in `next_event`.
    listener: Cell<Option<Waker>>,
}

impl fmt::Debug for AsyncAutopilot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AsyncAutopilot")
            .field("link", &self.link)
            .finish_non_exhaustive()
    }
}

impl AsyncAutopilot {
    /// Creates a link that several tasks can share. It contains the given autopilot link `link`.
    pub const fn new(link: Autopilot) -> Self {
        Self {
            link: RefCell::new(link),
            exchange_signal: Signal::new(),
            send_signal: Signal::new(),
            listener: Cell::new(None),
        }
    }

    /// Passes an event of the relay to the autopilot link. The operator is sent a text about events such as a lost
    /// neighbour, and the autopilot is sent a new setpoint at once.
    ///
    /// Without this call a new setpoint reaches the autopilot with the next data exchange that a timer starts, within a
    /// second. Constant work.
    pub fn handle_event(&self, event: Event) {
        if let Ok(mut link) = self.link.try_borrow_mut() {
            link.handle_event(event);
        }
        self.exchange_signal.raise();
    }

    /// Completes with the next event of the autopilot link.
    ///
    /// Only one task can wait at a time: a second task replaces the first, which is no longer woken. If the future is
    /// dropped, the event is kept for the next call. Constant work per poll.
    pub fn next_event(&self) -> impl Future<Output = AutopilotEvent> + '_ {
        poll_fn(|cx| {
            let event = self.lend(Autopilot::poll_event).flatten();
            if event.is_none() {
                store_waker(&self.listener, cx);
            }
            event.map_or(Poll::Pending, Poll::Ready)
        })
    }

    /// Returns true while the relay controls the drone: the drone flies to the setpoint or hovers there.
    pub fn is_flown(&self) -> bool {
        self.lend(|link| link.is_flown()).unwrap_or(false)
    }

    /// Moves bytes between the link and its port, and data between the link and `relay`, forever.
    ///
    /// Join it with the future that runs the relay's ports, or spawn both. Each poll reads the port once
    /// ([`READ_LIMIT`] bytes at most) and writes the pending frames. A writer that never completes does not delay the
    /// reader. The future can be dropped at any `await`, and created again. The unsent rest of a frame is then lost,
    /// and the autopilot detects this by the checksum.
    pub async fn run(
        &self,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        rx: &mut impl Read,
        tx: &mut impl Write,
    ) -> Infallible {
        let receives = self.receive(clock, rx);
        let exchanges = self.exchange(relay, clock);
        let sends = self.send(clock, tx);
        match select3(receives, exchanges, sends).await {
            Either3::First(never) | Either3::Second(never) | Either3::Third(never) => never,
        }
    }

    /// Passes bytes received from the autopilot's port to the link, forever.
    async fn receive(&self, clock: &impl Clock, rx: &mut impl Read) -> Infallible {
        let mut buffer = [0; READ_LIMIT];
        loop {
            let (read, waited) = track_pending(rx.read(&mut buffer)).await;
            match read {
                Ok(count @ 1..) => {
                    let bytes = buffer.get(..count).unwrap_or_default();
                    self.lend(|link| link.handle_bytes(clock.now(), bytes));
                    self.exchange_signal.raise();
                    if !waited {
                        yield_now().await;
                    }
                }
                // The stream has ended but may continue. Or a byte was lost, which the checksum detects.
                Ok(0) | Err(_) => clock.sleep_until(clock.now() + PAUSE).await,
            }
        }
    }

    /// Exchanges positions, control state and setpoints between the link and the relay, forever.
    async fn exchange(&self, relay: &AsyncRelay<'_>, clock: &impl Clock) -> Infallible {
        loop {
            self.exchange_signal.clear();
            let now = clock.now();
            let exchanged = self.lend(|link| relay.lend(|relay| link.exchange(relay, now)));
            if exchanged.flatten().is_some_and(|(changed, _)| changed) {
                relay.notify_runner();
            }
            wake(&self.listener);
            self.send_signal.raise();
            // Frames that this exchange has sent are no longer due.
            yield_now().await;
            let due = self.lend(|link| link.poll_timeout(now)).unwrap_or(now);
            let due = due.max(now + PAUSE);
            select(self.exchange_signal.raised(), clock.sleep_until(due)).await;
        }
    }

    /// Sends the link's pending frames to the autopilot's port, forever.
    async fn send(&self, clock: &impl Clock, tx: &mut impl Write) -> Infallible {
        loop {
            self.send_signal.clear();
            while let Some(frame) = self.lend(|link| link.poll_transmit(clock.now())).flatten() {
                if write(tx, &frame).await.is_none() {
                    clock.sleep_until(clock.now() + PAUSE).await;
                }
            }
            self.send_signal.raised().await;
        }
    }

    fn lend<T>(&self, work: impl FnOnce(&mut Autopilot) -> T) -> Option<T> {
        Some(work(&mut *self.link.try_borrow_mut().ok()?))
    }
}

/// Writes all `bytes` to the port. Returns `None` if the port fails or accepts nothing.
async fn write(tx: &mut impl Write, mut bytes: &[u8]) -> Option<()> {
    while !bytes.is_empty() {
        match tx.write(bytes).await {
            Ok(count @ 1..) => bytes = bytes.get(count..).unwrap_or_default(),
            Ok(0) | Err(_) => return None,
        }
    }
    Some(())
}

/// Flag with a waker: one future raises the flag, and a second future waits until it is raised.
struct Signal {
    is_raised: Cell<bool>,
    waker: Cell<Option<Waker>>,
}

impl Signal {
    const fn new() -> Self {
        Self {
            is_raised: Cell::new(false),
            waker: Cell::new(None),
        }
    }

    fn raise(&self) {
        self.is_raised.set(true);
        wake(&self.waker);
    }

    /// Clears the signal. Call it before handling the new input, so that input that arrives later raises the signal
    /// again.
    fn clear(&self) {
        self.is_raised.set(false);
    }

    /// Completes once the signal is raised.
    fn raised(&self) -> impl Future<Output = ()> + '_ {
        poll_fn(|cx| {
            store_waker(&self.waker, cx);
            if self.is_raised.get() {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
    }
}
