//! Companion on the asynchronous runner with a single relay, polled as long as it makes progress.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use embedded_io_async::{ErrorType, Read, Write};
use host_tests::fixtures;
use uav_relay::asynch::{AsyncAutopilot, AsyncRelay, Clock};
use uav_relay::flight::autopilot::Autopilot;
use uav_relay::{Instant, Settings};

/// Number of polls of the asynchronous runner per time step.
///
/// The polls suffice for a received frame, an iteration of the runner's loop and a dozen sent frames.
const POLLS: u32 = 64;

#[derive(Clone)]
struct Now(Rc<Cell<Instant>>);

impl Clock for Now {
    fn now(&self) -> Instant {
        self.0.get()
    }

    async fn sleep_until(&self, at: Instant) {
        poll_fn(|_| {
            if self.0.get() >= at {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
    }
}

#[derive(Clone, Default)]
struct Uart(Rc<RefCell<VecDeque<u8>>>);

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Read for Uart {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|_| {
            let mut bytes = self.0.borrow_mut();
            let count = bytes.len().min(into.len());
            for (place, byte) in into.iter_mut().zip(bytes.drain(..count)) {
                *place = byte;
            }
            match count {
                0 => Poll::Pending,
                _ => Poll::Ready(Ok(count)),
            }
        })
        .await
    }
}

impl Write for Uart {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().extend(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

pub(crate) struct Runner {
    now: Rc<Cell<Instant>>,
    incoming: Uart,
    outgoing: Uart,
    link: Rc<AsyncAutopilot>,
    task: Pin<Box<dyn Future<Output = Infallible>>>,
}

impl Runner {
    pub(crate) fn new(link: Autopilot, now: Instant) -> Self {
        let now = Rc::new(Cell::new(now));
        let (incoming, outgoing) = (Uart::default(), Uart::default());
        let link = Rc::new(AsyncAutopilot::new(link));
        let (mut rx, mut tx) = (incoming.clone(), outgoing.clone());
        let (runs, clock) = (link.clone(), Now(now.clone()));
        let task = Box::pin(async move {
            let mission = fixtures::mission(1);
            let mut relay = fixtures::relay(mission, 1, Settings::default());
            let relay = AsyncRelay::new(&mut relay);
            runs.run(&relay, &clock, &mut rx, &mut tx).await
        });
        Self {
            now,
            incoming,
            outgoing,
            link,
            task,
        }
    }

    pub(crate) fn handle_bytes(&mut self, bytes: &[u8]) {
        self.incoming.0.borrow_mut().extend(bytes);
    }

    /// Runs the autopilot task at `now`; returns the bytes that the task has written.
    pub(crate) fn run(&mut self, now: Instant) -> Vec<u8> {
        self.now.set(now);
        let mut cx = Context::from_waker(Waker::noop());
        for _ in 0..POLLS {
            assert!(self.task.as_mut().poll(&mut cx).is_pending());
        }
        self.outgoing.0.borrow_mut().drain(..).collect()
    }

    pub(crate) fn is_flown(&self) -> bool {
        self.link.is_flown()
    }
}
