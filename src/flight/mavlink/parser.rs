//! Parser of frames from a byte stream.
//!
//! After an invalid frame the parser continues with the byte after its first one, so no valid frame behind it is lost. A frame
//! must have an id of the [table], so few false starts occur in noise and in other messages.

use heapless::Vec;

use super::frame::{Address, CHECKSUM, HEADER, MAGIC, MAX_FRAME, SIGNATURE, SIGNED, checksum};
use super::incoming::{Incoming, Payload};
use super::table::{self, Known};

/// Received message, and its sender.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Received {
    /// Address of the sender.
    pub from: Address,
    /// Content; `None` for a message that is only skipped, or that only a companion sends.
    pub message: Option<Incoming>,
    /// Message id.
    pub id: u32,
    /// True if the frame has a signature, which the parser does not check.
    pub is_signed: bool,
}

/// Counters of a parser.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Valid frames.
    pub frames: u32,
    /// Known messages with a wrong checksum or unknown incompatible flags: corrupted frames, sometimes other bytes.
    pub broken: u32,
}

/// Parser with a buffer of one frame of maximum length.
#[derive(Clone, Debug, Default)]
pub struct Parser {
    /// Received bytes; if not empty, they start with a possible frame.
    bytes: Vec<u8, MAX_FRAME>,
    counters: Counters,
}

enum First {
    /// Incomplete frame.
    Part,
    /// Unknown or invalid header.
    None,
    /// Corrupted frame.
    Broken,
    Frame(Received, usize),
}

impl Parser {
    /// Creates a parser.
    pub const fn new() -> Self {
        Self {
            bytes: Vec::new(),
            counters: Counters {
                frames: 0,
                broken: 0,
            },
        }
    }

    /// Adds one byte. Call [`next_message`](Self::next_message) until it returns `None` before the next one. Constant work.
    pub fn push(&mut self, byte: u8) {
        if self.bytes.is_empty() && byte != MAGIC {
            return;
        }
        if self.bytes.push(byte).is_err() {
            // The caller has not polled for messages.
            self.bytes.clear();
        }
    }

    /// Returns the next message. Constant work for each byte, see [`next_frame`](Self::next_frame).
    pub fn next_message(&mut self) -> Option<Received> {
        self.next_frame(|received, _| received)
    }

    /// Returns the result of `read` for the next message and its frame.
    ///
    /// Each byte starts at most one checksum, of at most 266 bytes. In real frames at most one byte in ten does so, in
    /// maliciously chosen bytes one in three.
    pub fn next_frame<T>(&mut self, read: impl FnOnce(Received, &[u8]) -> T) -> Option<T> {
        while !self.bytes.is_empty() {
            match first(&self.bytes) {
                First::Part => return None,
                First::None => self.drop_front(1),
                First::Broken => {
                    self.counters.broken = self.counters.broken.saturating_add(1);
                    self.drop_front(1);
                }
                First::Frame(received, length) => {
                    self.counters.frames = self.counters.frames.saturating_add(1);
                    let all = self.bytes.get(..length).unwrap_or_default();
                    let read = read(received, all);
                    self.drop_front(length);
                    return Some(read);
                }
            }
        }
        None
    }

    /// Counters since the parser was created.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Discards the first `length` bytes, and those up to the next possible start of a frame.
    fn drop_front(&mut self, length: usize) {
        let rest = self.bytes.get(length..).unwrap_or_default();
        let skipped = rest.iter().take_while(|byte| **byte != MAGIC).count();
        let from = length + skipped;
        let left = self.bytes.len().saturating_sub(from);
        // A manual loop, since `copy_within` calls code of a kilobyte and a half of flash.
        for at in 0..left {
            let byte = self.bytes.get(from + at).copied().unwrap_or_default();
            if let Some(place) = self.bytes.get_mut(at) {
                *place = byte;
            }
        }
        self.bytes.truncate(left);
    }
}

fn first(bytes: &[u8]) -> First {
    let Some(header) = bytes.first_chunk::<HEADER>() else {
        return First::Part;
    };
    let [_, length, incompatible, _, _, system, component, a, b, c] = *header;
    let id = u32::from_le_bytes([a, b, c, 0]);
    let Some(known) = table::find(id).filter(|known| length <= known.longest()) else {
        return First::None;
    };
    if incompatible & !SIGNED != 0 {
        return First::Broken;
    }
    let is_signed = incompatible & SIGNED != 0;
    let end = HEADER + usize::from(length);
    let all = end + CHECKSUM + if is_signed { SIGNATURE } else { 0 };
    if bytes.len() < all {
        return First::Part;
    }
    if !holds(bytes, end, known) {
        return First::Broken;
    }
    let payload = Payload(bytes.get(HEADER..end).unwrap_or_default());
    let received = Received {
        from: Address { system, component },
        message: Incoming::read(id, payload),
        id,
        is_signed,
    };
    First::Frame(received, all)
}

/// Returns true if the checksum at `end` matches the bytes before it.
fn holds(bytes: &[u8], end: usize, known: Known) -> bool {
    let said = bytes.get(end..).and_then(<[u8]>::first_chunk);
    bytes
        .get(1..end)
        .is_some_and(|covered| said == Some(&checksum(covered, known).to_le_bytes()))
}
