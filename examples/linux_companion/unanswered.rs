//! Reports an autopilot that does not answer after a start: no bytes, no MAVLink, or no autopilot.
//!
//! Each of these faults is reported once.

use uav_relay::{Duration, Instant};

/// Time without a HEARTBEAT after which an autopilot is reported as missing. An autopilot sends one every second.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(3_000);

/// Kind of data received from the autopilot's port since the start, from no data to valid data.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Received {
    /// No bytes.
    Nothing,
    /// Bytes, but no intact MAVLink 2 frame.
    Noise,
    /// MAVLink 2 frames, but none from a known autopilot.
    Others,
}

#[derive(Debug)]
pub(crate) struct AnswerMonitor {
    /// Newest kind of received data, and the time of its first reception.
    ///
    /// `None` once the autopilot is found.
    newest: Option<(Received, Instant)>,
    reported: Option<Received>,
}

impl AnswerMonitor {
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            newest: Some((Received::Nothing, now)),
            reported: None,
        }
    }

    /// Records the kind of data received. Returns the kind if it must now be reported as a fault, once for each kind.
    ///
    /// `received` is `None` once the autopilot is found.
    pub(crate) fn check(&mut self, now: Instant, received: Option<Received>) -> Option<Received> {
        let (answer, since) = self.newest?;
        let Some(heard) = received else {
            self.newest = None;
            return None;
        };
        if heard != answer {
            self.newest = Some((heard, now));
            return None;
        }
        if self.reported >= Some(answer) || now.since(since) < ANSWER_TIMEOUT {
            return None;
        }
        self.reported = Some(answer);
        self.reported
    }

    /// Returns the reported kind of fault, if any; `None` once the autopilot is found.
    pub(crate) fn missing(&self) -> Option<Received> {
        self.newest.and(self.reported)
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let (answer, since) = self.newest?;
        (self.reported < Some(answer)).then(|| since + ANSWER_TIMEOUT)
    }
}
