//! When a neighbour counts as lost.
//!
//! Any intact frame from it is a sign of life. After `Settings::probe_after` without one it is asked for a heartbeat, sixteen times
//! over until `Settings::dead_after` has passed; then it is lost, and asked every `probe_after` from there on.
//!
//! Relays of one view that choose their places jointly solve the same chain at the same time, and have nothing to say until they
//! are done. So while a relay solves, the silence of a neighbour that it is in one view with is excused: both times count from the end
//! of its own solving.

use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Questions between `probe_after` and `dead_after`.
const QUESTIONS: u64 = 16;

/// How long after one question the next one is asked, while an answer is urgent.
pub(crate) fn tick(settings: &Settings) -> Duration {
    let span = settings
        .dead_after
        .as_micros()
        .saturating_sub(settings.probe_after.as_micros());
    Duration::from_micros((span / QUESTIONS).max(1))
}

/// What is known of a neighbour's being alive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Liveness {
    /// When it was heard last, or when this relay was switched on.
    heard: Instant,
    lost: bool,
    /// Whether it has been heard at all.
    met: bool,
}

/// What follows from a silence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Silence {
    /// Whether the neighbour counts as lost since this moment.
    pub(crate) lost: bool,
    /// When to look again, later than now.
    pub(crate) look_again: Instant,
}

impl Liveness {
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            heard: now,
            lost: false,
            met: false,
        }
    }

    /// Whether it has been heard and is not lost.
    pub(crate) const fn is_there(&self) -> bool {
        self.met && !self.lost
    }

    /// A frame has come; whether it had been lost until then.
    pub(crate) fn heard(&mut self, now: Instant) -> bool {
        self.heard = now;
        self.met = true;
        core::mem::take(&mut self.lost)
    }

    /// Its silence so far says nothing; whether it is not lost already.
    pub(crate) const fn excuse(&mut self, now: Instant) -> bool {
        if !self.lost {
            self.heard = now;
        }
        !self.lost
    }

    /// Nothing has come for a while.
    pub(crate) fn silent(&mut self, now: Instant, settings: &Settings) -> Silence {
        let gone = now.since(self.heard) >= settings.dead_after;
        let lost = gone && !self.lost;
        self.lost |= gone;
        let look_again = if self.lost {
            now + settings.probe_after
        } else {
            (now + tick(settings)).min(self.heard + settings.dead_after)
        };
        Silence { lost, look_again }
    }
}
