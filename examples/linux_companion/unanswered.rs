//! Reports an autopilot that does not answer after a start, once for each kind of fault. No bytes, no MAVLink, no autopilot.

use uav_relay::{Duration, Instant};

/// Time without a HEARTBEAT after which a missing autopilot is reported. An autopilot sends one every second.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(3_000);

/// Kind of the data received from the autopilot's port since the start. The kinds are ordered from no data to MAVLink
/// frames.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Received {
    /// No byte has been received from the autopilot's port.
    Nothing,
    /// Bytes were received, but no intact MAVLink 2 frame.
    Noise,
    /// MAVLink 2 frames were received, but no frame from a known autopilot.
    Others,
}

#[derive(Debug)]
pub(crate) struct AnswerMonitor {
    /// Kind of data received so far from the autopilot's port, and the time since then. If several kinds were received,
    /// it is the most advanced kind. `None` once the autopilot is found.
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

    /// Handles the kind of data received so far, `received`; `None` means that the autopilot is found. Returns the kind
    /// of fault if it has to be reported. Each kind is reported once.
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

    /// Returns the kind of fault that was reported. `None` if no fault was reported, or if the autopilot is found.
    pub(crate) fn missing(&self) -> Option<Received> {
        self.newest.and(self.reported)
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let (answer, since) = self.newest?;
        (self.reported < Some(answer)).then(|| since + ANSWER_TIMEOUT)
    }
}
