//! Signs of life of a neighbour.

use uav_relay::wire::message::Message;
use uav_relay::{Duration, Instant};

/// Questions that a neighbour leaves open at least until it is missed, and how many of them may still be answered.
pub(crate) const QUESTIONS: usize = 16;
const OPEN: u32 = 4;

/// How many times as many questions as were open before an answer, and how many times `dead_after`, are enough in any case.
const MARGIN: usize = 3;
pub(crate) const LONGEST: u32 = 8;

/// What is known of a neighbour's being there.
#[derive(Debug)]
pub(crate) struct Signs {
    /// Its number, and when it was asked, of every question.
    pub(crate) asked: Vec<(u16, Instant)>,
    /// When it was there for certain, and when it may have been.
    pub(crate) surely: Instant,
    pub(crate) perhaps: Instant,
    /// When something came that may have been a sign of it.
    pub(crate) last: Instant,
    /// Questions since a certain sign, since one that may have been, and the most since a certain one.
    pub(crate) open: usize,
    pub(crate) perhaps_open: usize,
    pub(crate) most_open: usize,
    /// Whether the relay has said that it is lost.
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
        if let Message::Heartbeat { ask, .. } = message {
            self.asked.push((*ask, now));
            self.open += 1;
            self.perhaps_open += 1;
            self.most_open = self.most_open.max(self.open);
        }
    }

    /// An answer is a sign of when its question was asked; what comes back of a pulse or a pass, of when that was handed on; and the next
    /// one, of when what came back of the last was.
    pub(crate) fn heard(&mut self, message: &Message, tick: Duration, now: Instant) {
        match message {
            Message::Heartbeat { answer, .. } => {
                let known = self.asked.iter().rev().find(|(number, _)| number == answer);
                let Some((_, asked)) = known else {
                    return;
                };
                self.last = now;
                self.perhaps_open = 0;
                self.perhaps = self.perhaps.max(*asked);
                // So few questions can have followed it that it is open yet.
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
            // A pulse, a pass, or what came of one.
            _ => {
                (self.last, self.perhaps) = (now, now);
                self.perhaps_open = 0;
            }
        }
    }

    /// Whether it was to be missed when it was asked last, as nothing had come for `most`: that often it had been asked before, or that
    /// long it may be silent at most.
    pub(crate) fn is_to_be_missed(&self, most: Duration, longest: Duration) -> bool {
        let Some((_, asked)) = self.asked.last() else {
            return false;
        };
        let silent = asked.since(self.perhaps);
        let enough = self.perhaps_open > MARGIN * self.most_open;
        silent >= most && (enough || silent >= longest)
    }
}
