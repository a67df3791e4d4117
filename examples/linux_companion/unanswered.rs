//! Reports an autopilot that does not answer after a start, once for each kind of fault. No bytes, no MAVLink, no autopilot.

use uav_relay::{Duration, Instant};

/// Time that an autopilot has to answer. It sends a HEARTBEAT every second.
const PATIENCE: Duration = Duration::from_millis(3_000);

/// Kind of the most specific data received from the port since the start.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Answer {
    /// No byte has been received.
    Nothing,
    /// Bytes without an intact MAVLink 2 frame.
    Noise,
    /// Frames, but none from a known autopilot.
    Others,
}

#[derive(Debug)]
pub(crate) struct AnswerMonitor {
    /// Best kind of data received, and the time of its first receipt. `None` once the autopilot is found.
    newest: Option<(Answer, Instant)>,
    told: Option<Answer>,
}

impl AnswerMonitor {
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            newest: Some((Answer::Nothing, now)),
            told: None,
        }
    }

    /// Handles the best kind of data received, `None` for an autopilot. Returns a fault to report, once for each kind.
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

    /// Returns the reported fault while no autopilot is found.
    pub(crate) fn missing(&self) -> Option<Answer> {
        self.newest.and(self.told)
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let (answer, since) = self.newest?;
        (self.told < Some(answer)).then(|| since + PATIENCE)
    }
}
