//! When a relay asks for a new view: at once at first, then less and less often.

use crate::node::timing::PAUSE;
use crate::settings::Settings;
use crate::time::{Duration, Instant, Jitter};

/// Whether this relay asks for a new view, and when it asks next.
#[derive(Clone, Debug)]
pub(crate) struct Asking {
    asks: bool,
    /// How often it has since.
    tries: u8,
    at: Option<Instant>,
    /// After a refusal: how often in a row, and when to ask again as soon as anything is new.
    refusals: u8,
    soon: Option<Instant>,
    jitter: Jitter,
}

/// Doublings of the wait after one refusal after the other.
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

    /// Whether this relay asks for a new view.
    pub(crate) const fn asks(&self) -> bool {
        self.asks
    }

    /// Asks for a new view, from now on until it comes.
    pub(crate) fn ask(&mut self, now: Instant) {
        if !self.asks {
            self.ask_anew(now);
        } else if let Some(soon) = self.soon.take() {
            self.refusals = 0;
            let soon = soon.max(now + PAUSE);
            self.at = Some(self.at.map_or(soon, |at| at.min(soon)));
        }
    }

    /// The same at once, however often it has asked in vain: something new has come to be known.
    #[inline(never)] // called from many places
    pub(crate) fn ask_anew(&mut self, now: Instant) {
        self.asks = true;
        self.tries = 0;
        self.refusals = 0;
        self.soon = None;
        self.at = Some(now + PAUSE);
    }

    /// Something has come to be certain: if it asks, it asks anew at once.
    pub(crate) fn hasten(&mut self, now: Instant) {
        if self.asks {
            self.ask_anew(now);
        }
    }

    /// Asks after about `wait`, the more so the more often it was refused; after `wait` once anything is new.
    pub(super) fn ask_after_refusal(&mut self, now: Instant, wait: Duration) {
        self.asks = true;
        let wait = self.jitter.spread(wait);
        self.soon = Some(now + wait);
        self.at = Some(now + wait.times(1 << self.refusals.min(DOUBLINGS)));
        self.refusals = self.refusals.saturating_add(1);
    }

    /// What was asked for has come.
    pub(super) const fn stop(&mut self) {
        self.asks = false;
        self.at = None;
        self.soon = None;
    }

    /// The first pass should have come by `at`; if it has not, a view is asked for.
    pub(crate) const fn await_first(&mut self, at: Instant) {
        self.at = Some(at);
    }

    /// Whether it is time to ask.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.at.is_some_and(|at| at <= now)
    }

    /// Whether it asks now that this is due; from now on it does where nothing has come since it was switched on (`fresh`).
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

    /// How long to wait before asking again: twice as long each time, up to `probe_after`.
    fn patience(&mut self, settings: &Settings) -> Duration {
        let wait = settings.hop_time.times(8 << self.tries.min(12));
        self.tries = self.tries.saturating_add(1);
        wait.min(settings.probe_after)
    }

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }

    /// One that asks, and is due `at` that time.
    #[cfg(test)]
    pub(super) const fn due(at: Instant) -> Self {
        Self {
            asks: true,
            at: Some(at),
            ..Self::new(1)
        }
    }
}
