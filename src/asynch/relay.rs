//! A relay that several tasks of one executor share: the one that runs its ports, and whoever has something for it.

use core::cell::{Cell, RefCell};
use core::fmt;
use core::future::{Future, poll_fn};
use core::task::{Context, Poll, Waker};

use crate::event::Event;
use crate::relay::{Port, Relay};
use crate::serial::SerialStats;

/// A relay, who is to be woken when it has changed, and what its ports count.
///
/// It is for tasks of one executor, on one core and at one priority: none of them waits for another, since none keeps the relay
/// across an `await`. What an interrupt has for the relay goes through a channel to such a task.
pub struct AsyncRelay<'a> {
    relay: RefCell<&'a mut Relay>,
    /// Whether something has come in since the ports were last looked after.
    changed: Cell<bool>,
    /// Who runs the ports.
    runner: Cell<Option<Waker>>,
    /// Who waits for an event.
    listener: Cell<Option<Waker>>,
    /// Upstream or shared, and downstream.
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
    /// The relay that tasks share from now on.
    pub fn new(relay: &'a mut Relay) -> Self {
        Self {
            relay: RefCell::new(relay),
            changed: Cell::new(true),
            runner: Cell::new(None),
            listener: Cell::new(None),
            stats: [const { Cell::new(ZERO) }; 2],
        }
    }

    /// Hands the relay to `work`, for a position, a sample or a mission; the ports are looked after once this task waits.
    /// `None` inside the `work` of another call, which has the relay already: nothing is done then.
    ///
    /// Constant work beside that of `work`.
    pub fn with<R>(&self, work: impl FnOnce(&mut Relay) -> R) -> Option<R> {
        let done = self.lend(work);
        self.poke();
        done
    }

    /// Lets `look` at the relay, with no word to its ports: for a setpoint or counters. `None` as with [`with`](Self::with).
    pub fn look<R>(&self, look: impl FnOnce(&Relay) -> R) -> Option<R> {
        self.lend(|relay| look(relay))
    }

    /// Completes with the next thing the firmware should know of. One task waits for it at a time; a second takes the place of the
    /// first. Safe to drop: an event that was not handed out is handed out next.
    ///
    /// Constant work each time it is polled.
    pub fn next_event(&self) -> impl Future<Output = Event> + '_ {
        poll_fn(|cx| {
            let event = self.lend(Relay::poll_event).flatten();
            if event.is_none() {
                keep(&self.listener, cx);
            }
            event.map_or(Poll::Pending, Poll::Ready)
        })
    }

    /// What has been counted at `port`: upstream and shared are one, since no relay has both.
    pub fn stats(&self, port: Port) -> SerialStats {
        self.counters(port).get()
    }

    /// The relay, without a word to who runs the ports.
    pub(super) fn lend<R>(&self, work: impl FnOnce(&mut Relay) -> R) -> Option<R> {
        Some(work(*self.relay.try_borrow_mut().ok()?))
    }

    /// Has the ports looked after again.
    pub(super) fn poke(&self) {
        self.changed.set(true);
        wake(&self.runner);
    }

    /// Whoever waits for an event should look again.
    pub(super) fn tell(&self) {
        wake(&self.listener);
    }

    /// Nothing that has come in so far is left to be looked after.
    pub(super) fn settle(&self) {
        self.changed.set(false);
    }

    /// Completes once something has come in.
    pub(super) fn changes(&self) -> impl Future<Output = ()> + '_ {
        poll_fn(|cx| {
            keep(&self.runner, cx);
            if self.changed.get() {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
    }

    /// Counts at `port`.
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

/// Keeps whom to wake, who may be there already.
pub(super) fn keep(place: &Cell<Option<Waker>>, cx: &Context<'_>) {
    let kept = place.take().filter(|waker| waker.will_wake(cx.waker()));
    place.set(Some(kept.unwrap_or_else(|| cx.waker().clone())));
}

pub(super) fn wake(place: &Cell<Option<Waker>>) {
    if let Some(waker) = place.take() {
        waker.wake_by_ref();
        place.set(Some(waker));
    }
}
