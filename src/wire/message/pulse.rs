//! A pulse, by which the relays of a view know that all of them still hold it, and what comes back of it.

use super::parts::{MessageError, PassId, Word, read, write};
use super::tag;

/// Onward: the leader of the view still holds it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulse {
    /// Its number, wrapping: all have taken part in the one before.
    pub number: u16,
    /// Digest of the mission and the view.
    pub mission: u16,
    /// How long a relay may hold the view after it has taken part in one, in tenths of a second: 1 to 65535.
    pub lease: u16,
}

/// Back: the pulse has arrived.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulsed {
    /// Number of the pulse.
    pub number: u16,
    /// Digest of the mission and the view.
    pub mission: u16,
    /// Whether it has come to the last relay, and back from there.
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
