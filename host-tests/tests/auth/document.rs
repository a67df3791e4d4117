//! Vectors of frames with a tag, byte by byte.

use host_tests::fixtures::{self, NETWORK, mission};
use host_tests::make;
use uav_relay::{Instant, Key, Port, Settings};
use uav_relay_decode::vectors::Vectors;

use super::frames::{Plain, SIGNED, handshake, nonce, plain};

fn key() -> [u8; 32] {
    std::array::from_fn(|byte| u8::try_from(byte).unwrap())
}

/// Returns the signed frame of the test vector `name`: decoded without its CRC, and as on the wire.
fn worked(name: &str) -> (Vec<u8>, Vec<u8>) {
    let mut signed = Vectors::load().unwrap().signed.into_iter();
    let mut vector = signed.find(|vector| vector.name == name).unwrap();
    vector.plain.truncate(vector.plain.len() - 4);
    (vector.plain, vector.wire)
}

#[test]
fn the_example_frames_follow_the_rules() {
    let (a, b) = (nonce(5, 1), nonce(9, 2));
    let mut heartbeat = Plain::new(NETWORK, 1, 2, SIGNED, 2);
    heartbeat.0.extend([3, 0x3C, 0x5A, 5, 0, 0, 0]);
    let frames = [
        (
            "a handshake",
            handshake((NETWORK, 1, 2), 0, [a, 0], true).signed(&key(), [a, 0]),
        ),
        (
            "its answer",
            handshake((NETWORK, 2, 1), 0, [b, a], true).signed(&key(), [b, a]),
        ),
        ("a heartbeat with a tag", heartbeat.signed(&key(), [a, b])),
    ];
    for (name, frame) in frames {
        let (table, wire) = worked(name);
        assert_eq!(table, frame.0, "{name}");
        assert_eq!(wire, frame.wire(), "{name}");
        assert_eq!(plain(&wire), frame, "{name}");
    }
}

/// Checks that a relay accepts the handshake of the documentation's example and computes the same tag.
///
/// The example is for relay 2 of 3 and its first nonce toward relay 1.
#[test]
fn the_example_handshake_is_accepted_with_equal_tags() {
    let settings = Settings {
        auth: Some(make::auth(key(), 9)),
        ..Settings::default()
    };
    let mut relay = fixtures::relay(mission(3), 2, settings);
    let (_, wire) = worked("a handshake");
    relay.handle_bytes(Instant::ZERO, Port::Upstream, &wire);
    assert_eq!(relay.stats().handshakes, 1);
    let (table, _) = worked("a heartbeat with a tag");
    let (signed, tag) = table.split_at(table.len() - 8);
    assert_eq!(Key::new(key()).tag(nonce(5, 1), nonce(9, 2), signed), tag);
}

#[test]
fn the_documents_lengths_are_those_of_the_crate() {
    let (table, wire) = worked("a handshake");
    assert_eq!((table.len(), wire.len()), (10 + 17 + 8, 41));
    assert_eq!(uav_relay::wire::frame::MAX_DECODED, 147);
    assert_eq!(uav_relay::MAX_FRAME, 149);
    assert_eq!(uav_relay::wire::auth::TAG, 8);
}
