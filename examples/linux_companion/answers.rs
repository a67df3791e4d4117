//! An autopilot that does not answer after a start, said once: no bytes, no MAVLink, or no autopilot.

use uav_relay::{Duration, Instant};

/// How long an autopilot may take to answer. It says something every second.
const PATIENCE: Duration = Duration::from_millis(3_000);

/// What has come from the port since the start.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Answer {
    /// No byte.
    Nothing,
    /// Bytes, and no whole frame of MAVLink 2.
    Noise,
    /// Frames, and none from a known autopilot.
    Others,
}

/// Watches a port until its autopilot is found.
#[derive(Debug)]
pub(crate) struct Answers {
    /// What has come so far, and since when nothing better has; `None` once the autopilot is found.
    newest: Option<(Answer, Instant)>,
    told: Option<Answer>,
}

impl Answers {
    /// Begins to watch.
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            newest: Some((Answer::Nothing, now)),
            told: None,
        }
    }

    /// Takes what has come so far, `None` for an autopilot; returns what to tell, once for each kind.
    pub(crate) fn look(&mut self, now: Instant, heard: Option<Answer>) -> Option<Answer> {
        let (answer, since) = self.newest?;
        let Some(heard) = heard else {
            self.newest = None;
            return None;
        };
        if heard != answer {
            self.newest = Some((heard, now));
            return None;
        }
        if self.told >= Some(answer) || now.since(since) < PATIENCE {
            return None;
        }
        self.told = Some(answer);
        self.told
    }

    /// Returns what is missing, once it has been told.
    pub(crate) fn missing(&self) -> Option<Answer> {
        self.newest.and(self.told)
    }

    /// Returns when to look at the latest.
    pub(crate) fn wake(&self) -> Option<Instant> {
        let (answer, since) = self.newest?;
        (self.told < Some(answer)).then(|| since + PATIENCE)
    }
}
