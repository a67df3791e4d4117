//! The writer of a capture.

use std::io::{self, Write};
use std::time::Duration;

use pcap_file::pcapng::PcapNgWriter;
use pcap_file::pcapng::blocks::enhanced_packet::{EnhancedPacketBlock, EnhancedPacketOption};
use pcap_file::pcapng::blocks::interface_description::{
    InterfaceDescriptionBlock, InterfaceDescriptionOption,
};
use pcap_file::pcapng::blocks::section_header::{SectionHeaderBlock, SectionHeaderOption};
use pcap_file::{DataLink, Endianness, PcapError};

/// The link type of a capture: LINKTYPE_USER0, for which the dissector is registered.
pub const LINK_TYPE: u32 = 147;

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
    writer: PcapNgWriter<W>,
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
        let mut options = vec![SectionHeaderOption::UserApplication(
            application.to_owned().into(),
        )];
        if !comment.is_empty() {
            options.push(SectionHeaderOption::Comment(comment.to_owned().into()));
        }
        let section = SectionHeaderBlock {
            endianness: Endianness::Little,
            major_version: 1,
            minor_version: 0,
            section_length: -1,
            options,
        };
        let writer = PcapNgWriter::with_section_header(out, section).map_err(failed)?;
        Ok(Self {
            writer,
            interfaces: 0,
        })
    }

    /// A port, a link or a channel more.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn interface(&mut self, name: &str, description: &str) -> io::Result<Interface> {
        let mut options = vec![
            InterfaceDescriptionOption::IfName(name.to_owned().into()),
            InterfaceDescriptionOption::IfTsResol(NANOSECONDS),
        ];
        if !description.is_empty() {
            let description = description.to_owned().into();
            options.push(InterfaceDescriptionOption::IfDescription(description));
        }
        let block = InterfaceDescriptionBlock {
            linktype: DataLink::from(LINK_TYPE),
            snaplen: 0,
            options,
        };
        self.writer.write_pcapng_block(block).map_err(failed)?;
        let interface = Interface(self.interfaces);
        self.interfaces += 1;
        Ok(interface)
    }

    /// A frame more.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn frame(&mut self, interface: Interface, frame: &Frame<'_>) -> io::Result<()> {
        let mut options = Vec::new();
        if frame.direction != Direction::Unknown {
            options.push(EnhancedPacketOption::Flags(frame.direction.bits()));
        }
        if !frame.comment.is_empty() {
            options.push(EnhancedPacketOption::Comment(frame.comment.into()));
        }
        let block = EnhancedPacketBlock {
            interface_id: interface.0,
            timestamp: frame.at,
            original_len: u32::try_from(frame.len).unwrap_or(u32::MAX),
            data: frame.bytes.into(),
            options,
        };
        self.writer.write_pcapng_block(block).map_err(failed)?;
        Ok(())
    }

    /// Has `out` keep nothing back, so that whoever follows the file sees all frames so far.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.get_mut().flush()
    }

    /// Ends it: what it was written to, all of it written there.
    ///
    /// # Errors
    /// The last of it cannot be written.
    pub fn finish(self) -> io::Result<W> {
        let mut out = self.writer.into_inner();
        out.flush()?;
        Ok(out)
    }
}

fn failed(error: PcapError) -> io::Error {
    match error {
        PcapError::IoError(error) => error,
        other => io::Error::other(other),
    }
}
