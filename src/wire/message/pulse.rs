//! Lease renewal, and its acknowledgement.

use super::parts::{MessageError, PassId, Word, read, tag, write};

/// Lease renewal by the view's leader; sent onward.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulse {
    /// Number of the renewal, wrapping: all members have taken part in the one before.
    pub number: u16,
    /// Digest of the mission and the view.
    pub mission: u16,
    /// Duration of the lease after a member has taken part in a renewal, in tenths of a second: 1 to 65535.
    pub lease: u16,
}

/// Acknowledgement of a lease renewal; sent back.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulsed {
    /// Number of the renewal.
    pub number: u16,
    /// Digest of the mission and the view.
    pub mission: u16,
    /// True if the renewal has reached the last relay and has been acknowledged by it.
    pub done: bool,
}

impl Pulse {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        write(&(tag::PULSE, pass, Word::new(self.lease)), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, lease): (PassId, Word) = read(body)?;
        let lease = lease.number();
        if lease == 0 {
            return Err(MessageError::Value);
        }
        Ok(Self {
            number: pass.number(),
            mission: pass.mission(),
            lease,
        })
    }
}

impl Pulsed {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        write(&(tag::PULSED, pass, self.done), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, done): (PassId, bool) = read(body)?;
        Ok(Self {
            number: pass.number(),
            mission: pass.mission(),
            done,
        })
    }
}
