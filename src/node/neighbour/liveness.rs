//! When a neighbour counts as lost.
//!
//! A sign of life answers something that this relay said: a heartbeat with the number of its question, what comes back of a pulse or of a
//! pass, or the next one. It counts from when that was said, so what was recorded and is played later is none. After `Settings::probe_after` without one, or the time that a
//! message takes through the whole chain and back where that is longer, the neighbour is asked again and again. It is lost once all of this holds:
//!
//! | | lost not before | because |
//! | --- | --- | --- |
//! | 1 | `Settings::dead_after`, or the span of the lease where that is longer, since it was known to be there | - |
//! | 2 | sixteen questions without an answer, or three times as many as there were before an answer lately | a run of lost frames is no death |
//!
//! and at the latest after eight times `dead_after`. From there on it is asked every `probe_after`.
//!
//! Relays of one view that choose their places jointly solve the same chain at the same time, and have nothing to say until they
//! are done. So while a relay solves, the silence of a neighbour that it is in one view with is excused: both times count from the end
//! of its own solving.

use crate::node::timing::longest_lease;
use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Questions that a neighbour has to leave open at least until it is lost.
const QUESTIONS: u16 = 16;

/// How many times as many as lately.
const MARGIN: u16 = 3;

/// How long after one question the next one is asked, while an answer is urgent: sixteen times or more within `dead_after`, as often as all
/// of a chain of `all` relays can do on one channel.
pub(crate) fn tick(settings: &Settings, all: u16) -> Duration {
    paced(settings, all, u64::from(QUESTIONS))
}

/// The same where many ask for long, as they share a channel and nothing has been agreed on yet: three times or more.
pub(crate) fn patient_tick(settings: &Settings, all: u16) -> Duration {
    paced(settings, all, 3)
}

/// As long as a pass through the chain and back, but `least` times or more from `probe_after` to `dead_after`.
fn paced(settings: &Settings, all: u16, least: u64) -> Duration {
    let span = settings
        .dead_after
        .as_micros()
        .saturating_sub(settings.probe_after.as_micros());
    let round = settings.hop_time.times(2 * u32::from(all));
    let most = (span / least).max(1);
    Duration::from_micros(
        round
            .as_micros()
            .clamp(span / 64 + 1, most.max(span / 64 + 1)),
    )
}

/// How long a sign of life is waited for until one is asked for: `Settings::probe_after`, or until what is sent onward can have gone through a
/// chain of `all` relays and come back.
pub(crate) fn patience(settings: &Settings, all: u16) -> Duration {
    let round = settings.hop_time.times(2 * u32::from(all) + 2);
    round.min(longest_lease(settings)).max(settings.probe_after)
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
    /// Questions since it was known to be there, and the most of them before an answer lately.
    unanswered: u16,
    longest: u16,
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
    /// Before anything was taken: zeros.
    pub(super) const NONE: Self = Self {
        longest: 0,
        ..Self::new(Instant::ZERO)
    };

    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            heard: now,
            lost: false,
            met: false,
            question: 0,
            asked: [now; OPEN],
            unanswered: 0,
            longest: QUESTIONS,
        }
    }

    /// Begins anew with another node. The longest run of open questions is kept, with the one that has just ended: if that node was not lost
    /// after all, so many questions were too few. If the link `was_down`, the run that has ended measures an outage of the link and not the
    /// channel, and is dropped. If the link `flaps` slowly, the earlier runs are dropped, too.
    pub(crate) fn renew(&mut self, now: Instant, was_down: bool, flaps: bool) {
        let longest = if flaps {
            QUESTIONS
        } else if was_down {
            self.longest
        } else {
            self.longest.max(self.unanswered)
        };
        *self = Self {
            met: true,
            longest,
            ..Self::new(now)
        };
    }

    /// When it is known to have been there, or when this relay was switched on.
    pub(crate) const fn heard(&self) -> Instant {
        self.heard
    }

    /// Whether it has been heard and is not lost.
    pub(crate) const fn is_there(&self) -> bool {
        self.met && !self.lost
    }

    /// Whether it is lost, and nothing has come since.
    pub(crate) const fn is_silent(&self) -> bool {
        self.lost && !self.met
    }

    /// How long a run of lost frames may be, by what the channel has shown.
    pub(crate) fn run(&self, tick: Duration) -> Duration {
        tick.times(u32::from(self.longest.saturating_mul(MARGIN)))
    }

    /// Whether few frames were lost on the channel lately.
    pub(crate) const fn is_clear(&self) -> bool {
        self.longest <= QUESTIONS
    }

    /// A frame has come.
    pub(crate) const fn met(&mut self) {
        self.met = true;
    }

    /// It was there `at` that time or later; whether it had been lost until now.
    pub(crate) fn confirmed(&mut self, at: Instant) -> bool {
        self.heard = self.heard.max(at);
        self.met = true;
        let lately = self.longest.saturating_sub(self.longest.div_ceil(8));
        self.longest = self.unanswered.max(lately);
        self.unanswered = 0;
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
        self.unanswered = self.unanswered.saturating_add(1);
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

    /// Nothing has come for a while. It does not count as lost before `dead`.
    pub(crate) fn silent(
        &mut self,
        now: Instant,
        dead: Duration,
        tick: Duration,
        settings: &Settings,
    ) -> Silence {
        let silent = now.since(self.heard);
        let run = if self.met { self.longest } else { 0 };
        let enough = self.unanswered >= run.saturating_mul(MARGIN).max(QUESTIONS);
        let gone = silent >= dead && (enough || silent >= longest_lease(settings));
        let lost = gone && !self.lost;
        self.lost |= gone;
        self.met &= !lost;
        let look_again = if self.lost {
            now + settings.probe_after
        } else {
            now + tick
        };
        Silence { lost, look_again }
    }
}
