//! What stands around a payload.
//!
//! | byte | what |
//! | --- | --- |
//! | 0 | 0xFD |
//! | 1 | bytes of payload; zeros at its end are left out, but for the first byte |
//! | 2, 3 | flags that have to be understood (1: signed), and others |
//! | 4 | counts the frames of a sender |
//! | 5, 6 | the sender's system and component |
//! | 7 to 9 | the message's number, little-endian |
//! | then | payload, checksum (2 bytes), signature (13 bytes, if signed) |
//!
//! The checksum is CRC-16/MCRF4XX over all but the first byte, and over one more that is not sent: the message's own.

use crc::{CRC_16_MCRF4XX, Crc, NoTable};

use super::table::Known;

/// The first byte.
pub const MAGIC: u8 = 0xFD;

/// Bytes before the payload.
pub const HEADER: usize = 10;

/// Bytes of the checksum, and of the signature of a signed frame.
pub const CHECKSUM: usize = 2;
/// See [`CHECKSUM`].
pub const SIGNATURE: usize = 13;

/// The longest payload.
pub const MAX_PAYLOAD: usize = 255;

/// The longest frame.
pub const MAX_FRAME: usize = HEADER + MAX_PAYLOAD + CHECKSUM + SIGNATURE;

/// The flag of a signed frame.
pub const SIGNED: u8 = 1;

/// A table would be a kilobyte of flash; a link to an autopilot carries some ten kilobytes a second.
static CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_MCRF4XX);

/// Who sends, or is meant.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Address {
    /// The vehicle, 1 to 255.
    pub system: u8,
    /// What of it: 1 is the autopilot, 191 an onboard computer.
    pub component: u8,
}

/// The checksum of a frame whose bytes between the first and the checksum are `covered`.
pub fn checksum(covered: &[u8], known: Known) -> u16 {
    let mut digest = CRC.digest();
    digest.update(covered);
    digest.update(&[known.crc_extra]);
    digest.finalize()
}
