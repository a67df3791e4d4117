//! Tests that `tshark` with the dissector shows the same names and values as `cargo decode`.
//!
//! Without `tshark` these tests fail and say how to install it.
#![cfg(test)]
#![allow(clippy::float_cmp)]

mod drawn;
mod pdml;

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_capture::{Capture, Direction, Frame};
use uav_relay_decode::dissector;
use uav_relay_decode::format::Format;
use uav_relay_decode::frame;
use uav_relay_decode::refusal::Refusal;
use uav_relay_decode::vectors::Vectors;

const DISSECTOR: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../examples/wireshark/uav_relay.lua"
);

const EACH: usize = 200;

const HURT: usize = 2_000;

#[test]
fn the_dissector_is_generated_from_the_tables() {
    let written = dissector::lua(&Format::load().unwrap());
    assert!(
        std::fs::read_to_string(DISSECTOR).unwrap() == written,
        "it is old; type: cargo decode --dissector examples/wireshark/uav_relay.lua"
    );
}

fn dissected(frames: &[Vec<u8>]) -> Vec<pdml::Packet> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frames.pcapng");
    let out = std::fs::File::create(&file).unwrap();
    let mut capture = Capture::new(std::io::BufWriter::new(out), "a test", "").unwrap();
    let interface = capture.interface("drawn", "").unwrap();
    for (number, bytes) in (1..).zip(frames) {
        let frame = Frame {
            at: Duration::from_millis(number),
            bytes,
            len: bytes.len(),
            direction: Direction::Unknown,
            comment: "",
        };
        capture.frame(interface, &frame).unwrap();
    }
    capture.finish().unwrap();
    pdml::packets(&file, Path::new(DISSECTOR))
}

#[test]
fn tshark_and_cargo_decode_agree_on_random_frames() {
    let format = Format::load().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let frames: Vec<Vec<u8>> = (0..EACH * (format.messages.len() + 1))
        .map(|number| drawn::frame(&format, number / EACH, &mut rng))
        .collect();
    let packets = dissected(&frames);
    assert_eq!(packets.len(), frames.len());
    let mut named: BTreeMap<&str, usize> = BTreeMap::new();
    let mut fields = 0;
    for (bytes, packet) in frames.iter().zip(&packets) {
        let frame = frame::read(&format, bytes, bytes.len());
        assert!(
            matches!(frame.refusal, None | Some(Refusal::Range)),
            "{:?}",
            frame.refusal
        );
        let name = frame.name.unwrap();
        *named.entry(name).or_default() += 1;
        assert_eq!(packet.get("refused"), None, "{frame:?}");
        assert_eq!(packet.get("message"), Some(name));
        let header = frame.header.unwrap();
        for (field, value) in [
            ("sender", u64::from(header.sender)),
            ("destination", header.destination.into()),
            ("network", header.network.into()),
            ("counter", header.counter.into()),
        ] {
            assert_eq!(packet.get(field), Some(&*value.to_string()), "{field}");
        }
        let tag = frame.tag.as_ref().map(|(_, tag)| {
            let digits: Vec<String> = tag.iter().map(|byte| format!("{byte:02x}")).collect();
            digits.join(":")
        });
        assert_eq!(packet.get("tag"), tag.as_deref());
        let wanted = pdml::flat(&name.to_lowercase(), &frame.fields);
        let shown: Vec<&pdml::Shown> = packet.of(&name.to_lowercase()).collect();
        assert_eq!(wanted.len(), shown.len(), "{wanted:?} {shown:?}");
        for (wanted, shown) in wanted.iter().zip(shown) {
            wanted.is(shown);
            fields += 1;
        }
    }
    assert_eq!(named.len(), format.messages.len() + 1);
    assert!(named.values().all(|count| *count == EACH), "{named:?}");
    assert!(fields > 20 * EACH * 5, "{fields}");
    println!("{} frames, {fields} fields", frames.len());
}

fn rejected() -> Vec<Vec<u8>> {
    let vectors = Vectors::load().unwrap().rejected;
    assert!(vectors.len() > 150, "{}", vectors.len());
    vectors.into_iter().map(|vector| vector.wire).collect()
}

#[test]
fn tshark_and_cargo_decode_reject_for_the_same_reason() {
    let format = Format::load().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut frames: Vec<Vec<u8>> = (0..HURT)
        .map(|number| {
            let kind = number % (format.messages.len() + 1);
            let wire = drawn::frame(&format, kind, &mut rng);
            drawn::hurt(wire, &mut rng)
        })
        .collect();
    // These bodies are invalid: random bytes, with a valid CRC.
    frames.extend((0..HURT).map(|_| {
        let body: Vec<u8> = (0..rng.random_range(0..40)).map(|_| rng.random()).collect();
        drawn::around(&body, rng.random_range(0..4), &mut rng)
    }));
    // These frames have too few bytes for header and CRC.
    frames.extend((1..14).map(|len| [&[len + 1][..], &vec![7; len.into()], &[0]].concat()));
    frames.extend(rejected());
    let packets = dissected(&frames);
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    for (bytes, packet) in frames.iter().zip(&packets) {
        let whole = bytes.strip_suffix(&[0]);
        if whole.unwrap_or(bytes).contains(&0) || bytes == &[0] {
            // A packet has several pieces, and `cargo decode` shows each of them.
            continue;
        }
        let refusal = frame::read(&format, bytes, bytes.len()).refusal;
        let word = refusal.as_ref().map(Refusal::word);
        *reasons.entry(word.unwrap_or("none")).or_default() += 1;
        let wanted = word.filter(|word| *word != "range");
        assert_eq!(packet.get("refused"), wanted, "{bytes:02x?} {refusal:?}");
    }
    println!("{reasons:?}");
    for reason in [
        "unended",
        "oversized",
        "truncated",
        "short",
        "crc",
        "version",
        "unknown_tag",
        "malformed",
        "range",
    ] {
        assert!(
            reasons.get(reason).is_some_and(|count| *count > 5),
            "{reason}: {reasons:?}"
        );
    }
}
