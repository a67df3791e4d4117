//! Frame around a body: header, CRC and COBS.

use crc::{CRC_32_ISCSI, Crc};
use uav_relay::wire::frame::Header;

/// Encodes the ten bytes before the body.
pub(crate) fn header(header: Header) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend((0x1000 | header.sender).to_le_bytes());
    out.extend(header.destination.to_le_bytes());
    out.extend(header.network.to_le_bytes());
    out.extend(header.counter.to_le_bytes());
    out
}

/// Appends the CRC.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = Crc::<u32>::new(&CRC_32_ISCSI).checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// Encodes a frame without COBS.
pub(crate) fn plain(head: Header, body: &[u8]) -> Vec<u8> {
    sealed([&header(head), body].concat())
}

/// Encodes COBS and the delimiter.
pub(crate) fn wire(plain: &[u8]) -> Vec<u8> {
    let mut out = cobs::encode_vec(plain);
    out.push(0);
    out
}
