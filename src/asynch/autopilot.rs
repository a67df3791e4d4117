//! The link to an autopilot on an asynchronous port, beside the relay of its drone.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use core::fmt;
use core::future::{Future, poll_fn};
use core::task::{Poll, Waker};

use embassy_futures::select::{Either3, select, select3};
use embassy_futures::yield_now;
use embedded_io_async::{Read, Write};

use super::link::Clock;
use super::link::watched;
use super::relay::{AsyncRelay, keep, wake};
use crate::event::Event;
use crate::flight::autopilot::{Autopilot, AutopilotEvent};
use crate::serial::READ_LIMIT;
use crate::time::Duration;

/// So long a port that has failed, or is full, is left alone.
const PAUSE: Duration = Duration::from_millis(10);

/// The link to a drone's autopilot, which tasks share: the one that runs its port, and whoever has an event for it, or wants one.
///
/// It hands the relay where the drone is and whether its setpoint is flown, and the autopilot the setpoint. It is for tasks of the executor
/// that runs the relay's ports, as [`AsyncRelay`] is.
pub struct AsyncAutopilot {
    link: RefCell<Autopilot>,
    /// Something has come in, or has happened.
    news: Signal,
    /// There may be something to send.
    speech: Signal,
    /// Who waits for an event.
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
    /// Shares `link` between tasks.
    pub const fn new(link: Autopilot) -> Self {
        Self {
            link: RefCell::new(link),
            news: Signal::new(),
            speech: Signal::new(),
            listener: Cell::new(None),
        }
    }

    /// An event of the relay: the operator reads of those that matter in flight, and a new setpoint is told at once. Without it the
    /// autopilot hears of a setpoint the next time that it is told one, within a second.
    ///
    /// Constant work.
    pub fn handle_event(&self, event: Event) {
        if let Ok(mut link) = self.link.try_borrow_mut() {
            link.handle_event(event);
        }
        self.news.raise();
    }

    /// Completes with the next thing the firmware should know of the autopilot. One task waits for it at a time; a second takes the place of
    /// the first. Safe to drop: an event that was not handed out is handed out next.
    ///
    /// Constant work each time it is polled.
    pub fn next_event(&self) -> impl Future<Output = AutopilotEvent> + '_ {
        poll_fn(|cx| {
            let event = self.lend(Autopilot::poll_event).flatten();
            if event.is_none() {
                keep(&self.listener, cx);
            }
            event.map_or(Poll::Pending, Poll::Ready)
        })
    }

    /// Whether the relay's setpoint is flown.
    pub fn is_flown(&self) -> bool {
        self.lend(|link| link.is_flown()).unwrap_or(false)
    }

    /// Moves bytes between the link and its port, and places between the link and `relay`, for good. It is joined with, or spawned beside,
    /// what runs the relay's ports.
    ///
    /// Each time it is polled the port is read once ([`READ_LIMIT`] bytes at most), and written what the link has. A
    /// writer that never completes keeps nobody from hearing where the drone is. It may be dropped at any `await`, and called again: of a
    /// frame that was being written the rest is gone, which the autopilot's checksum tells.
    pub async fn run(
        &self,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        rx: &mut impl Read,
        tx: &mut impl Write,
    ) -> Infallible {
        let hears = self.hear(clock, rx);
        let drives = self.drive(relay, clock);
        let says = self.say(clock, tx);
        match select3(hears, drives, says).await {
            Either3::First(never) | Either3::Second(never) | Either3::Third(never) => never,
        }
    }

    /// Takes what comes in, for good.
    async fn hear(&self, clock: &impl Clock, rx: &mut impl Read) -> Infallible {
        let mut buffer = [0; READ_LIMIT];
        loop {
            let (read, waited) = watched(rx.read(&mut buffer)).await;
            match read {
                Ok(count @ 1..) => {
                    let bytes = buffer.get(..count).unwrap_or_default();
                    self.lend(|link| link.handle_bytes(clock.now(), bytes));
                    self.news.raise();
                    if !waited {
                        yield_now().await;
                    }
                }
                // The end of a stream that may go on, or a byte that is lost: the checksum tells.
                Ok(0) | Err(_) => clock.sleep_until(clock.now() + PAUSE).await,
            }
        }
    }

    /// Exchanges data between the link and the relay, for good.
    async fn drive(&self, relay: &AsyncRelay<'_>, clock: &impl Clock) -> Infallible {
        loop {
            self.news.settle();
            let now = clock.now();
            let exchanged = self.lend(|link| relay.lend(|relay| link.exchange(relay, now)));
            if exchanged.flatten().is_some_and(|(is_news, _)| is_news) {
                relay.poke();
            }
            wake(&self.listener);
            self.speech.raise();
            // What is said now is not due any more.
            yield_now().await;
            let due = self.lend(|link| link.poll_timeout(now)).unwrap_or(now);
            let due = due.max(now + PAUSE);
            select(self.news.raised(), clock.sleep_until(due)).await;
        }
    }

    /// Sends what there is, for good.
    async fn say(&self, clock: &impl Clock, tx: &mut impl Write) -> Infallible {
        loop {
            self.speech.settle();
            while let Some(frame) = self.lend(|link| link.poll_transmit(clock.now())).flatten() {
                if write(tx, &frame).await.is_none() {
                    clock.sleep_until(clock.now() + PAUSE).await;
                }
            }
            self.speech.raised().await;
        }
    }

    fn lend<T>(&self, work: impl FnOnce(&mut Autopilot) -> T) -> Option<T> {
        Some(work(&mut *self.link.try_borrow_mut().ok()?))
    }
}

/// Writes all of these bytes; `None` where it cannot.
async fn write(tx: &mut impl Write, mut bytes: &[u8]) -> Option<()> {
    while !bytes.is_empty() {
        match tx.write(bytes).await {
            Ok(count @ 1..) => bytes = bytes.get(count..).unwrap_or_default(),
            Ok(0) | Err(_) => return None,
        }
    }
    Some(())
}

/// Something that one future raises and another waits for.
struct Signal {
    is_raised: Cell<bool>,
    waits: Cell<Option<Waker>>,
}

impl Signal {
    const fn new() -> Self {
        Self {
            is_raised: Cell::new(false),
            waits: Cell::new(None),
        }
    }

    fn raise(&self) {
        self.is_raised.set(true);
        wake(&self.waits);
    }

    /// What was raised so far is being looked after.
    fn settle(&self) {
        self.is_raised.set(false);
    }

    /// Completes once it is raised.
    fn raised(&self) -> impl Future<Output = ()> + '_ {
        poll_fn(|cx| {
            keep(&self.waits, cx);
            if self.is_raised.get() {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
    }
}
