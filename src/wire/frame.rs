//! Frame: header, body, CRC, then COBS and a zero byte as delimiter.

use super::CRC_32C;
use super::auth::{Signer, TAG, TAG_ROOM};
use super::message::{MAX_BODY, Message, MessageError};
pub use super::{MAX_NODE, MAX_SWEEP};
use crate::features::AUTH;

/// Version of the frame format, in the top four bits of a frame's first 16-bit word.
pub const VERSION: u8 = 1;

/// Length of a frame's header, bytes.
pub const HEADER: usize = 10;

const CHECK: usize = 4;

/// Maximum length of a frame before COBS, bytes.
pub const MAX_DECODED: usize = HEADER + MAX_BODY + TAG_ROOM + CHECK;

/// Maximum length of a frame on the wire, bytes. COBS adds one byte to a frame of fewer than 254 bytes, and the
/// delimiter adds one.
pub const MAX_FRAME: usize = MAX_DECODED + 2;

/// Header flag: an authentication tag follows the body.
const SIGNED: u16 = 0x1000;

/// Header flag: the body is an authentication handshake. A handshake is valid only with a tag.
const HANDSHAKE: u16 = 0x2000;

/// Buffer for one encoded frame; its size is the maximum length of a frame.
pub type FrameBuf = [u8; MAX_FRAME];

/// Header of a frame: numbers of the network, the sender, the destination and the frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Number of the network. Chains within radio range of each other need different network numbers.
    pub network: u16,
    /// Node number of the sender: 0 is Tx, 1 to N the relays, N + 1 Rx.
    pub sender: u16,
    /// Node number of the frame's destination.
    pub destination: u16,
    /// Number of frames that the sender has sent before this frame; it wraps.
    pub counter: u32,
}

/// Reason why a received frame is rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// The frame is too short for a header and a CRC.
    Short,
    /// The CRC at the end of the frame does not match.
    Crc,
    /// The frame has an unknown version of the format, or unknown flags.
    Version,
    /// The message in the frame's body is invalid.
    Message(MessageError),
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Short => f.write_str("the frame is too short"),
            Self::Crc => f.write_str("the CRC does not match"),
            Self::Version => f.write_str("the frame has another version of the frame format"),
            Self::Message(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for FrameError {}

/// Encodes `message` into `out`. Returns the length including the delimiter, or 0 if a node number is too large.
///
/// Work linear in the length of the frame, at most [`MAX_FRAME`] bytes.
pub fn encode(header: Header, message: &Message, out: &mut FrameBuf) -> usize {
    let len = body(out).and_then(|body| message.encode(body));
    close(header, 0, len, None, out)
}

pub(crate) fn encode_signed(
    header: Header,
    message: &Message,
    signer: Signer<'_>,
    out: &mut FrameBuf,
) -> usize {
    let len = body(out).and_then(|body| message.encode(body));
    close(header, SIGNED, len, Some(signer), out)
}

pub(crate) fn encode_handshake(
    header: Header,
    handshake: &[u8],
    signer: Signer<'_>,
    out: &mut FrameBuf,
) -> usize {
    let place = body(out).and_then(|body| body.get_mut(..handshake.len()));
    let len = place.map(|place| {
        place.copy_from_slice(handshake);
        handshake.len()
    });
    close(header, SIGNED | HANDSHAKE, len, Some(signer), out)
}

/// Returns the part of the buffer `out` for a frame's body. The body begins after the COBS code byte and the header.
fn body(out: &mut FrameBuf) -> Option<&mut [u8]> {
    out.get_mut(1 + HEADER..)?.get_mut(..MAX_BODY)
}

/// Adds header, tag, CRC and COBS to a frame in `out`, whose body of `body` bytes is already in place. Returns the
/// frame's length, or 0 if `body` is `None` or a node number is too large.
fn close(
    header: Header,
    flags: u16,
    body: Option<usize>,
    signer: Option<Signer<'_>>,
    out: &mut FrameBuf,
) -> usize {
    let Some(body) = body else { return 0 };
    if header.sender > MAX_NODE || header.destination > MAX_NODE {
        return 0;
    }
    let Some(plain) = out.get_mut(1..=MAX_DECODED) else {
        return 0;
    };
    let Some(head) = plain.first_chunk_mut::<HEADER>() else {
        return 0;
    };
    let [a, b] = (u16::from(VERSION) << 12 | header.sender).to_le_bytes();
    let [c, d] = (flags | header.destination).to_le_bytes();
    let [e, f] = header.network.to_le_bytes();
    let [g, h, i, j] = header.counter.to_le_bytes();
    *head = [a, b, c, d, e, f, g, h, i, j];
    let mut checked = HEADER + body;
    if let Some(signer) = signer {
        let tag = signer.tag(plain.get(..checked).unwrap_or_default());
        checked = put(plain, checked, tag);
    }
    let crc = CRC_32C.checksum(plain.get(..checked).unwrap_or_default());
    let len = put(plain, checked, crc.to_le_bytes());
    stuff(out, len)
}

/// Writes `bytes` into `plain` at the offset `at`, and returns the offset of their end.
fn put<const N: usize>(plain: &mut [u8], at: usize, bytes: [u8; N]) -> usize {
    if let Some(place) = plain.get_mut(at..at + N) {
        place.copy_from_slice(&bytes);
    }
    at + N
}

/// Parsed intact frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Opened<'a> {
    /// Header of the frame: addresses and counter.
    pub header: Header,
    /// Body of the frame: a message, or an authentication handshake.
    pub body: &'a [u8],
    /// Bytes that the authentication tag covers: header and body.
    pub signed: &'a [u8],
    /// Authentication tag, not verified; `None` for a frame without a tag.
    pub tag: Option<[u8; TAG]>,
    /// True if the body is an authentication handshake and not a message.
    pub handshake: bool,
}

