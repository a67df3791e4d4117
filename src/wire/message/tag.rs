//! Tags: the first byte of a body, which is the kind of message; sweeps have three kinds.

pub(super) const SWEEP: u8 = 0;
pub(super) const VERDICT: u8 = 1;
pub(super) const BUSY: u8 = 2;
pub(super) const HEARTBEAT: u8 = 3;
pub(super) const MEASURED: u8 = 4;
pub(super) const ASIDE: u8 = 5;
pub(super) const GATHER: u8 = 6;
pub(super) const GATHERED: u8 = 7;
pub(super) const TOKEN: u8 = 8;
pub(super) const MOVED: u8 = 9;
pub(super) const HELLO: u8 = 10;
pub(super) const PROPOSAL: u8 = 11;
pub(super) const DECISION: u8 = 12;
pub(super) const FENCE: u8 = 13;
#[cfg(feature = "upload")]
pub(super) const OFFER: u8 = 14;
pub(super) const PULSE: u8 = 15;
pub(super) const PULSED: u8 = 16;
pub(super) const SENSE: u8 = 17;
pub(super) const SENSED: u8 = 18;
#[cfg(feature = "upload")]
pub(super) const LEVEL: u8 = 19;
pub(super) const CLAIM: u8 = 20;
