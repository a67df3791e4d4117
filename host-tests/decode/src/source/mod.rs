//! Reads frames from a capture or a byte stream, each one as soon as it is complete.

mod capture;

use std::io::{self, Read};
use std::time::Duration;

use uav_relay_capture::{Direction, FrameSplitter, Piece};

/// First bytes of every pcapng capture.
///
/// No frame begins with them, because the second byte of a frame's header is 10 to 1f (hexadecimal), not 0d.
const CAPTURE: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];

/// Item read from a capture or byte stream.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Item<'a> {
    /// Comment on the whole capture.
    Comment(&'a str),
    /// Frame in the capture or byte stream.
    Packet(Packet<'a>),
}

/// Frame as captured, before decoding.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Packet<'a> {
    /// Time of the frame's last byte, since 1970; `None` for a byte stream.
    pub at: Option<Duration>,
    /// Name of the interface in the capture; empty if unknown.
    pub interface: &'a str,
    /// Direction of the frame, seen from the node that wrote the capture.
    pub direction: Direction,
    /// Comment on the packet; empty for none.
    pub comment: &'a str,
    /// Bytes of the frame on the wire, possibly truncated.
    pub wire: &'a [u8],
    /// Length of the whole frame, bytes, even if `wire` is truncated.
    pub len: usize,
}

/// Error while reading a capture or byte stream.
#[derive(Debug)]
pub enum SourceError<E> {
    /// Read error.
    Read(io::Error),
    /// Malformed capture, with the fault.
    Capture(String),
    /// Error that the caller's function `take` has returned, which ended the reading.
    Taken(E),
}

/// Calls `take` with each item of `input`, a capture or a byte stream.
///
/// # Errors
/// [`SourceError`]. The items before the error have been passed to `take`.
pub fn read<E>(
    mut input: impl Read,
    mut take: impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), SourceError<E>> {
    // Reads only the necessary bytes, because the input may have no second frame.
    let mut begin = Vec::new();
    while begin.len() < CAPTURE.len() && CAPTURE.starts_with(&begin) {
        let mut byte = [0];
        match input.read(&mut byte) {
            Ok(0) => break,
            Ok(_) => begin.extend(byte),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(SourceError::Read(error)),
        }
    }
    if begin == CAPTURE {
        capture::read(io::Cursor::new(begin).chain(input), take)
    } else {
        stream(&begin, input, &mut take)
    }
}

fn stream<E>(
    begin: &[u8],
    mut input: impl Read,
    take: &mut impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), SourceError<E>> {
    let mut cut = FrameSplitter::default();
    let mut bytes = begin.to_vec();
    let mut buffer = [0; 4_096];
    loop {
        cut.push(&bytes, |piece| take(item_without_time(piece)))
            .map_err(SourceError::Taken)?;
        let read = match input.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => 0,
            Err(error) => return Err(SourceError::Read(error)),
        };
        bytes.clear();
        bytes.extend(buffer.iter().take(read));
    }
    match cut.rest() {
        Some(rest) => take(item_without_time(rest)).map_err(SourceError::Taken),
        None => Ok(()),
    }
}

fn item_without_time(piece: Piece<'_>) -> Item<'_> {
    Item::Packet(Packet {
        at: None,
        interface: "",
        direction: Direction::Unknown,
        comment: "",
        wire: piece.bytes,
        len: piece.len,
    })
}
