//! Relay shared by several tasks of one executor: the task that runs its ports, and tasks with inputs.

use core::cell::{Cell, RefCell};
use core::fmt;
use core::future::{Future, poll_fn};
use core::task::{Context, Poll, Waker};

use crate::event::Event;
use crate::relay::{Port, Relay};
use crate::serial::SerialStats;

/// Relay shared by tasks, the wakers of these tasks, and the counters of the ports.
///
/// All tasks must run on one executor, on one core and at one priority. Tasks do not wait for each other, because none
/// holds the relay across an `await`. An interrupt passes its data to such a task through a channel.
pub struct AsyncRelay<'a> {
    relay: RefCell<&'a mut Relay>,
    /// True if the relay has new input that the task of its ports has not handled yet.
    changed: Cell<bool>,
    /// Waker of the task that runs the relay's ports.
    runner: Cell<Option<Waker>>,
    /// Waker of the task that waits for an event of the relay.
    listener: Cell<Option<Waker>>,
    /// Counters of the ports: entry 0 for the upstream or the shared port, entry 1 for the downstream port.
    stats: [Cell<SerialStats>; 2],
}

impl fmt::Debug for AsyncRelay<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AsyncRelay")
            .field("relay", &self.relay)
            .field("stats", &self.stats)
            .finish_non_exhaustive()
    }
}

impl<'a> AsyncRelay<'a> {
    /// Creates a relay that several tasks can share. It borrows the given `relay`.
    pub fn new(relay: &'a mut Relay) -> Self {
        Self {
            relay: RefCell::new(relay),
            changed: Cell::new(true),
            runner: Cell::new(None),
            listener: Cell::new(None),
            stats: [const { Cell::new(ZERO) }; 2],
        }
    }

    /// Passes the relay to `work`, and wakes the task of its ports. For example, `work` reports a position or a sample.
    /// The woken task runs as soon as the calling task waits.
    ///
    /// Returns `None`, and does nothing, if called from within the closure of a different call of `with` or `look`.
    /// Apart from `work` the call takes constant time.
    pub fn with<R>(&self, work: impl FnOnce(&mut Relay) -> R) -> Option<R> {
        let done = self.lend(work);
        self.notify_runner();
        done
    }

    /// Passes the relay to `look`, which reads for example the setpoint. Does not wake the task of the ports. Returns
    /// `None` if called from within the closure of a different call of `with` or `look`.
    pub fn look<R>(&self, look: impl FnOnce(&Relay) -> R) -> Option<R> {
        self.lend(|relay| look(relay))
    }

    /// Completes with the next event for the firmware. Only one task can wait at a time; a second task replaces the
    /// first. If the future is dropped, no event is lost. Takes constant time per poll.
    pub fn next_event(&self) -> impl Future<Output = Event> + '_ {
        poll_fn(|cx| {
            let event = self.lend(Relay::poll_event).flatten();
            if event.is_none() {
                store_waker(&self.listener, cx);
            }
            event.map_or(Poll::Pending, Poll::Ready)
        })
    }

    /// Returns the counters of `port`. The upstream and the shared port use the same counters, because a relay has
    /// either an upstream and a downstream port or a shared port.
    pub fn stats(&self, port: Port) -> SerialStats {
        self.counters(port).get()
    }

    /// Passes the relay to `work` without waking the task of the ports. Returns `None`, and does nothing, if called
    /// from within the closure of a different call that has borrowed the relay.
    pub(super) fn lend<R>(&self, work: impl FnOnce(&mut Relay) -> R) -> Option<R> {
        Some(work(*self.relay.try_borrow_mut().ok()?))
    }

    /// Records that the relay has new input, and wakes the task that runs the relay's ports.
    pub(super) fn notify_runner(&self) {
        self.changed.set(true);
        wake(&self.runner);
    }

    /// Wakes the task that waits for the relay's next event.
    pub(super) fn notify_listener(&self) {
        wake(&self.listener);
    }

    /// Records that the task of the ports has handled all inputs so far.
    pub(super) fn mark_handled(&self) {
        self.changed.set(false);
    }

    /// Completes once the relay has input that the task of the ports has not handled. If there already is such input,
    /// this completes at once.
    pub(super) fn changed(&self) -> impl Future<Output = ()> + '_ {
        poll_fn(|cx| {
            store_waker(&self.runner, cx);
            if self.changed.get() {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
    }

    pub(super) fn count(&self, port: Port, count: impl FnOnce(&mut SerialStats)) {
        let counters = self.counters(port);
        let mut stats = counters.get();
        count(&mut stats);
        counters.set(stats);
    }

    const fn counters(&self, port: Port) -> &Cell<SerialStats> {
        let [first, second] = &self.stats;
        match port {
            Port::Upstream | Port::Shared => first,
            Port::Downstream => second,
        }
    }
}

const ZERO: SerialStats = SerialStats {
    overrun: 0,
    framing: 0,
    parity: 0,
    noise: 0,
    other: 0,
    write: 0,
    pin: 0,
    dropped: 0,
    unrouted: 0,
};

/// Stores the current task's waker in `place`. Does nothing if the stored waker wakes the same task.
pub(super) fn store_waker(place: &Cell<Option<Waker>>, cx: &Context<'_>) {
    let kept = place.take().filter(|waker| waker.will_wake(cx.waker()));
    place.set(Some(kept.unwrap_or_else(|| cx.waker().clone())));
}

pub(super) fn wake(place: &Cell<Option<Waker>>) {
    if let Some(waker) = place.take() {
        waker.wake_by_ref();
        place.set(Some(waker));
    }
}
