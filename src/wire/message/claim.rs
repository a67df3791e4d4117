//! Claim to a node number, by which two nodes with the same number detect each other.

use super::parts::{MessageError, read, tag, write};

/// Claim of the sender to its node number since its start, or the repetition of such a claim. Sent in both directions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Claim {
    /// Claim number of the node: drawn at its start, raised at most once while it is active.
    pub number: u32,
    /// Last claim number received under the node's own number from another node; 0 for none.
    pub heard: u32,
    /// True if the node is passive because another node uses its number.
    pub passive: bool,
    /// True if the sender repeats what it received under the destination's number.
    pub echo: bool,
}

impl Claim {
    /// Encodes the claim; flags from bit 0: passive, echo.
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let flags = u8::from(self.passive) | u8::from(self.echo) << 1;
        let numbers = [self.number, self.heard].map(u32::to_le_bytes);
        write(&(tag::CLAIM, numbers, flags), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ([number, heard], flags): ([[u8; 4]; 2], u8) = read(body)?;
        if flags > 3 {
            return Err(MessageError::Value);
        }
        Ok(Self {
            number: u32::from_le_bytes(number),
            heard: u32::from_le_bytes(heard),
            passive: flags & 1 != 0,
            echo: flags & 2 != 0,
        })
    }
}
