//! Requests for messages of the autopilot (SET_MESSAGE_INTERVAL).
//!
//! A request is repeated if the message arrives too seldom, because some ground station may have changed the message's
//! rate. Messages that the autopilot has denied, or that never arrive, are no longer requested.
//!
//! One request is outstanding at a time. An answer (COMMAND_ACK) does not contain the message's id, so it belongs to
//! that request.

use super::state::Kind;
use crate::flight::mavlink::frame::id;
use crate::time::{Duration, Instant};

/// Time in which received messages are counted. A message received at less than half of its requested rate is then
/// requested again.
const WINDOW: Duration = Duration::from_millis(4_000);

/// Maximum time from a request for a message to its answer.
const ANSWER: Duration = Duration::from_millis(400);

/// Number of consecutive [`WINDOW`]s without a message after which this message is no longer requested.
///
/// A message without which the drone cannot be controlled is still requested, but only every [`SELDOM`] windows.
const MAX_SILENT_WINDOWS: u8 = 4;
/// Number of [`WINDOW`]s between two requests for a vital message that does not arrive. A vital message is one without
/// which the drone cannot be controlled.
const SELDOM: u8 = 16;

/// Number of unanswered requests after which the autopilot is assumed not to receive the link's frames.
const UNANSWERED: u8 = 2;

/// Values of `MAV_RESULT` that deny a request; the denied message is not requested again.
const DENIED: core::ops::RangeInclusive<u8> = 2..=4;

struct RequestedMessage {
    id: u32,
    interval: Duration,
    /// True if the drone cannot be controlled without the message. Messages with false (target, geofence, battery,
    /// home) are optional: some autopilots do not send them.
    is_vital: bool,
}

impl RequestedMessage {
    const fn new(id: u32, interval_ms: u64, is_vital: bool) -> Self {
        let interval = Duration::from_millis(interval_ms);
        Self {
            id,
            interval,
            is_vital,
        }
    }
}

/// Index of the first battery message in [`REQUESTED`].
const BATTERY: usize = 4;

const REQUESTED: [RequestedMessage; 6] = [
    RequestedMessage::new(id::GLOBAL_POSITION_INT, 200, true),
    RequestedMessage::new(id::EXTENDED_SYS_STATE, 500, true),
    RequestedMessage::new(id::POSITION_TARGET_GLOBAL_INT, 500, false),
    RequestedMessage::new(id::FENCE_STATUS, 1_000, false),
    RequestedMessage::new(id::BATTERY_STATUS, 1_000, false),
    RequestedMessage::new(id::HOME_POSITION, 2_000, false),
];

/// State of the requests for one kind of message.
#[derive(Clone, Copy, Debug)]
struct Stream {
    is_requested: bool,
    messages: u32,
    /// Number of consecutive [`WINDOW`]s in which the requested message was not received.
    silent_windows: u8,
    is_denied: bool,
}

/// Requests for all messages that the link needs, and the autopilot's answers.
#[derive(Clone, Debug)]
pub(super) struct Streams {
    all: [Stream; REQUESTED.len()],
    since: Instant,
    /// Outstanding request: index of the message, and time of the request. `None` if there is none.
    outstanding: Option<(usize, Instant)>,
    unanswered: u8,
    is_answered: bool,
}

impl Streams {
    pub(super) const fn new(now: Instant) -> Self {
        let stream = Stream {
            is_requested: true,
            messages: 0,
            silent_windows: 0,
            is_denied: false,
        };
        Self {
            all: [stream; REQUESTED.len()],
            since: now,
            outstanding: None,
            unanswered: 0,
            is_answered: false,
        }
    }

    /// Counts a received message if its MAVLink id `id` is one of the requested ones.
    pub(super) fn count_message(&mut self, id: u32) {
        for (stream, asked) in self.all.iter_mut().zip(REQUESTED) {
            if asked.id == id {
                stream.messages = stream.messages.saturating_add(1);
            }
        }
    }

    /// Processes the answer to the outstanding request. `result` is its `MAV_RESULT`.
    pub(super) fn answer(&mut self, result: u8) {
        self.is_answered = true;
        if let Some((which, _)) = self.outstanding.take()
            && DENIED.contains(&result)
            && let Some(stream) = self.all.get_mut(which)
        {
            stream.is_denied = true;
        }
    }

    /// Returns `Some(true)` if the autopilot answers requests, `Some(false)` if it does not. `None` if unknown.
    pub(super) const fn answers_requests(&self) -> Option<bool> {
        if self.is_answered {
            Some(true)
        } else if self.unanswered >= UNANSWERED {
            Some(false)
        } else {
            None
        }
    }

    /// Schedules new requests for messages that arrive at less than half of the requested rate.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        let passed = now.since(self.since);
        if passed < WINDOW {
            return;
        }
        for (stream, asked) in self.all.iter_mut().zip(REQUESTED) {
            // At the full rate, more than twice as many messages would have arrived. The product avoids a division by
            // the interval, which could be 0.
            let more = 2 * u64::from(stream.messages) + 1;
            let is_seldom = more * asked.interval.as_micros() <= passed.as_micros();
            stream.silent_windows = if stream.messages > 0 {
                0
            } else {
                stream.silent_windows.saturating_add(1)
            };
            stream.is_requested = is_seldom
                && !stream.is_denied
                && (stream.silent_windows < MAX_SILENT_WINDOWS
                    || asked.is_vital && stream.silent_windows.is_multiple_of(SELDOM));
            stream.messages = 0;
        }
        self.since = now;
    }

    /// Restarts the requests for the autopilot's report of its target, once the relay controls the drone.
    ///
    /// An ArduCopter sends that report only in GUIDED, so the link has possibly stopped requesting it.
    pub(super) fn renew(&mut self) {
        for (stream, asked) in self.all.iter_mut().zip(REQUESTED) {
            let is_target = asked.id == id::POSITION_TARGET_GLOBAL_INT;
            if is_target && !stream.is_denied && stream.silent_windows > 0 {
                stream.silent_windows = 0;
                stream.is_requested = true;
            }
        }
    }

    pub(super) fn next_timeout(&self, now: Instant) -> Instant {
        let window = self.since + WINDOW;
        let next = self.outstanding.map(|(_, at)| at + ANSWER);
        next.filter(|at| *at > now)
            .map_or(window, |at| at.min(window))
    }

    /// Returns the next message to request, and its interval in µs; `None` if no request is due.
    ///
    /// Battery messages are requested only if `counts` is true: the link then computes the remaining time of flight
    /// from them.
    pub(super) fn take(&mut self, now: Instant, kind: Kind, counts: bool) -> Option<(u32, u32)> {
        if let Some((_, at)) = self.outstanding {
            if now.since(at) < ANSWER {
                return None;
            }
            self.outstanding = None;
            self.unanswered = self.unanswered.saturating_add(1);
        }
        let streams = self.all.iter_mut().zip(REQUESTED).enumerate();
        for (which, (stream, asked)) in streams {
            let asks = core::mem::take(&mut stream.is_requested);
            let is_wanted = kind == Kind::ArduCopter && (counts || which < BATTERY);
            if asks && (asked.is_vital || is_wanted) {
                self.outstanding = Some((which, now));
                let interval_us = u32::try_from(asked.interval.as_micros());
                return Some((asked.id, interval_us.unwrap_or(u32::MAX)));
            }
        }
        None
    }
}
