//! The messages that the autopilot is asked for, and asked for again when they come too seldom: another ground station may have changed
//! their rate, or the autopilot may have been switched off and on.

use crate::flight::mavlink::table::id;
use crate::time::{Duration, Instant};

/// So long its messages are counted before it is asked again.
const WINDOW: Duration = Duration::from_millis(4_000);

/// The messages, and how often each.
const ASKED: [(u32, Duration); 3] = [
    (id::GLOBAL_POSITION_INT, Duration::from_millis(200)),
    (id::EXTENDED_SYS_STATE, Duration::from_millis(500)),
    (id::POSITION_TARGET_GLOBAL_INT, Duration::from_millis(500)),
];

/// One message's rate.
#[derive(Clone, Copy, Debug)]
struct Stream {
    asks: bool,
    came: u32,
}

/// What is asked for, and what came of it.
#[derive(Clone, Debug)]
pub(super) struct Streams {
    streams: [Stream; ASKED.len()],
    since: Instant,
}

impl Streams {
    pub(super) const fn new(now: Instant) -> Self {
        let stream = Stream {
            asks: true,
            came: 0,
        };
        Self {
            streams: [stream; ASKED.len()],
            since: now,
        }
    }

    /// A message has come.
    pub(super) fn hear(&mut self, id: u32) {
        for (stream, (asked, _)) in self.streams.iter_mut().zip(ASKED) {
            if asked == id {
                stream.came = stream.came.saturating_add(1);
            }
        }
    }

    /// Asks again for what came less than half as often as asked. What an autopilot does not have is asked for once in a window.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        let passed = now.since(self.since);
        if passed < WINDOW {
            return;
        }
        for (stream, (_, interval)) in self.streams.iter_mut().zip(ASKED) {
            // Twice as many and one more would have been due. A division would need a proof that no interval is 0.
            let more = 2 * u64::from(stream.came) + 1;
            stream.asks = more * interval.as_micros() <= passed.as_micros();
            stream.came = 0;
        }
        self.since = now;
    }

    pub(super) fn next_timeout(&self) -> Instant {
        self.since + WINDOW
    }

    /// What to ask for next: the message, and µs from one to the next.
    pub(super) fn take(&mut self) -> Option<(u32, u32)> {
        let mut all = self.streams.iter_mut().zip(ASKED);
        let (stream, (id, interval)) = all.find(|(stream, _)| stream.asks)?;
        stream.asks = false;
        Some((id, u32::try_from(interval.as_micros()).unwrap_or(u32::MAX)))
    }
}
