//! Timing of view requests: at once at first, then less and less often.

use crate::node::timing::PAUSE;
use crate::settings::Settings;
use crate::time::{Duration, Instant, Jitter};

/// State of this relay's view request, and the time of the next one.
#[derive(Clone, Debug)]
pub(crate) struct Asking {
    asks: bool,
    /// Number of requests so far.
    tries: u8,
    at: Option<Instant>,
    /// Consecutive refusals, and the earliest time of the next request if anything changes.
    refusals: u8,
    soon: Option<Instant>,
    jitter: Jitter,
}

/// Maximum doublings of the wait after consecutive refusals.
const DOUBLINGS: u8 = 3;

impl Asking {
    pub(super) const fn new(seed: u32) -> Self {
        Self {
            asks: false,
            tries: 0,
            at: None,
            refusals: 0,
            soon: None,
            jitter: Jitter::new(seed),
        }
    }

    pub(crate) const fn asks(&self) -> bool {
        self.asks
    }

    /// Requests a view until it comes. After a refusal, a change shortens the wait.
    pub(crate) fn ask(&mut self, now: Instant) {
        if !self.asks {
            self.ask_anew(now);
        } else if let Some(soon) = self.soon.take() {
            self.refusals = 0;
            let soon = soon.max(now + PAUSE);
            self.at = Some(self.at.map_or(soon, |at| at.min(soon)));
        }
    }

    /// Requests a view at once and resets all waits, because new information is available.
    #[inline(never)] // called from many places
    pub(crate) fn ask_anew(&mut self, now: Instant) {
        self.asks = true;
        self.tries = 0;
        self.refusals = 0;
        self.soon = None;
        self.at = Some(now + PAUSE);
    }

    /// Repeats a pending request at once, because the neighbours are now certain.
    pub(crate) fn hasten(&mut self, now: Instant) {
        if self.asks {
            self.ask_anew(now);
        }
    }

    /// Requests a view after about `wait`, which consecutive refusals double up to three times. A change ends the doubling.
    pub(super) fn ask_after_refusal(&mut self, now: Instant, wait: Duration) {
        self.asks = true;
        let wait = self.jitter.spread(wait);
        self.soon = Some(now + wait);
        self.at = Some(now + wait.times(1 << self.refusals.min(DOUBLINGS)));
        self.refusals = self.refusals.saturating_add(1);
    }

    /// Ends the request: a view has come.
    pub(super) const fn stop(&mut self) {
        self.asks = false;
        self.at = None;
        self.soon = None;
    }

    /// Expects the first pass by `at`; without it, a view is requested.
    pub(crate) const fn await_first(&mut self, at: Instant) {
        self.at = Some(at);
    }

    /// Returns true if the request timer has expired.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.at.is_some_and(|at| at <= now)
    }

    /// Handles the expired timer; returns true if a request is due. `fresh`: nothing was received since start-up, so one is due.
    pub(super) fn take_due(&mut self, now: Instant, fresh: bool, settings: &Settings) -> bool {
        self.at = None;
        if !self.asks {
            if !fresh {
                return false;
            }
            self.asks = true;
            self.tries = 0;
        }
        self.soon = None;
        self.at = Some(now + self.patience(settings));
        true
    }

    /// Returns the wait until the next request, doubled each time, up to `probe_after`.
    fn patience(&mut self, settings: &Settings) -> Duration {
        let wait = settings.hop_time.times(8 << self.tries.min(12));
        self.tries = self.tries.saturating_add(1);
        wait.min(settings.probe_after)
    }

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }

    /// Creates a pending request that is due at `at`.
    #[cfg(test)]
    pub(super) const fn due(at: Instant) -> Self {
        Self {
            asks: true,
            at: Some(at),
            ..Self::new(1)
        }
    }
}
