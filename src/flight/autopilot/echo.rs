//! Echoes (TIMESYNC): upper bound of a message's age, by the link itself and without a common clock.
//!
//! A cable, a radio or a router may buffer bytes for seconds. A heartbeat has no time stamp, and the autopilot's clock may lose
//! time. The link therefore sends its own time twice a second, and the autopilot returns it. Bytes stay in order: a message
//! received after an answer was sent after the question, so it is not older than the question.
//!
//! A question has a tag, drawn at each start of the companion. An answer buffered since before a restart therefore does not count.
//!
//! An autopilot that has not answered within [`GIVES_UP`] of the first question does not support echoes. Then only the time stamps
//! of its positions show their ages. Until then a link that has just started counts as late. An autopilot that has answered once
//! counts as late whenever it does not answer.

use crate::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(500);

/// Maximum age of the newest answered question; beyond it the link counts as late.
const LATE: Duration = Duration::from_millis(1_500);

const GIVES_UP: Duration = Duration::from_millis(10_000);

/// Maximum age of a question whose answer counts.
const OLDEST: Duration = Duration::from_millis(60_000);

/// Low bits of a question that hold the link's tag. The higher bits hold µs, for 200 days. The autopilot only returns them.
const SHIFT: u32 = 20;
const TAG: u32 = 0xA_52A5;

/// Questions and answers of a link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Echo {
    /// Low bits of every question.
    tag: u32,
    due: Option<Instant>,
    /// Time of the first question.
    begun_at: Option<Instant>,
    /// Time of the newest answered question.
    asked_at: Option<Instant>,
}

impl Default for Echo {
    fn default() -> Self {
        Self {
            tag: TAG,
            due: None,
            begun_at: None,
            asked_at: None,
        }
    }
}

impl Echo {
    /// Draws the tag from `seed`.
    pub(super) const fn seed(&mut self, seed: u32) {
        self.tag = (seed ^ seed >> 12 ^ TAG) & ((1 << SHIFT) - 1);
    }

    /// Forgets all questions and answers.
    pub(super) fn restart(&mut self) {
        *self = Self {
            tag: self.tag,
            ..Self::default()
        };
    }

    /// Returns the question to send at `now`.
    pub(super) fn take(&mut self, now: Instant) -> Option<u64> {
        if self.due.is_some_and(|due| due > now) {
            return None;
        }
        self.due = Some(now + PERIOD);
        self.begun_at = self.begun_at.or(Some(now));
        Some(now.as_micros() << SHIFT | u64::from(self.tag))
    }

    /// Processes an answer.
    pub(super) fn hear(&mut self, now: Instant, question: u64) {
        let asked_at = Instant::from_micros(question >> SHIFT);
        let is_own = question & ((1 << SHIFT) - 1) == u64::from(self.tag) && asked_at <= now;
        if is_own && now.since(asked_at) < OLDEST {
            self.asked_at = self.asked_at.max(Some(asked_at));
        }
    }

    /// Returns the earliest time at which a message received now was sent, if that is known.
    pub(super) const fn floor(&self) -> Option<Instant> {
        self.asked_at
    }

    /// Returns true while messages may be too old to rely on.
    pub(super) fn is_late(&self, now: Instant) -> bool {
        match (self.asked_at, self.begun_at) {
            (Some(at), _) => now.since(at) >= LATE,
            (None, Some(at)) => now.since(at) < GIVES_UP,
            (None, None) => true,
        }
    }

    /// Returns the time of the next question or check.
    pub(super) fn next_timeout(&self, now: Instant) -> Option<Instant> {
        let late = self.asked_at.map(|at| at + LATE).filter(|at| *at > now);
        let all = [self.due, late, self.begun_at.map(|at| at + GIVES_UP)];
        all.into_iter().flatten().filter(|at| *at > now).min()
    }
}

#[cfg(test)]
mod tests {
    use super::Echo;
    use crate::time::{Duration, Instant};

    #[test]
    fn an_answer_to_a_question_of_another_start_is_none() {
        let at = |ms| Instant::from_millis(ms);
        let mut before = Echo::default();
        before.seed(1);
        let asked = before.take(at(5_000)).expect("the first question");
        let mut after = Echo::default();
        after.seed(2);
        after.restart();
        let own = after.take(at(5_100)).expect("the first question");
        after.hear(at(5_200), asked);
        assert_eq!(after.floor(), None);
        after.hear(at(5_200), own);
        assert_eq!(after.floor(), Some(at(5_100)));
        assert!(
            !after.is_late(at(5_200)) && after.is_late(at(5_100) + Duration::from_millis(1_500))
        );
    }
}