/// Parses `plain`, a frame without COBS and delimiter. The function checks the CRC, but neither the authentication tag
/// nor the body.
///
/// The receiver checks the sender's and the destination's node numbers before it decodes the body.
///
/// # Errors
/// [`FrameError`]. The CRC is checked first, so every other error is about an intact frame.
pub fn open(plain: &[u8]) -> Result<Opened<'_>, FrameError> {
    let (checked, check) = plain.split_last_chunk::<CHECK>().ok_or(FrameError::Short)?;
    let (head, rest) = checked
        .split_first_chunk::<HEADER>()
        .ok_or(FrameError::Short)?;
    if CRC_32C.checksum(checked) != u32::from_le_bytes(*check) {
        return Err(FrameError::Crc);
    }
    let [a, b, c, d, e, f, g, h, i, j] = *head;
    let first = u16::from_le_bytes([a, b]);
    let second = u16::from_le_bytes([c, d]);
    let flags = second & 0xF000;
    let known = flags == 0 || AUTH && (flags == SIGNED || flags == SIGNED | HANDSHAKE);
    if first >> 12 != u16::from(VERSION) || !known {
        return Err(FrameError::Version);
    }
    let (signed, body, tag) = if flags == 0 {
        (checked, rest, None)
    } else {
        let (signed, tag) = checked.split_last_chunk::<TAG>().ok_or(FrameError::Short)?;
        let body = signed.get(HEADER..).ok_or(FrameError::Short)?;
        (signed, body, Some(*tag))
    };
    Ok(Opened {
        header: Header {
            network: u16::from_le_bytes([e, f]),
            sender: first & 0x0FFF,
            destination: second & 0x0FFF,
            counter: u32::from_le_bytes([g, h, i, j]),
        },
        body,
        signed,
        tag,
        handshake: flags & HANDSHAKE != 0,
    })
}

/// Decodes header and message of a frame: [`open`], then [`Message::decode`]. The tag is not verified.
///
/// # Errors
/// [`FrameError`], also for a handshake, which is not a message.
pub fn decode(plain: &[u8]) -> Result<(Header, Message), FrameError> {
    let Opened {
        header,
        body,
        handshake,
        ..
    } = open(plain)?;
    if handshake {
        return Err(FrameError::Message(MessageError::Encoding));
    }
    let message = Message::decode(body).map_err(FrameError::Message)?;
    Ok((header, message))
}

/// Encodes a frame by COBS in place, and appends the delimiter; returns the total length. The frame is at
/// `out[1..=len]`, fewer than 254 bytes. The encoders of the crate `cobs` would need a second buffer.
fn stuff(out: &mut FrameBuf, len: usize) -> usize {
    // From the end: every zero, and the byte before the first one, becomes the distance to the next.
    let mut run: u8 = 1;
    for byte in out.get_mut(1..=len).unwrap_or_default().iter_mut().rev() {
        if *byte == 0 {
            *byte = run;
            run = 0;
        }
        run = run.wrapping_add(1);
    }
    if let Some(first) = out.first_mut() {
        *first = run;
    }
    if let Some(end) = out.get_mut(len + 1) {
        *end = 0;
    }
    len + 2
}
