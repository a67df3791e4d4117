//! Acceptance of signed frames: each at most once, and only in the epochs at which it was sent.

use std::collections::BTreeSet;

use proptest::prop_assert;
use uav_relay::Stats;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;

use super::Checked;

/// Epochs of a frame's sender (`from`) and receiver (`to`) at the time the frame was sent. An epoch is a number that
/// rises at each start of a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct EpochPair {
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// Signed frames that a relay has accepted since it was switched on. Arrays have one element for the upstream
/// neighbour and one for the downstream neighbour.
#[derive(Clone, Debug, Default)]
pub(crate) struct AcceptedFrames {
    frames: [BTreeSet<(u32, Vec<u8>)>; 2],
    /// Largest epoch in an accepted frame of each neighbour.
    newest: [u32; 2],
}

/// Returns the number of frames that a relay has accepted.
pub(crate) fn accepted_count(stats: &Stats) -> u32 {
    stats.received + stats.handshakes
}

/// Returns the number of frames that a relay has refused as forged or replayed.
pub(crate) fn refused_count(stats: &Stats) -> u32 {
    stats.forged + stats.replayed
}

/// Returns the body of the handshake in `wire`, or `None` for other frames.
fn handshake(wire: &[u8]) -> Option<Vec<u8>> {
    let mut deframer = Deframer::new();
    for &byte in wire {
        if let Some(Ok(plain)) = deframer.push(byte) {
            let opened = frame::open(plain).ok().filter(|opened| opened.handshake)?;
            return Some(opened.body.to_vec());
        }
    }
    None
}

impl AcceptedFrames {
    /// Checks that a frame that a relay has accepted from `side` has valid epochs and is new. Returns true if the frame
    /// proves that the sender is alive.
    pub(crate) fn accept(
        &mut self,
        side: usize,
        wire: &[u8],
        seal: EpochPair,
        epoch: u32,
    ) -> Checked<bool> {
        let handshake = handshake(wire);
        prop_assert!(
            handshake.is_some() || seal.to == epoch,
            "a frame to epoch {} is taken in {epoch}",
            seal.to
        );
        prop_assert!(
            seal.from >= self.newest[side],
            "a frame of epoch {} is taken after one of {}",
            seal.from,
            self.newest[side]
        );
        self.newest[side] = seal.from;
        let is_new = self.frames[side].insert((seal.from, wire.to_vec()));
        prop_assert!(is_new, "a frame is taken twice");
        // A handshake with another nonce, or none, may be a recorded one.
        let told = handshake.as_ref().and_then(|body| body.get(12..16));
        Ok(told.is_none_or(|told| told == epoch.to_le_bytes()))
    }
}
