//! Messages that the autopilot is asked for (SET_MESSAGE_INTERVAL). It is asked again when they come too seldom: another ground station may
//! have changed their rate. It is asked no more for what it has said it does not send, or what never comes.
//!
//! One request is under way at a time, so that an answer (COMMAND_ACK), which does not say for which message it is, belongs to that request.

use super::vehicle::Kind;
use crate::flight::mavlink::frame::id;
use crate::time::{Duration, Instant};

/// Messages are counted for so long before the autopilot is asked again.
const WINDOW: Duration = Duration::from_millis(4_000);

/// An answer to a request comes within this time, or not at all.
const ANSWER: Duration = Duration::from_millis(400);

/// Requests in vain for a message that never came, before no more are sent; for one without which nothing is flown, before they are sent
/// every 16 windows.
const IN_VAIN: u8 = 4;
const SELDOM: u8 = 16;

/// Requests without any answer after which the autopilot does not hear the link.
const UNANSWERED: u8 = 2;

/// `MAV_RESULT`: the answers after which another request is of no use.
const DENIED: core::ops::RangeInclusive<u8> = 2..=4;

/// A message, and how often it is to come.
struct Asked {
    id: u32,
    interval: Duration,
    /// False for a message that nothing depends on: of a fence, and of a target, which only an ArduCopter sends, and only while it flies to
    /// one.
    is_vital: bool,
}

const ASKED: [Asked; 4] = [
    Asked {
        id: id::GLOBAL_POSITION_INT,
        interval: Duration::from_millis(200),
        is_vital: true,
    },
    Asked {
        id: id::EXTENDED_SYS_STATE,
        interval: Duration::from_millis(500),
        is_vital: true,
    },
    Asked {
        id: id::POSITION_TARGET_GLOBAL_INT,
        interval: Duration::from_millis(500),
        is_vital: false,
    },
    Asked {
        id: id::FENCE_STATUS,
        interval: Duration::from_millis(1_000),
        is_vital: false,
    },
];

/// One message's rate.
#[derive(Clone, Copy, Debug)]
struct Stream {
    asks: bool,
    came: u32,
    /// Windows in a row in which the message did not come though it was asked for.
    in_vain: u8,
    is_denied: bool,
}

/// The messages, and the answers to requests.
#[derive(Clone, Debug)]
pub(super) struct Streams {
    all: [Stream; ASKED.len()],
    since: Instant,
    /// Index and time of the request under way.
    under_way: Option<(usize, Instant)>,
    unanswered: u8,
    is_answered: bool,
}

impl Streams {
    pub(super) const fn new(now: Instant) -> Self {
        let stream = Stream {
            asks: true,
            came: 0,
            in_vain: 0,
            is_denied: false,
        };
        Self {
            all: [stream; ASKED.len()],
            since: now,
            under_way: None,
            unanswered: 0,
            is_answered: false,
        }
    }

    /// Counts a message.
    pub(super) fn hear(&mut self, id: u32) {
        for (stream, asked) in self.all.iter_mut().zip(ASKED) {
            if asked.id == id {
                stream.came = stream.came.saturating_add(1);
            }
        }
    }

    /// Takes the answer to a request.
    pub(super) fn answer(&mut self, result: u8) {
        self.is_answered = true;
        if let Some((which, _)) = self.under_way.take()
            && DENIED.contains(&result)
            && let Some(stream) = self.all.get_mut(which)
        {
            stream.is_denied = true;
        }
    }

    /// Returns whether the autopilot hears the link, once that is known.
    pub(super) const fn hears(&self) -> Option<bool> {
        if self.is_answered {
            Some(true)
        } else if self.unanswered >= UNANSWERED {
            Some(false)
        } else {
            None
        }
    }

    /// Asks again for what came less than half as often as asked.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        let passed = now.since(self.since);
        if passed < WINDOW {
            return;
        }
        for (stream, asked) in self.all.iter_mut().zip(ASKED) {
            // Twice as many and one more would have been due. A division would need a proof that no interval is 0.
            let more = 2 * u64::from(stream.came) + 1;
            let is_seldom = more * asked.interval.as_micros() <= passed.as_micros();
            stream.in_vain = if stream.came > 0 {
                0
            } else {
                stream.in_vain.saturating_add(1)
            };
            stream.asks = is_seldom
                && !stream.is_denied
                && (stream.in_vain < IN_VAIN
                    || asked.is_vital && stream.in_vain.is_multiple_of(SELDOM));
            stream.came = 0;
        }
        self.since = now;
    }

    /// Asks anew for what the autopilot flies to: it comes only in the companion's mode.
    pub(super) fn renew(&mut self) {
        for (stream, asked) in self.all.iter_mut().zip(ASKED) {
            let is_target = asked.id == id::POSITION_TARGET_GLOBAL_INT;
            if is_target && !stream.is_denied && stream.in_vain > 0 {
                stream.in_vain = 0;
                stream.asks = true;
            }
        }
    }

    pub(super) fn next_timeout(&self, now: Instant) -> Instant {
        let window = self.since + WINDOW;
        let next = self.under_way.map(|(_, at)| at + ANSWER);
        next.filter(|at| *at > now)
            .map_or(window, |at| at.min(window))
    }

    /// Returns the next message to ask for, and µs from one to the next.
    pub(super) fn take(&mut self, now: Instant, kind: Kind) -> Option<(u32, u32)> {
        if let Some((_, at)) = self.under_way {
            if now.since(at) < ANSWER {
                return None;
            }
            self.under_way = None;
            self.unanswered = self.unanswered.saturating_add(1);
        }
        let streams = self.all.iter_mut().zip(ASKED).enumerate();
        for (which, (stream, asked)) in streams {
            let asks = core::mem::take(&mut stream.asks);
            if asks && (asked.is_vital || kind == Kind::ArduCopter) {
                self.under_way = Some((which, now));
                let interval_us = u32::try_from(asked.interval.as_micros());
                return Some((asked.id, interval_us.unwrap_or(u32::MAX)));
            }
        }
        None
    }
}
