//! Decodes a frame.

use uav_relay::CRC_32C;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::{self, FrameError, HEADER, Header};
use uav_relay::wire::message::{Message, MessageError};

use crate::format::{Format, Layout};
use crate::range;
use crate::refusal::Refusal;
use crate::value::Fields;
use crate::walk::walk;

/// Frame, decoded as far as possible.
#[derive(Clone, PartialEq, Debug)]
pub struct Frame<'f> {
    /// Length of the frame on the wire, bytes.
    pub len: usize,
    /// Header of the frame, if version and CRC are right.
    pub header: Option<Header>,
    /// Name of the frame's message, or `Handshake`; `None` if unknown.
    pub name: Option<&'f str>,
    /// True if the frame is a handshake.
    pub handshake: bool,
    /// Decoded fields of the body, up to the first field that cannot be decoded.
    pub fields: Fields<'f>,
    /// Signed bytes of the frame (header and body), and its authentication tag; `None` without a tag.
    pub tag: Option<(Vec<u8>, [u8; TAG])>,
    /// Reason why a receiver rejects the frame; `None` if it accepts the frame.
    pub refusal: Option<Refusal>,
}

/// Decodes a frame. `wire` has the bytes of the frame with its delimiter, or only the first of these bytes.
///
/// `len` is the length of the whole frame on the wire. The crate's decoder determines if a receiver rejects the frame.
/// The fields, and the reason for a rejection, follow from the tables of `FORMAT.md`.
pub fn read<'f>(format: &'f Format, wire: &[u8], len: usize) -> Frame<'f> {
    let mut frame = Frame {
        len,
        header: None,
        name: None,
        handshake: false,
        fields: Fields::default(),
        tag: None,
        refusal: None,
    };
    match unstuffed(wire, len) {
        Ok(plain) => open(format, &plain, &mut frame),
        Err(refusal) => frame.refusal = Some(refusal),
    }
    frame
}

fn unstuffed(wire: &[u8], len: usize) -> Result<Vec<u8>, Refusal> {
    if wire.len() < len {
        return Err(Refusal::Oversized(len));
    }
    let mut deframer = Deframer::new();
    for &byte in wire {
        match deframer.push(byte) {
            Some(Ok(plain)) => return Ok(plain.to_vec()),
            Some(Err(DeframeError::Oversized)) => return Err(Refusal::Oversized(len)),
            Some(Err(_)) => return Err(Refusal::Truncated),
            None => {}
        }
    }
    Err(Refusal::Unended)
}

fn open<'f>(format: &'f Format, plain: &[u8], frame: &mut Frame<'f>) {
    let opened = match frame::open(plain) {
        Ok(opened) => opened,
        Err(error) => {
            frame.refusal = Some(broken(error, plain));
            return;
        }
    };
    frame.header = Some(opened.header);
    frame.handshake = opened.handshake;
    frame.tag = opened.tag.map(|tag| (opened.signed.to_vec(), tag));
    if opened.handshake {
        let layout = &format.handshake;
        frame.name = Some(&layout.name);
        let (fields, error) = walk(&layout.fields, opened.body);
        let outside = range::outside(layout, &fields).map(|_| Refusal::Range);
        frame.refusal = error.map(Refusal::Malformed).or(outside);
        frame.fields = fields;
        return;
    }
    let Some((&tag, body)) = opened.body.split_first() else {
        frame.refusal = Some(Refusal::Malformed(
            "the body of the message is empty".to_owned(),
        ));
        return;
    };
    let Some(Layout { name, fields }) = format.message(tag) else {
        frame.refusal = Some(Refusal::UnknownTag(tag));
        return;
    };
    frame.name = Some(name);
    let (read, error) = walk(fields, body);
    frame.fields = read;
    frame.refusal = match (Message::decode(opened.body), error) {
        (Ok(_), None) => None,
        (Err(MessageError::Value), None) => Some(Refusal::Range),
        (_, Some(error)) => Some(Refusal::Malformed(error)),
        (Err(_), None) => Some(Refusal::Malformed(
            "the message is not in the canonical encoding".to_owned(),
        )),
    };
}

fn broken(error: FrameError, plain: &[u8]) -> Refusal {
    match (error, plain.split_last_chunk::<4>()) {
        (FrameError::Crc, Some((checked, check))) => {
            Refusal::Crc(u32::from_le_bytes(*check), CRC_32C.checksum(checked))
        }
        (FrameError::Version, Some((&[_, version, _, flags, ..], _))) => {
            Refusal::Version(version >> 4, flags >> 4)
        }
        (FrameError::Version, _) => Refusal::Short(plain.len().min(HEADER)),
        _ => Refusal::Short(plain.len()),
    }
}
