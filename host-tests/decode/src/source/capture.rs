//! Reads frames from a pcapng capture.

use std::io::{ErrorKind, Read};
use std::time::Duration;

use pcap_file::PcapError;
use pcap_file::pcapng::blocks::enhanced_packet::{EnhancedPacketBlock, EnhancedPacketOption};
use pcap_file::pcapng::blocks::interface_description::{
    InterfaceDescriptionBlock, InterfaceDescriptionOption,
};
use pcap_file::pcapng::blocks::section_header::SectionHeaderOption;
use pcap_file::pcapng::{Block, PcapNgReader};
use uav_relay_capture::{Direction, FrameSplitter, LINK_TYPE, Piece};

use super::{Item, Packet, SourceError};

struct Interface {
    name: String,
    is_ours: bool,
    /// Time resolution of the interface's timestamps: n means 10^-n s, 128 + n means 2^-n s.
    resolution: u8,
}

pub(super) fn read<E>(
    input: impl Read,
    mut take: impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), SourceError<E>> {
    let mut reader = PcapNgReader::new(input).map_err(source_error)?;
    let comment = reader
        .section()
        .options
        .iter()
        .find_map(|option| match option {
            SectionHeaderOption::Comment(comment) => Some(comment.to_string()),
            _ => None,
        });
    if let Some(comment) = comment {
        take(Item::Comment(&comment)).map_err(SourceError::Taken)?;
    }
    let mut interfaces: Vec<Interface> = Vec::new();
    while let Some(block) = reader.next_block() {
        match block.map_err(source_error)? {
            Block::SectionHeader(_) => interfaces.clear(),
            Block::InterfaceDescription(block) => interfaces.push(interface(&block)),
            Block::EnhancedPacket(packet) => {
                let interface = usize::try_from(packet.interface_id)
                    .ok()
                    .and_then(|id| interfaces.get(id));
                if let Some(interface) = interface.filter(|interface| interface.is_ours) {
                    pieces(&packet, interface, &mut take)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn source_error<E>(error: PcapError) -> SourceError<E> {
    match error {
        PcapError::IoError(error) if error.kind() != ErrorKind::UnexpectedEof => {
            SourceError::Read(error)
        }
        PcapError::IoError(_) | PcapError::IncompleteBuffer => {
            SourceError::Capture("the file ends inside a pcapng block".to_owned())
        }
        error => SourceError::Capture(error.to_string()),
    }
}

fn interface(block: &InterfaceDescriptionBlock<'_>) -> Interface {
    let mut interface = Interface {
        name: String::new(),
        is_ours: u32::from(block.linktype) == LINK_TYPE,
        resolution: 6,
    };
    for option in &block.options {
        match option {
            InterfaceDescriptionOption::IfName(name) => interface.name = name.to_string(),
            InterfaceDescriptionOption::IfTsResol(resolution) => {
                interface.resolution = *resolution;
            }
            _ => {}
        }
    }
    interface
}

/// Passes the frames in a packet to `take`. Captures of this project have one frame per packet.
fn pieces<E>(
    packet: &EnhancedPacketBlock<'_>,
    interface: &Interface,
    take: &mut impl FnMut(Item<'_>) -> Result<(), E>,
) -> Result<(), SourceError<E>> {
    let mut comment = "";
    let mut direction = Direction::Unknown;
    for option in &packet.options {
        match option {
            EnhancedPacketOption::Comment(said) => comment = said,
            EnhancedPacketOption::Flags(bits) => {
                direction = match bits & 3 {
                    1 => Direction::In,
                    2 => Direction::Out,
                    _ => Direction::Unknown,
                };
            }
            _ => {}
        }
    }
    // Bytes that were not captured count as part of the last frame.
    let missing = usize::try_from(packet.original_len)
        .unwrap_or(usize::MAX)
        .saturating_sub(packet.data.len());
    let at = time(packet.timestamp, interface.resolution);
    let mut one = |piece: Piece<'_>, missing: usize| {
        take(Item::Packet(Packet {
            at: Some(at),
            interface: &interface.name,
            direction,
            comment,
            wire: piece.bytes,
            len: piece.len + missing,
        }))
        .map_err(SourceError::Taken)
    };
    let mut cut = FrameSplitter::default();
    cut.push(&packet.data, |piece| one(piece, 0))?;
    match cut.rest() {
        Some(rest) => one(rest, missing),
        None => Ok(()),
    }
}

/// Converts the timestamp `read` of a packet to the time since 1970.
///
/// `resolution` is that of the packet's interface. The capture library, which returns `read`, ignores the resolution:
/// it assumes nanoseconds.
fn time(read: Duration, resolution: u8) -> Duration {
    let units = read.as_nanos();
    let exponent = u32::from(resolution & 0x7F);
    let nanoseconds = if resolution & 0x80 != 0 {
        (units * 1_000_000_000).checked_shr(exponent).unwrap_or(0)
    } else if exponent <= 9 {
        units * 10_u128.pow(9 - exponent)
    } else {
        10_u128
            .checked_pow(exponent - 9)
            .map_or(0, |per| units / per)
    };
    Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
}
