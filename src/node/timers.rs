//! Every timer of a relay, in one table.

use crate::side::Side;
use crate::time::Instant;

/// What a timer is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Timer {
    /// The head has a computation to go on with.
    Work,
    /// The verdict on a sweep is overdue.
    Repeat,
    /// The neighbour toward Tx has been silent.
    Upstream,
    /// The neighbour toward Rx has been silent.
    Downstream,
    /// A new view that was called for has not come.
    Call,
    /// What the guard has said may have been lost.
    Remind,
}

impl Timer {
    /// The silence of the neighbour at `side`.
    pub(crate) const fn of(side: Side) -> Self {
        match side {
            Side::Upstream => Self::Upstream,
            Side::Downstream => Self::Downstream,
        }
    }
}

const ALL: [Timer; 6] = [
    Timer::Work,
    Timer::Repeat,
    Timer::Upstream,
    Timer::Downstream,
    Timer::Call,
    Timer::Remind,
];

/// When each timer runs out, if it runs.
#[derive(Clone, Debug)]
pub(crate) struct Timers {
    work: Option<Instant>,
    repeat: Option<Instant>,
    upstream: Option<Instant>,
    downstream: Option<Instant>,
    call: Option<Instant>,
    remind: Option<Instant>,
}

impl Timers {
    pub(crate) const fn new() -> Self {
        Self {
            work: None,
            repeat: None,
            upstream: None,
            downstream: None,
            call: None,
            remind: None,
        }
    }

    fn slot(&mut self, timer: Timer) -> &mut Option<Instant> {
        match timer {
            Timer::Work => &mut self.work,
            Timer::Repeat => &mut self.repeat,
            Timer::Upstream => &mut self.upstream,
            Timer::Downstream => &mut self.downstream,
            Timer::Call => &mut self.call,
            Timer::Remind => &mut self.remind,
        }
    }

    pub(crate) fn set(&mut self, timer: Timer, at: Instant) {
        *self.slot(timer) = Some(at);
    }

    /// Whether it runs.
    pub(crate) fn runs(&mut self, timer: Timer) -> bool {
        self.slot(timer).is_some()
    }

    pub(crate) fn stop(&mut self, timer: Timer) {
        *self.slot(timer) = None;
    }

    /// When the next timer runs out.
    pub(crate) fn next(&self) -> Option<Instant> {
        [
            self.work,
            self.repeat,
            self.upstream,
            self.downstream,
            self.call,
            self.remind,
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// A timer that has run out by `now`, stopped before it is handed out: handling it cannot make it come again at once.
    pub(crate) fn expired(&mut self, now: Instant) -> Option<Timer> {
        ALL.into_iter().find(|&timer| {
            let slot = self.slot(timer);
            let expired = slot.is_some_and(|at| at <= now);
            if expired {
                *slot = None;
            }
            expired
        })
    }
}
