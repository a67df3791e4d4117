//! Medium that loses, duplicates, reorders and delays messages.

use chacha20::ChaCha8Rng;
use rand::RngExt;
use uav_relay::Side;
use uav_relay::guard::Fence;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Faults {
    /// Probability that a message is lost, 0 to 1.
    pub(crate) loss: f64,
    /// Probability that a message is duplicated, 0 to 1.
    pub(crate) twice: f64,
    pub(crate) delay_s: f64,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct FenceMessage {
    pub(crate) sent_s: f64,
    due_s: f64,
    pub(crate) to: usize,
    pub(crate) from: usize,
    /// Side of the receiver on which the sender of the message is.
    pub(crate) side: Side,
    pub(crate) fence: Fence,
    /// Number of the line from Tx to Rx in whose coordinates the message's positions are.
    pub(crate) line: u32,
}

/// Simulated medium: the messages between drones that are in transit.
#[derive(Debug, Default)]
pub(crate) struct Medium {
    messages: Vec<FenceMessage>,
}

impl Medium {
    pub(crate) fn send(
        &mut self,
        rng: &mut ChaCha8Rng,
        faults: Faults,
        now_s: f64,
        (from, to, side): (usize, usize, Side),
        (fence, line): (Fence, u32),
    ) {
        let copies = if rng.random_bool(faults.twice) { 2 } else { 1 };
        for _ in 0..copies {
            if rng.random_bool(faults.loss) {
                continue;
            }
            // The cube keeps long delays rare.
            let delay = faults.delay_s * rng.random_range(0.0..=1.0_f64).powi(3);
            self.messages.push(FenceMessage {
                sent_s: now_s,
                due_s: now_s + 0.01 + delay,
                to,
                from,
                side,
                fence,
                line,
            });
        }
    }

    /// Removes and returns the messages that have arrived by `now_s`, in no particular order.
    pub(crate) fn arrived(&mut self, now_s: f64) -> Vec<FenceMessage> {
        if self.messages.is_empty() {
            return Vec::new();
        }
        let (arrived, rest) = self
            .messages
            .iter()
            .copied()
            .partition(|message| message.due_s <= now_s);
        self.messages = rest;
        arrived
    }
}
