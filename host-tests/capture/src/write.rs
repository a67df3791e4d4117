//! The writer of a capture.

use std::io::{self, Write};
use std::time::Duration;

/// The link type of a capture: LINKTYPE_USER0, for which the dissector is registered.
pub const LINK_TYPE: u32 = 147;

// Blocks, options and the byte-order magic of the pcapng format (draft-ietf-opsawg-pcapng).
const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const BYTE_ORDER: u32 = 0x1A2B_3C4D;
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;
const END_OF_OPTIONS: u16 = 0;
const COMMENT: u16 = 1;
const USER_APPLICATION: u16 = 4;
const INTERFACE_NAME: u16 = 2;
const INTERFACE_DESCRIPTION_TEXT: u16 = 3;
const INTERFACE_RESOLUTION: u16 = 9;
const PACKET_FLAGS: u16 = 2;

/// Times are in nanoseconds: 10^-9 s.
const NANOSECONDS: u8 = 9;

/// Which way a frame went, as seen by who writes the capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Direction {
    /// Past it.
    #[default]
    Unknown,
    /// To it.
    In,
    /// From it.
    Out,
}

impl Direction {
    /// The lowest two bits of the flags of a packet.
    const fn bits(self) -> u32 {
        match self {
            Self::Unknown => 0,
            Self::In => 1,
            Self::Out => 2,
        }
    }
}

/// A port, a link or a channel of a capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Interface(u32);

/// One frame of a capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frame<'a> {
    /// When its last byte was on the wire, since 1970; a virtual clock counts from its own begin.
    pub at: Duration,
    /// It, as it was on the wire: COBS, and the delimiter last.
    pub bytes: &'a [u8],
    /// How many bytes it had, where not all of them are there.
    pub len: usize,
    /// Which way it went.
    pub direction: Direction,
    /// What is to be said of it; nothing if it is empty.
    pub comment: &'a str,
}

/// A capture that is being written.
pub struct Capture<W: Write> {
    out: W,
    interfaces: u32,
}

impl<W: Write> std::fmt::Debug for Capture<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = f.debug_struct("Capture");
        shown.field("interfaces", &self.interfaces);
        shown.finish_non_exhaustive()
    }
}

impl<W: Write> Capture<W> {
    /// Begins a capture in `out`: `application` is who writes it, `comment` what is to be said of it all, nothing if it is empty.
    ///
    /// Every frame is handed to `out` at once; whether that keeps it back is its own affair.
    ///
    /// # Errors
    /// `out` cannot be written to.
    pub fn new(out: W, application: &str, comment: &str) -> io::Result<Self> {
        let mut block = Block::new(SECTION_HEADER);
        block.u32(BYTE_ORDER);
        // Version 1.0 of the format.
        block.u16(1);
        block.u16(0);
        // The length of the section is not known while it is written.
        block.bytes(&[0xFF; 8]);
        block.option(USER_APPLICATION, application.as_bytes());
        block.text(COMMENT, comment);
        let mut capture = Self { out, interfaces: 0 };
        block.write(&mut capture.out)?;
        Ok(capture)
    }

    /// A port, a link or a channel more.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn interface(&mut self, name: &str, description: &str) -> io::Result<Interface> {
        let mut block = Block::new(INTERFACE_DESCRIPTION);
        // The link type has 16 bits, and 16 reserved ones behind it.
        block.u32(LINK_TYPE);
        // Frames are not cut.
        block.u32(0);
        block.option(INTERFACE_NAME, name.as_bytes());
        block.option(INTERFACE_RESOLUTION, &[NANOSECONDS]);
        block.text(INTERFACE_DESCRIPTION_TEXT, description);
        block.write(&mut self.out)?;
        let interface = Interface(self.interfaces);
        self.interfaces += 1;
        Ok(interface)
    }

    /// A frame more.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn frame(&mut self, interface: Interface, frame: &Frame<'_>) -> io::Result<()> {
        let nanoseconds = u64::try_from(frame.at.as_nanos()).unwrap_or(u64::MAX);
        let [high, low] = [nanoseconds >> 32, nanoseconds & 0xFFFF_FFFF]
            .map(|half| u32::try_from(half).unwrap_or(u32::MAX));
        let mut block = Block::new(ENHANCED_PACKET);
        block.u32(interface.0);
        block.u32(high);
        block.u32(low);
        block.u32(length(frame.bytes.len()));
        block.u32(length(frame.len));
        block.padded(frame.bytes);
        if frame.direction != Direction::Unknown {
            block.option(PACKET_FLAGS, &frame.direction.bits().to_le_bytes());
        }
        block.text(COMMENT, frame.comment);
        block.write(&mut self.out)
    }

    /// Has `out` keep nothing back, so that whoever follows the file sees all frames so far.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Ends it: what it was written to, all of it written there.
    ///
    /// # Errors
    /// The last of it cannot be written.
    pub fn finish(self) -> io::Result<W> {
        let Self { mut out, .. } = self;
        out.flush()?;
        Ok(out)
    }
}

/// A block of the format: type, length, contents, and the length again. Numbers are little-endian; contents are padded to four bytes.
struct Block {
    kind: u32,
    contents: Vec<u8>,
    has_options: bool,
}

impl Block {
    const fn new(kind: u32) -> Self {
        Self {
            kind,
            contents: Vec::new(),
            has_options: false,
        }
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.contents.extend_from_slice(bytes);
    }

    fn u16(&mut self, number: u16) {
        self.bytes(&number.to_le_bytes());
    }

    fn u32(&mut self, number: u32) {
        self.bytes(&number.to_le_bytes());
    }

    /// Bytes, and zeros up to a multiple of four.
    fn padded(&mut self, bytes: &[u8]) {
        self.bytes(bytes);
        let full = self.contents.len().next_multiple_of(4);
        self.contents.resize(full, 0);
    }

    /// An option; a value longer than its 16-bit length field can say is cut.
    fn option(&mut self, code: u16, value: &[u8]) {
        let length = u16::try_from(value.len()).unwrap_or(u16::MAX);
        self.u16(code);
        self.u16(length);
        self.padded(value.get(..length.into()).unwrap_or(value));
        self.has_options = true;
    }

    /// An option with a text, unless that is empty.
    fn text(&mut self, code: u16, text: &str) {
        if !text.is_empty() {
            self.option(code, text.as_bytes());
        }
    }

    /// Ends the options, and writes the block in one piece.
    fn write(mut self, out: &mut impl Write) -> io::Result<()> {
        if self.has_options {
            self.u16(END_OF_OPTIONS);
            self.u16(0);
        }
        let whole = length(self.contents.len() + 12).to_le_bytes();
        let mut bytes = Vec::with_capacity(self.contents.len() + 12);
        bytes.extend_from_slice(&self.kind.to_le_bytes());
        bytes.extend_from_slice(&whole);
        bytes.append(&mut self.contents);
        bytes.extend_from_slice(&whole);
        out.write_all(&bytes)
    }
}

fn length(bytes: usize) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}
