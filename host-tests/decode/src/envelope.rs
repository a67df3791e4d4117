//! Frame around a body: header, CRC and COBS, written without the crate's codec.

use uav_relay::CRC_32C;
use uav_relay::wire::frame::Header;

/// Returns header and body of a frame, without tag and CRC. `flags` is the top nibble of the second header word.
///
/// A node number of more than 12 bits overwrites other bits of the header, so that tests can build invalid frames.
pub fn before(header: Header, flags: u16, body: &[u8]) -> Vec<u8> {
    let first = 0x1000 | header.sender;
    let mut plain = first.to_le_bytes().to_vec();
    plain.extend((flags << 12 | header.destination).to_le_bytes());
    plain.extend(header.network.to_le_bytes());
    plain.extend(header.counter.to_le_bytes());
    plain.extend(body);
    plain
}

/// Appends the CRC to the frame `plain`.
pub fn sealed(mut plain: Vec<u8>) -> Vec<u8> {
    plain.extend(CRC_32C.checksum(&plain).to_le_bytes());
    plain
}

/// Returns a frame with CRC, but without tag and COBS.
pub fn unsigned(header: Header, body: &[u8]) -> Vec<u8> {
    sealed(before(header, 0, body))
}

/// Returns the frame `plain` as sent on the wire: encoded by another crate's COBS, with the delimiter.
pub fn stuffed(plain: &[u8]) -> Vec<u8> {
    let mut out = cobs::encode_vec(plain);
    out.push(0);
    out
}

/// Decodes `stuffed`, a frame without its delimiter, by the definition of COBS.
///
/// Also returns true if the last COBS run (bytes after a code byte) is complete. If the run is cut short, its existing
/// bytes are returned, too.
pub fn unstuffed(stuffed: &[u8]) -> (Vec<u8>, bool) {
    let mut plain = Vec::with_capacity(stuffed.len());
    let (mut rest, mut whole) = (stuffed, true);
    while let Some((&code, after)) = rest.split_first() {
        let run = usize::from(code).saturating_sub(1);
        whole = run <= after.len();
        let (run, after) = after.split_at_checked(run).unwrap_or((after, &[]));
        plain.extend_from_slice(run);
        if code < 255 && !after.is_empty() {
            plain.push(0);
        }
        rest = after;
    }
    (plain, whole)
}
