//! When a neighbour counts as lost.
//!
//! A sign of life answers something that this relay said: a heartbeat with the number of its question, or what comes back of a pulse. It counts
//! from when that was said, so what was recorded and is played later is none. After `Settings::probe_after` without one the neighbour
//! is asked, sixteen times over until it counts as lost, and every `probe_after` from there on. It is lost after
//! `Settings::dead_after`, or after the span of the lease where that is longer.
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

/// Questions that may still be answered.
const OPEN: usize = 4;

/// What is known of a neighbour's being alive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Liveness {
    /// When it is known to have been there, or when this relay was switched on.
    heard: Instant,
    lost: bool,
    /// Whether it has been heard at all.
    met: bool,
    /// The last question, 0 before any, and when it and those before it were asked.
    question: u16,
    asked: [Instant; OPEN],
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
            question: 0,
            asked: [now; OPEN],
        }
    }

    /// Whether it has been heard and is not lost.
    pub(crate) const fn is_there(&self) -> bool {
        self.met && !self.lost
    }

    /// A frame has come.
    pub(crate) const fn met(&mut self) {
        self.met = true;
    }

    /// It was there `at` that time or later; whether it had been lost until now.
    pub(crate) fn confirmed(&mut self, at: Instant) -> bool {
        self.heard = self.heard.max(at);
        self.met = true;
        core::mem::take(&mut self.lost)
    }

    /// The number of a new question.
    pub(crate) const fn ask(&mut self, now: Instant) -> u16 {
        self.question = match self.question.wrapping_add(1) {
            0 => 1,
            number => number,
        };
        let [first, second, third, _] = self.asked;
        self.asked = [now, first, second, third];
        self.question
    }

    /// When a question of that number was asked, if it is one of the last few.
    pub(crate) fn answered(&self, number: u16) -> Option<Instant> {
        if number == 0 || self.question == 0 {
            return None;
        }
        let before = self.question.wrapping_sub(number);
        self.asked.get(usize::from(before)).copied()
    }

    /// Its silence so far says nothing; whether it is not lost already.
    pub(crate) const fn excuse(&mut self, now: Instant) -> bool {
        if !self.lost {
            self.heard = now;
        }
        !self.lost
    }

    /// Nothing has come for a while.
    pub(crate) fn silent(&mut self, now: Instant, dead: Duration, settings: &Settings) -> Silence {
        let gone = now.since(self.heard) >= dead;
        let lost = gone && !self.lost;
        self.lost |= gone;
        let look_again = if self.lost {
            now + settings.probe_after
        } else {
            (now + tick(settings)).min(self.heard + dead)
        };
        Silence { lost, look_again }
    }
}
