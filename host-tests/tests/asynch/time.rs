//! Virtual time for any executor: when all tasks are idle, it jumps to the next timer.

use std::cell::{Cell, RefCell};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::{Poll, Waker};

use futures_executor::LocalPool;
use uav_relay::Instant;
use uav_relay::asynch::Clock;

#[derive(Clone, Default)]
pub(crate) struct Time(Rc<Inner>);

#[derive(Default)]
struct Inner {
    now: Cell<Instant>,
    /// Wakers of waiting tasks by wake-up time. Of tasks with equal times, the last task that began to wait wakes first.
    sleepers: RefCell<BTreeMap<(Instant, Reverse<u64>), Waker>>,
    asked: Cell<u64>,
}

impl Clock for Time {
    fn now(&self) -> Instant {
        self.0.now.get()
    }

    async fn sleep_until(&self, at: Instant) {
        poll_fn(|cx| {
            if self.0.now.get() >= at {
                return Poll::Ready(());
            }
            self.0.asked.set(self.0.asked.get() + 1);
            let key = (at, Reverse(self.0.asked.get()));
            self.0.sleepers.borrow_mut().insert(key, cx.waker().clone());
            Poll::Pending
        })
        .await;
    }
}

impl Time {
    /// Runs the tasks of `pool` in virtual time until `until`.
    pub(crate) fn run(&self, pool: &mut LocalPool, until: Instant) {
        loop {
            pool.run_until_stalled();
            let next = self.0.sleepers.borrow().keys().next().map(|key| key.0);
            let Some(next) = next.filter(|next| *next <= until) else {
                self.0.now.set(until);
                return;
            };
            self.0.now.set(next.max(self.now()));
            while let Some(due) = self.due() {
                due.wake();
            }
        }
    }

    fn due(&self) -> Option<Waker> {
        let mut sleepers = self.0.sleepers.borrow_mut();
        let first = sleepers.first_entry()?;
        (first.key().0 <= self.0.now.get()).then(|| first.remove())
    }
}
