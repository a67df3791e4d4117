//! Signs of life of a neighbour.

use uav_relay::wire::message::Message;
use uav_relay::{Duration, Instant};

/// Number of unanswered heartbeat requests before a neighbour may be reported as lost.
pub(crate) const QUESTIONS: usize = 16;
/// Number of heartbeat intervals after which a reply is too late to prove that the neighbour is alive.
const OPEN: u32 = 4;

/// Factor on the largest number of heartbeat requests that were ever unanswered at the same time.
///
/// A neighbour with more unanswered requests than this product must be reported as lost.
const MARGIN: usize = 3;
/// Factor on `dead_after`: the silence after which a neighbour must be reported as lost in any case.
pub(crate) const LONGEST: u32 = 8;

/// Model of a relay's knowledge about a neighbour's signs of life.
#[derive(Debug)]
pub(crate) struct Signs {
    /// Sequence number and time of every heartbeat request that the relay has sent to the neighbour.
    pub(crate) asked: Vec<(u16, Instant)>,
    /// Last time at which the neighbour was certainly alive.
    pub(crate) certainly_alive: Instant,
    /// Last time at which the neighbour was possibly alive. Replies and messages count even if they are late.
    pub(crate) possibly_alive: Instant,
    /// Time at which the last message was received that may prove the neighbour alive.
    pub(crate) last: Instant,
    /// Number of heartbeat requests since the neighbour was last certainly alive.
    pub(crate) open: usize,
    /// Number of heartbeat requests since the neighbour's last possible sign of life (`possibly_alive`).
    pub(crate) open_since_possible: usize,
    /// Largest number of heartbeat requests that were ever unanswered at the same time.
    ///
    /// The number is at least [`QUESTIONS`].
    pub(crate) most_open: usize,
    /// True while the relay reports the neighbour as lost.
    pub(crate) missed: bool,
}

impl Signs {
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            asked: Vec::new(),
            certainly_alive: now,
            possibly_alive: now,
            last: now,
            open: 0,
            open_since_possible: 0,
            most_open: QUESTIONS,
            missed: false,
        }
    }

    pub(crate) fn on_request(&mut self, message: &Message, now: Instant) {
        if let Message::Heartbeat { request: ask, .. } = message {
            self.asked.push((*ask, now));
            self.open += 1;
            self.open_since_possible += 1;
            self.most_open = self.most_open.max(self.open);
        }
    }

    /// Records signs of life of the neighbour in a message from it.
    ///
    /// A heartbeat reply proves life at the time of its request. A lease renewal, or a pass (a round of messages
    /// along the chain), is a possible sign of life on reception.
    pub(crate) fn on_received(&mut self, message: &Message, tick: Duration, now: Instant) {
        match message {
            Message::Heartbeat { reply: answer, .. } => {
                let known = self.asked.iter().rev().find(|(number, _)| number == answer);
                let Some((_, asked)) = known else {
                    return;
                };
                self.last = now;
                self.open_since_possible = 0;
                self.possibly_alive = self.possibly_alive.max(*asked);
                // The request is so recent that it must still count as unanswered.
                if now.since(*asked) < tick.times(OPEN) {
                    self.certainly_alive = self.certainly_alive.max(*asked);
                    self.open = 0;
                }
            }
            Message::Hello(_)
            | Message::Busy { .. }
            | Message::Fence { .. }
            | Message::Proposal(_)
            | Message::Decision(_)
            | Message::Offer { .. }
            | Message::Watch { .. }
            | Message::Report(_)
            | Message::Claim(_) => {}
            // Lease renewal, pass, or result of a pass.
            _ => {
                (self.last, self.possibly_alive) = (now, now);
                self.open_since_possible = 0;
            }
        }
    }

    /// Returns true if the relay must report the neighbour as lost.
    ///
    /// The silence must be at least `most` with enough unanswered heartbeat requests, or at least `longest`.
    pub(crate) fn is_to_be_missed(&self, most: Duration, longest: Duration) -> bool {
        let Some((_, asked)) = self.asked.last() else {
            return false;
        };
        let silent = asked.since(self.possibly_alive);
        let enough = self.open_since_possible > MARGIN * self.most_open;
        silent >= most && (enough || silent >= longest)
    }
}
