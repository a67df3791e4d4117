//! Signs of life of a neighbour.

use uav_relay::wire::message::Message;
use uav_relay::{Duration, Instant};

/// Unanswered questions required before a loss, and how many of them may still be answered.
pub(crate) const QUESTIONS: usize = 16;
const OPEN: u32 = 4;

/// Multiples of the questions open before an answer, and of `dead_after`, that always suffice.
const MARGIN: usize = 3;
pub(crate) const LONGEST: u32 = 8;

/// Evidence that a neighbour is alive.
#[derive(Debug)]
pub(crate) struct Signs {
    /// Number and time of every question.
    pub(crate) asked: Vec<(u16, Instant)>,
    /// Last time when the neighbour was certainly alive, and when it may have been.
    pub(crate) surely: Instant,
    pub(crate) perhaps: Instant,
    /// Reception time of the last possible sign of life.
    pub(crate) last: Instant,
    /// Questions since the last certain sign and since the last possible one. The third number is the most before a certain one.
    pub(crate) open: usize,
    pub(crate) perhaps_open: usize,
    pub(crate) most_open: usize,
    /// True while the relay reports the neighbour as lost.
    pub(crate) missed: bool,
}

impl Signs {
    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            asked: Vec::new(),
            surely: now,
            perhaps: now,
            last: now,
            open: 0,
            perhaps_open: 0,
            most_open: QUESTIONS,
            missed: false,
        }
    }

    pub(crate) fn ask(&mut self, message: &Message, now: Instant) {
        if let Message::Heartbeat { request: ask, .. } = message {
            self.asked.push((*ask, now));
            self.open += 1;
            self.perhaps_open += 1;
            self.most_open = self.most_open.max(self.open);
        }
    }

    /// Records signs of life: an answer counts from its question, a completion from the forwarding.
    pub(crate) fn heard(&mut self, message: &Message, tick: Duration, now: Instant) {
        match message {
            Message::Heartbeat { reply: answer, .. } => {
                let known = self.asked.iter().rev().find(|(number, _)| number == answer);
                let Some((_, asked)) = known else {
                    return;
                };
                self.last = now;
                self.perhaps_open = 0;
                self.perhaps = self.perhaps.max(*asked);
                // So few questions followed this one that it must still be open.
                if now.since(*asked) < tick.times(OPEN) {
                    self.surely = self.surely.max(*asked);
                    self.open = 0;
                }
            }
            Message::Hello(_)
            | Message::Busy { .. }
            | Message::Fence { .. }
            | Message::Proposal(_)
            | Message::Decision(_)
            | Message::Offer { .. }
            | Message::Claim(_) => {}
            // Lease renewal, pass, or result of a pass.
            _ => {
                (self.last, self.perhaps) = (now, now);
                self.perhaps_open = 0;
            }
        }
    }

    /// Returns true if the neighbour was lost after `most` of silence and enough questions, or `longest`.
    pub(crate) fn is_to_be_missed(&self, most: Duration, longest: Duration) -> bool {
        let Some((_, asked)) = self.asked.last() else {
            return false;
        };
        let silent = asked.since(self.perhaps);
        let enough = self.perhaps_open > MARGIN * self.most_open;
        silent >= most && (enough || silent >= longest)
    }
}
