//! Radio of one node: its state and its transmit queue.

use std::collections::VecDeque;

use uav_relay::Instant;

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum State {
    /// Receiving, with an empty queue.
    #[default]
    Idle,
    /// Receiving until the back-off ends; `exponent` is the back-off exponent.
    Waiting { until: Instant, exponent: u32 },
    /// TimelineEvent from receiving to sending.
    TimelineEvent { until: Instant },
    /// Sending.
    Sending,
}

#[derive(Debug, Default)]
pub(super) struct Radio {
    pub(super) state: State,
    /// Queued frames, without the one being sent.
    pub(super) queue: VecDeque<Vec<u8>>,
}

impl Radio {
    /// Returns true while the radio cannot receive.
    pub(super) fn is_deaf(&self) -> bool {
        matches!(self.state, State::TimelineEvent { .. } | State::Sending)
    }

    /// Returns the number of frames held, including the one being sent.
    pub(super) fn held(&self) -> usize {
        self.queue.len() + usize::from(self.state == State::Sending)
    }
}
