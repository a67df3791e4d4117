//! What went wrong on this side of a serial link.

use super::port::Fault;
use crate::stats::bump;

/// Counters of one link since it was made; each stays at its maximum once it gets there.
///
/// What is wrong with frames that did arrive is counted in [`Stats`](crate::Stats).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SerialStats {
    /// Bytes lost because they were not read in time.
    pub overrun: u32,
    /// Bytes without a stop bit.
    pub framing: u32,
    /// Bytes with the wrong parity.
    pub parity: u32,
    /// Bytes from a noisy line.
    pub noise: u32,
    /// Reads that failed for any other reason.
    pub other: u32,
    /// Writes, and questions whether the last byte had left, that failed; the bytes are offered again.
    pub write: u32,
    /// Times the driver-enable pin could not be set; it is tried again.
    pub pin: u32,
    /// Frames that did not fit behind those that wait: the port takes nothing. The relay repeats what matters.
    pub dropped: u32,
    /// Frames for a port that is not there: the relay's [`Wiring`](crate::Wiring) is not the one of this driver.
    pub unrouted: u32,
}

impl SerialStats {
    /// Counts a read that failed.
    pub(crate) fn read_failed(&mut self, fault: Fault) {
        bump(match fault {
            Fault::Overrun => &mut self.overrun,
            Fault::Framing => &mut self.framing,
            Fault::Parity => &mut self.parity,
            Fault::Noise => &mut self.noise,
            Fault::Other => &mut self.other,
        });
    }
}
