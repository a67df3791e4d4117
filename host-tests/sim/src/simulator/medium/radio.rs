//! The radio of one node: what it does, and the frames that it has yet to send.

use std::collections::VecDeque;

use uav_relay::Instant;

/// What a radio does.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum State {
    /// It receives, and has nothing to send.
    #[default]
    Idle,
    /// It receives until it senses the channel; how far the bound on its waits has doubled.
    Waiting { until: Instant, exponent: u32 },
    /// It turns from receiving to sending.
    Turning { until: Instant },
    /// It sends.
    Sending,
}

/// The radio of one node.
#[derive(Debug, Default)]
pub(super) struct Radio {
    pub(super) state: State,
    /// The frames to come, without the one that it sends.
    pub(super) queue: VecDeque<Vec<u8>>,
}

impl Radio {
    /// Whether it hears nothing: it has one antenna.
    pub(super) fn is_deaf(&self) -> bool {
        matches!(self.state, State::Turning { .. } | State::Sending)
    }

    /// How many frames it holds, the one that it sends among them.
    pub(super) fn held(&self) -> usize {
        self.queue.len() + usize::from(self.state == State::Sending)
    }
}
