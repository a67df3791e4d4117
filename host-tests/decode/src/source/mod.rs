//! Frames from a capture or from a stream of bytes, each as soon as it is whole.

mod capture;

use std::io::{self, Read};
use std::time::Duration;

use uav_relay_capture::{Cut, Direction, Piece};

/// A capture begins with these bytes; no frame does: the second one of its header, here 0d, would have to be 1x.
const CAPTURE: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];

/// What comes out of a source.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Item<'a> {
    /// What a capture says of all that follows.
    Comment(&'a str),
    /// A frame.
    Packet(Packet<'a>),
}

/// A frame as it came.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Packet<'a> {
    /// When its last byte was on the wire, since 1970; a capture knows that.
    pub at: Option<Duration>,
    /// Where, as the capture calls it; empty if nobody knows.
    pub interface: &'a str,
    /// Which way it went.
    pub direction: Direction,
    /// What is said of it; empty if nothing is.
    pub comment: &'a str,
    /// Its bytes on the wire, or the first of them.
    pub wire: &'a [u8],
    /// How many there were.
    pub len: usize,
}

/// Why a source could not be read to its end.
#[derive(Debug)]
pub enum Trouble<E> {
    /// It cannot be read.
    Read(io::Error),
    /// It is no sound capture.
    Capture(String),
    /// Whoever took the frames has had enough.
    Taken(E),
}

/// Hands all that is in `input` to `take`: of a capture, or else of a stream of bytes.
///
/// # Errors
/// [`Trouble`]; all that came before it has been handed over.
pub fn read<E>(
    mut input: impl Read,
    mut take: impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), Trouble<E>> {
    // As few bytes as it takes to tell: a frame on a line may be all that comes.
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

/// A piece of a stream, of which nothing else is known.
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
