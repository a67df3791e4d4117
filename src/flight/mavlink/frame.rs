//! Layout of a MAVLink 2 frame.
//!
//! | byte | content |
//! | --- | --- |
//! | 0 | 0xFD |
//! | 1 | payload length; trailing zeros are not sent, except for the first byte |
//! | 2, 3 | incompatible flags (1: signed), and compatible flags |
//! | 4 | sequence number of the sender |
//! | 5, 6 | system and component of the sender |
//! | 7 to 9 | message id, little-endian |
//! | then | payload, checksum (2 bytes), signature (13 bytes, if signed) |
//!
//! The checksum is CRC-16/MCRF4XX over all bytes but the first, and over the message's CRC seed, which is not sent.

use crc::{CRC_16_MCRF4XX, Crc, NoTable};

use super::table::Known;

/// First byte of a frame.
pub const MAGIC: u8 = 0xFD;

/// Length of the header, bytes.
pub const HEADER: usize = 10;

/// Length of the checksum, bytes.
pub const CHECKSUM: usize = 2;
/// Length of a signed frame's signature, bytes.
pub const SIGNATURE: usize = 13;

/// Maximum payload length, bytes.
pub const MAX_PAYLOAD: usize = 255;

/// Maximum frame length, bytes.
pub const MAX_FRAME: usize = HEADER + MAX_PAYLOAD + CHECKSUM + SIGNATURE;

/// Incompatible flag of a signed frame.
pub const SIGNED: u8 = 1;

/// Bitwise CRC: a table would be a kilobyte of flash, and a link to an autopilot carries only some ten kilobytes a second.
static CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_MCRF4XX);

/// Sender or addressee of a message.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Address {
    /// System id, 1 to 255.
    pub system: u8,
    /// Component id: 1 is the autopilot, 191 an onboard computer.
    pub component: u8,
}

/// Returns the checksum of a frame; `covered` are the bytes between the first one and the checksum.
pub fn checksum(covered: &[u8], known: Known) -> u16 {
    let mut digest = CRC.digest();
    digest.update(covered);
    digest.update(&[known.crc_extra]);
    digest.finalize()
}
