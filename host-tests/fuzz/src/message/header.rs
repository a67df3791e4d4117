//! Frame around a body.

use uav_relay::CRC_32C;

/// Addresses of a frame as whole words, because the top bits of an address go on the wire, too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Header {
    /// Network number.
    pub network: u16,
    /// Sender's index; any bits above it change the version in the frame.
    pub sender: u16,
    /// Destination's index; the bits above it are flags.
    pub destination: u16,
}

impl Header {
    /// Returns the bytes of a frame before the tag and the CRC, with additional flags.
    pub fn before(self, flags: u16, counter: u32, body: &[u8]) -> Vec<u8> {
        let mut plain = Vec::with_capacity(22 + body.len());
        for word in [
            1 << 12 | self.sender,
            flags | self.destination,
            self.network,
        ] {
            plain.extend_from_slice(&word.to_le_bytes());
        }
        plain.extend_from_slice(&counter.to_le_bytes());
        plain.extend_from_slice(body);
        plain
    }

    /// Returns a frame without a tag, before COBS.
    pub fn unsigned(self, body: &[u8]) -> Vec<u8> {
        let mut plain = self.before(0, 0, body);
        sealed(&mut plain);
        plain
    }
}

/// Appends the CRC.
pub fn sealed(plain: &mut Vec<u8>) {
    plain.extend_from_slice(&CRC_32C.checksum(plain).to_le_bytes());
}
