//! What signed frames may be taken for: once each, in the lives of both ends that they were sent in.
//!
//! An attacker who records everything plays it back (`Operation::Replay`): nothing of that may count that has counted before.

use std::collections::BTreeSet;

use proptest::prop_assert;
use uav_relay::Stats;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;

use super::Checked;

/// Of a frame: the epochs of its two ends when it was sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Seal {
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// What a relay has taken since it was switched on, from its neighbours upstream and downstream.
#[derive(Clone, Debug, Default)]
pub(crate) struct Taken {
    frames: [BTreeSet<(u32, Vec<u8>)>; 2],
    /// The largest epoch that was taken.
    newest: [u32; 2],
}

/// Frames that have counted.
pub(crate) fn taken(stats: &Stats) -> u32 {
    stats.received + stats.handshakes
}

/// Frames that were no member's, or not new.
pub(crate) fn refused(stats: &Stats) -> u32 {
    stats.forged + stats.replayed
}

/// The epoch of the receiver that a handshake tells, if `wire` is one: all of it, or the upper half of a nonce.
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

impl Taken {
    /// A relay of this epoch takes a frame from the neighbour at `side`: it may. Whether it is a sign of life.
    pub(crate) fn take(
        &mut self,
        side: usize,
        wire: &[u8],
        seal: Seal,
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
        // A handshake that shows another nonce, or none, may have been recorded.
        let told = handshake.as_ref().and_then(|body| body.get(12..16));
        Ok(told.is_none_or(|told| told == epoch.to_le_bytes()))
    }
}
