//! Minimal executor for `uav_relay::asynch`: one task, time and sleep. All its unsafe code is here.

use core::cell::{Cell, RefCell};
use core::future::{Future, poll_fn};
use core::pin::Pin;
use core::task::{Context, Poll, RawWaker, RawWakerVTable, Waker};

use uav_relay::Instant;

use crate::firmware::chip;
use crate::firmware::clock::{self, Clock};

/// Clock of the board, and the earliest time at which the task must be polled, if any.
pub(crate) struct Time {
    clock: RefCell<Clock>,
    next: Cell<Option<Instant>>,
}

impl Time {
    pub(crate) const fn new(clock: Clock) -> Self {
        Self {
            clock: RefCell::new(clock),
            next: Cell::new(None),
        }
    }
}

impl uav_relay::asynch::Clock for Time {
    fn now(&self) -> Instant {
        match self.clock.try_borrow_mut() {
            Ok(mut clock) => clock.now(),
            Err(_) => Instant::from_micros(clock::micros()),
        }
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        poll_fn(move |_| {
            if self.now() >= at {
                return Poll::Ready(());
            }
            let next = self.next.get().map_or(at, |next| next.min(at));
            self.next.set(Some(next));
            Poll::Pending
        })
    }
}

/// Runs `task` forever: polls it after each interrupt or wake-up, and at the time that it requested.
///
/// Calls `also` after every poll.
pub(crate) fn run<F: Future>(mut task: Pin<&mut F>, time: &Time, mut also: impl FnMut()) -> ! {
    let waker = waker();
    let mut cx = Context::from_waker(&waker);
    loop {
        time.next.set(None);
        // The task never completes.
        let _ = task.as_mut().poll(&mut cx);
        also();
        if let Ok(mut clock) = time.clock.try_borrow_mut() {
            let now = clock.now();
            clock.sleep(Some(chip::latest(now, time.next.get())));
        }
    }
}

fn waker() -> Waker {
    const WAKES: RawWakerVTable = RawWakerVTable::new(
        |_| RawWaker::new(core::ptr::null(), &WAKES),
        |_| clock::wake(),
        |_| clock::wake(),
        |_| {},
    );
    // SAFETY: its functions access only an atomic static.
    unsafe { Waker::from_raw(RawWaker::new(core::ptr::null(), &WAKES)) }
}
