//! Frames out of a stream of bytes.
//!
//! Where a frame seems to begin and does not hold, reading goes on with the byte after its first: nothing that is whole behind it gets
//! lost. What begins like a frame has one of the numbers of the [table], so in noise and in other messages few do.

use heapless::Vec;

use super::frame::{Address, CHECKSUM, HEADER, MAGIC, MAX_FRAME, SIGNATURE, SIGNED, checksum};
use super::incoming::{Incoming, Payload};
use super::table::{self, Known};

/// A message, and who sent it.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Received {
    /// Who sent it.
    pub from: Address,
    /// What it says; `None` for one that is known only to be passed over, or that a companion sends.
    pub message: Option<Incoming>,
    /// Its number.
    pub id: u32,
    /// Whether it carries a signature, which the parser does not check.
    pub is_signed: bool,
}

/// What has been read.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Frames that were whole.
    pub frames: u32,
    /// What began like one that is known and had another checksum, or flags that are not understood: frames that were hurt, and now and then
    /// the bytes of something else.
    pub broken: u32,
}

/// Takes bytes, gives messages. It holds no more than one frame of the longest kind.
#[derive(Clone, Debug, Default)]
pub struct Parser {
    /// Begins with what may be a frame, if it is not empty.
    bytes: Vec<u8, MAX_FRAME>,
    counters: Counters,
}

/// What the first bytes are.
enum First {
    /// A frame's beginning.
    Part,
    /// No frame.
    None,
    /// No frame, though it looked like one.
    Broken,
    Frame(Received, usize),
}

impl Parser {
    /// One that has read nothing.
    pub const fn new() -> Self {
        Self {
            bytes: Vec::new(),
            counters: Counters {
                frames: 0,
                broken: 0,
            },
        }
    }

    /// Takes one byte. Call [`next_message`](Self::next_message) until it gives `None` before the next one. Constant work.
    pub fn push(&mut self, byte: u8) {
        if self.bytes.is_empty() && byte != MAGIC {
            return;
        }
        if self.bytes.push(byte).is_err() {
            // Nobody took what was there.
            self.bytes.clear();
        }
    }

    /// The next message of the bytes so far. Constant work for each byte, as [`next_frame`](Self::next_frame) says.
    pub fn next_message(&mut self) -> Option<Received> {
        self.next_frame(|received, _| received)
    }

    /// The same, as `read` has it of the message and the frame's bytes. Each byte begins at most one checksum, of at most 266 bytes. In frames one byte in ten or fewer
    /// does; of bytes that somebody has chosen for it one in three may.
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

    /// What has been read so far.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Goes on behind the first `length` bytes, with the next one that may begin a frame.
    fn drop_front(&mut self, length: usize) {
        let rest = self.bytes.get(length..).unwrap_or_default();
        let skipped = rest.iter().take_while(|byte| **byte != MAGIC).count();
        let from = length + skipped;
        let left = self.bytes.len().saturating_sub(from);
        // By hand: what `copy_within` calls is a kilobyte and a half of flash.
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

/// Whether the checksum at `end` is that of the bytes before it.
fn holds(bytes: &[u8], end: usize, known: Known) -> bool {
    let said = bytes.get(end..).and_then(<[u8]>::first_chunk);
    bytes
        .get(1..end)
        .is_some_and(|covered| said == Some(&checksum(covered, known).to_le_bytes()))
}
