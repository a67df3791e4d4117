//! Writer of pcapng captures.

use std::io::{self, Write};
use std::time::Duration;

/// Link type of all interfaces in a capture: LINKTYPE_USER0. The Wireshark dissector is registered for it.
pub const LINK_TYPE: u32 = 147;

// Block types, options and byte-order magic of the pcapng format (draft-ietf-opsawg-pcapng).
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

/// Resolution of the timestamps in a capture: 10^-9 s. A pcapng file has only the exponent, 9.
const NANOSECONDS: u8 = 9;

/// Direction of a frame, seen from the node at which the capture is made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Direction {
    /// Frame between other nodes, or of unknown direction.
    #[default]
    Unknown,
    /// Received frame.
    In,
    /// Sent frame.
    Out,
}

impl Direction {
    const fn bits(self) -> u32 {
        match self {
            Self::Unknown => 0,
            Self::In => 1,
            Self::Out => 2,
        }
    }
}

/// Handle of an interface (a port, link or radio channel) in a capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Interface(u32);

/// Frame to be written to a capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frame<'a> {
    /// Time of the frame's last byte: since 1970, or in a simulation the virtual time since the start.
    pub at: Duration,
    /// Bytes of the frame on the wire: COBS, with the final delimiter.
    pub bytes: &'a [u8],
    /// Length of the whole frame, bytes. It is larger than `bytes.len()` if the frame was cut.
    pub len: usize,
    /// Direction of the frame.
    pub direction: Direction,
    /// Comment on the frame in the capture; empty without a comment.
    pub comment: &'a str,
}

/// Writer of a pcapng capture.
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
    /// Starts a capture in `out`. `application` names the program; `comment`, if any, describes the capture.
    ///
    /// No frame is buffered here: each is passed to `out` at once.
    ///
    /// # Errors
    /// `out` cannot be written to.
    pub fn new(out: W, application: &str, comment: &str) -> io::Result<Self> {
        let mut block = Block::new(SECTION_HEADER);
        block.u32(BYTE_ORDER);
        // Version 1.0 of the format.
        block.u16(1);
        block.u16(0);
        // Section length: unknown while writing.
        block.bytes(&[0xFF; 8]);
        block.option(USER_APPLICATION, application.as_bytes());
        block.text(COMMENT, comment);
        let mut capture = Self { out, interfaces: 0 };
        block.write(&mut capture.out)?;
        Ok(capture)
    }

    /// Adds an interface (a port, link or radio channel) to the capture.
    ///
    /// # Errors
    /// The capture cannot be written.
    pub fn interface(&mut self, name: &str, description: &str) -> io::Result<Interface> {
        let mut block = Block::new(INTERFACE_DESCRIPTION);
        // The link type has 16 bits, followed by 16 reserved bits.
        block.u32(LINK_TYPE);
        // No limit on the length of packets.
        block.u32(0);
        block.option(INTERFACE_NAME, name.as_bytes());
        block.option(INTERFACE_RESOLUTION, &[NANOSECONDS]);
        block.text(INTERFACE_DESCRIPTION_TEXT, description);
        block.write(&mut self.out)?;
        let interface = Interface(self.interfaces);
        self.interfaces += 1;
        Ok(interface)
    }

    /// Adds a frame to the capture.
    ///
    /// # Errors
    /// The capture cannot be written.
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

    /// Flushes `out`, so that readers of the file see all frames written.
    ///
    /// # Errors
    /// The capture cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Ends the capture: flushes and returns `out`.
    ///
    /// # Errors
    /// The capture cannot be written.
    pub fn finish(self) -> io::Result<W> {
        let Self { mut out, .. } = self;
        out.flush()?;
        Ok(out)
    }
}

/// Block of a pcapng file: type, length, contents, length again. Little-endian, padded to four bytes.
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

    fn padded(&mut self, bytes: &[u8]) {
        self.bytes(bytes);
        let full = self.contents.len().next_multiple_of(4);
        self.contents.resize(full, 0);
    }

    /// Appends an option to the block; a value too long for the 16-bit length field is cut.
    fn option(&mut self, code: u16, value: &[u8]) {
        let length = u16::try_from(value.len()).unwrap_or(u16::MAX);
        self.u16(code);
        self.u16(length);
        self.padded(value.get(..length.into()).unwrap_or(value));
        self.has_options = true;
    }

    fn text(&mut self, code: u16, text: &str) {
        if !text.is_empty() {
            self.option(code, text.as_bytes());
        }
    }

    /// Ends the block's options, and writes the block in one call.
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
