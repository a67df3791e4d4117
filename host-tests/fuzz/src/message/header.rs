//! What stands around a body.

use uav_relay::CRC_32C;

/// Who sends a frame to whom, as words: what stands in the top bits of an address goes on the wire too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Header {
    /// The network.
    pub network: u16,
    /// The sender, and above it the version less 1.
    pub sender: u16,
    /// The destination, and above it flags.
    pub destination: u16,
}

impl Header {
    /// The bytes of a frame before the tag and the check sequence, with some flags more.
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

    /// A frame without a tag, before COBS.
    pub fn unsigned(self, body: &[u8]) -> Vec<u8> {
        let mut plain = self.before(0, 0, body);
        sealed(&mut plain);
        plain
    }
}

/// Adds the check sequence.
pub fn sealed(plain: &mut Vec<u8>) {
    plain.extend_from_slice(&CRC_32C.checksum(plain).to_le_bytes());
}
