//! Splitting does not depend on the reads, and a capture returns the frames written to it.
#![cfg(test)]

use std::convert::Infallible;
use std::time::Duration;

use pcap_file::pcapng::blocks::enhanced_packet::EnhancedPacketOption;
use pcap_file::pcapng::{Block, PcapNgReader};
use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay_capture::{Capture, Direction, Frame, FrameSplitter, MOST};

/// Splits a byte stream that arrives in the portions `reads` into pieces.
///
/// Returns each piece with its length, and the length of the incomplete piece at the end of the stream.
fn pieces(reads: &[&[u8]]) -> (Vec<(Vec<u8>, usize)>, usize) {
    let (mut cut, mut all) = (FrameSplitter::default(), Vec::new());
    for read in reads {
        let taken: Result<(), Infallible> = cut.push(read, |piece| {
            all.push((piece.bytes.to_vec(), piece.len));
            Ok(())
        });
        taken.unwrap();
    }
    let rest = cut.rest().map_or(0, |rest| rest.len);
    (all, rest)
}

proptest! {
    #[test]
    fn pieces_do_not_depend_on_the_read_sizes(
        bytes in vec(prop_oneof![1 => Just(0_u8), 3 => any::<u8>()], 0..400),
        at in vec(0..400_usize, 0..6),
    ) {
        let mut at: Vec<usize> = at.into_iter().map(|at| at.min(bytes.len())).collect();
        at.extend([0, bytes.len()]);
        at.sort_unstable();
        let reads: Vec<&[u8]> = at.windows(2).map(|two| &bytes[two[0]..two[1]]).collect();
        let cut = pieces(&reads);
        prop_assert_eq!(&cut, &pieces(&[&bytes]));
        let mut wanted: Vec<Vec<u8>> = bytes.split_inclusive(|byte| *byte == 0).map(<[u8]>::to_vec).collect();
        let rest = wanted.pop_if(|piece| piece.last() != Some(&0)).map_or(0, |rest| rest.len());
        wanted.retain(|piece| piece.len() > 1);
        let got: Vec<Vec<u8>> = cut.0.into_iter().map(|(bytes, _)| bytes).collect();
        prop_assert_eq!((got, cut.1), (wanted, rest));
    }
}

#[test]
fn a_long_piece_is_cut_and_its_full_length_reported() {
    let mut noise = vec![7; 10 * MOST];
    noise.extend([0, 2, 9, 0]);
    let (pieces, rest) = pieces(&[&noise]);
    assert_eq!(pieces.len(), 2);
    assert_eq!((pieces[0].0.len(), pieces[0].1), (MOST, 10 * MOST + 1));
    assert_eq!((&*pieces[1].0, rest), (&[2, 9, 0][..], 0));
}

#[test]
fn a_capture_contains_every_written_frame() {
    let mut capture = Capture::new(Vec::new(), "a test", "of everything").unwrap();
    let ports = ["one", "two"].map(|name| capture.interface(name, "a port").unwrap());
    let ways = [Direction::In, Direction::Out, Direction::Unknown];
    for number in 0..6_u8 {
        let frame = Frame {
            at: Duration::from_micros(1_700_000_000_000_001 + u64::from(number)),
            bytes: &[3, 1, number + 1, 0],
            len: 4,
            direction: ways[usize::from(number) % 3],
            comment: if number == 4 { "the fifth" } else { "" },
        };
        capture
            .frame(ports[usize::from(number) % 2], &frame)
            .unwrap();
    }
    let bytes = capture.finish().unwrap();
    let mut reader = PcapNgReader::new(&*bytes).unwrap();
    let mut seen = 0_u8;
    while let Some(block) = reader.next_block() {
        let Block::EnhancedPacket(packet) = block.unwrap() else {
            continue;
        };
        let at = Duration::from_micros(1_700_000_000_000_001 + u64::from(seen));
        assert_eq!(packet.timestamp, at);
        assert_eq!(
            (packet.interface_id, packet.original_len),
            (u32::from(seen) % 2, 4)
        );
        assert_eq!(&*packet.data, [3, 1, seen + 1, 0]);
        let mut options = Vec::new();
        if seen % 3 < 2 {
            options.push(EnhancedPacketOption::Flags(u32::from(seen) % 3 + 1));
        }
        if seen == 4 {
            options.push(EnhancedPacketOption::Comment("the fifth".into()));
        }
        assert_eq!(packet.options, options);
        seen += 1;
    }
    assert_eq!(seen, 6);
    let names: Vec<u32> = reader
        .interfaces()
        .iter()
        .map(|it| it.linktype.into())
        .collect();
    assert_eq!(names, [147, 147]);
}
