//! What is owed to the nodes on one side: heartbeats to the one taken, hellos to candidates.

use super::signs::Signs;
use super::state::Neighbour;
use crate::time::Instant;

impl Neighbour {
    /// The neighbour asks for a sign of life, with a question of that number.
    pub(crate) const fn asked(&mut self, number: u16) {
        if number != 0 {
            self.signs.answer = number;
        }
    }

    /// The neighbour has answered the question of that number: when that was asked.
    pub(crate) fn answered(&self, number: u16) -> Option<Instant> {
        self.liveness.answered(number)
    }

    /// A heartbeat that is owed: to which node, the number of its question and that of the one it answers.
    pub(crate) fn take_heartbeat(&mut self, now: Instant) -> Option<(u16, u16, u16)> {
        let Signs { ask, answer } = core::mem::take(&mut self.signs);
        if !(ask || answer != 0) || self.node == 0 {
            return None;
        }
        let question = if ask { self.liveness.ask(now) } else { 0 };
        Some((self.node, question, answer))
    }

    /// Owes a hello to the candidate `distance` nodes away, which may be one that asks.
    pub(crate) const fn owe(&mut self, distance: u16, ask: bool) {
        self.hellos.owe(distance, ask);
    }

    /// The nearest candidate that is owed a hello: how many nodes away, and whether it is asked.
    pub(crate) fn take_hello(&mut self) -> Option<(u16, bool)> {
        self.hellos.take()
    }
}
