//! Reads frames from a capture or a byte stream, each as soon as it is complete.

mod capture;

use std::io::{self, Read};
use std::time::Duration;

use uav_relay_capture::{Cut, Direction, Piece};

/// First bytes of a capture. No frame starts with them: the second header byte, here 0d, would be 1x.
const CAPTURE: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];

/// An item of a source.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Item<'a> {
    /// Comment of a capture.
    Comment(&'a str),
    /// A frame.
    Packet(Packet<'a>),
}

/// A frame as captured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Packet<'a> {
    /// Time of its last byte, since 1970; only in captures.
    pub at: Option<Duration>,
    /// Interface name in the capture; empty if unknown.
    pub interface: &'a str,
    /// Direction.
    pub direction: Direction,
    /// Comment of the captured packet; empty if the packet has no comment.
    pub comment: &'a str,
    /// Bytes on the wire, possibly truncated.
    pub wire: &'a [u8],
    /// Original length.
    pub len: usize,
}

/// Error of reading a source.
#[derive(Debug)]
pub enum Trouble<E> {
    /// The source cannot be read.
    Read(io::Error),
    /// The capture is malformed.
    Capture(String),
    /// The consumer stopped with this error.
    Taken(E),
}

/// Passes all items of `input`, a capture or a byte stream, to `take`.
///
/// # Errors
/// [`Trouble`]; the items before it have been passed on.
pub fn read<E>(
    mut input: impl Read,
    mut take: impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), Trouble<E>> {
    // Reads no more bytes than needed, because a single frame on a line may be all that comes.
    let mut begin = Vec::new();
    while begin.len() < CAPTURE.len() && CAPTURE.starts_with(&begin) {
        let mut byte = [0];
        match input.read(&mut byte) {
            Ok(0) => break,
            Ok(_) => begin.extend(byte),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(Trouble::Read(error)),
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
) -> Result<(), Trouble<E>> {
    let mut cut = Cut::default();
    let mut bytes = begin.to_vec();
    let mut buffer = [0; 4_096];
    loop {
        cut.push(&bytes, |piece| take(bare(piece)))
            .map_err(Trouble::Taken)?;
        let read = match input.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => 0,
            Err(error) => return Err(Trouble::Read(error)),
        };
        bytes.clear();
        bytes.extend(buffer.iter().take(read));
    }
    match cut.rest() {
        Some(rest) => take(bare(rest)).map_err(Trouble::Taken),
        None => Ok(()),
    }
}

fn bare(piece: Piece<'_>) -> Item<'_> {
    Item::Packet(Packet {
        at: None,
        interface: "",
        direction: Direction::Unknown,
        comment: "",
        wire: piece.bytes,
        len: piece.len,
    })
}
