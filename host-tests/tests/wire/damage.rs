//! Damaged frames, before COBS and on the wire: none may be accepted.

use proptest::collection::{btree_set, vec};
use proptest::prelude::*;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{self, FrameError};
use uav_relay_decode::envelope::unsigned;

use super::config;
use super::golden::vectors;
use super::message::wire;
use super::strategies::{headers, messages};

/// Returns the number of frames that a receiver accepts from a stream.
fn accepted(stream: &[u8]) -> usize {
    let mut deframer = Deframer::new();
    stream
        .iter()
        .filter(
            |&&byte| matches!(deframer.push(byte), Some(Ok(plain)) if frame::decode(plain).is_ok()),
        )
        .count()
}

#[test]
fn every_flipped_bit_is_noticed() {
    for vector in vectors().frames {
        let (name, good) = (&vector.name, &vector.plain);
        for bit in 0..8 * good.len() {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(frame::decode(&bad), Err(FrameError::Crc), "{name}, {bit}");
        }
        // On the wire a flip may create, move or remove a delimiter; the frame is all but its last byte.
        let good = vector.wire;
        assert_eq!(accepted(&good), 1, "{name}");
        for bit in 0..8 * good.len() {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            bad.push(0);
            assert_eq!(accepted(&bad), 0, "{name}, {bit} on the wire");
        }
    }
}

#[test]
fn every_truncation_is_noticed() {
    for vector in vectors().frames {
        let (name, good) = (&vector.name, &vector.plain);
        for len in 0..good.len() {
            let error = if len < 14 {
                FrameError::Short
            } else {
                FrameError::Crc
            };
            assert_eq!(frame::decode(&good[..len]), Err(error), "{name}, {len}");
        }
        let good = vector.wire;
        for len in 0..good.len() - 1 {
            assert_eq!(accepted(&good[..len]), 0, "{name}, {len}");
            let ended = [&good[..len], &[0]].concat();
            assert_eq!(accepted(&ended), 0, "{name}, {len} ended");
        }
    }
}

proptest! {
    #![proptest_config(config(2000))]

    #[test]
    fn up_to_five_flipped_bits_are_always_noticed(
        message in messages(),
        head in headers(),
        flips in btree_set(any::<u16>(), 1..=5),
    ) {
        let mut bad = unsigned(head, message.body());
        let good = bad.clone();
        for flip in flips {
            let bit = usize::from(flip) % (8 * bad.len());
            bad[bit / 8] ^= 1 << (bit % 8);
        }
        if bad != good {
            prop_assert_eq!(frame::decode(&bad), Err(FrameError::Crc));
        }
    }

    #[test]
    fn a_burst_of_up_to_32_bits_is_always_noticed(
        message in messages(),
        head in headers(),
        start in any::<u16>(),
        burst in 1..=u32::MAX,
    ) {
        let mut bad = unsigned(head, message.body());
        let start = usize::from(start) % (8 * bad.len() - 31);
        for bit in (0..32).filter(|bit| burst >> bit & 1 == 1) {
            bad[(start + bit) / 8] ^= 1 << ((start + bit) % 8);
        }
        prop_assert_eq!(frame::decode(&bad), Err(FrameError::Crc));
    }

    #[test]
    fn damage_on_the_wire_is_noticed(
        message in messages(),
        head in headers(),
        damage in vec((any::<u16>(), 1..=u8::MAX), 1..=6),
    ) {
        let good = wire(head, message.body());
        let mut bad = good.clone();
        for (at, change) in damage {
            let at = usize::from(at) % (bad.len() - 1);
            bad[at] ^= change;
        }
        if bad != good {
            prop_assert_eq!(accepted(&bad), 0);
        }
    }
}
