//! Damaged frames on a line.

use super::theirs::{by_the_crate, random_message};
use super::*;

const FRAMES: usize = 20_000;

/// Damages a frame: flips a bit, removes or inserts bytes, or sets a wrong length.
fn hurt(rng: &mut ChaCha8Rng, frame: &mut Vec<u8>) {
    let at = rng.random_range(0..frame.len());
    match rng.random_range(0..4) {
        0 => frame[at] ^= 1 << rng.random_range(0..8),
        1 => drop(frame.drain(at..frame.len().min(at + rng.random_range(1..5)))),
        2 => drop(frame.splice(at..at, (0..rng.random_range(1..40)).map(|_| rng.random()))),
        // The length field is wrong.
        _ => frame[1] = 255,
    }
}

#[test]
fn every_complete_frame_is_found_in_noise() {
    let mut rng = rng(4);
    let (mut line, mut whole) = (Vec::new(), Vec::new());
    for number in 0..FRAMES {
        let (message, expected) = random_message(&mut rng);
        let mut frame = by_the_crate(&message, number as u8);
        if rng.random_bool(0.2) {
            hurt(&mut rng, &mut frame);
        } else {
            whole.push(expected);
        }
        line.extend(frame);
        if rng.random_bool(0.1) {
            line.extend((0..rng.random_range(0..20)).map(|_| rng.random::<u8>()));
        }
    }
    // The trailing bytes complete any false start.
    line.extend([0; 300]);
    let mut parser = Parser::new();
    let found: Vec<_> = parse(&mut parser, &line)
        .into_iter()
        .filter_map(|read| read.message)
        .collect();
    println!("{} of {FRAMES} whole, {} found", whole.len(), found.len());
    // All intact frames are found in order; damage behind a frame's end is harmless.
    let mut left = found.iter();
    for expected in &whole {
        assert!(
            left.any(|read| read == expected),
            "{expected:?} was not found"
        );
    }
    let extra = found.len() - whole.len();
    assert!(extra < FRAMES / 100, "{extra} more than were whole");
}

/// Checks that the parser does not read a frame in the payload of another frame.
#[test]
fn frames_nested_in_a_message_are_not_parsed() {
    let inner = by_the_crate(&random_message(&mut rng(5)).0, 1);
    let mut payload = [0; 128];
    payload[..inner.len()].copy_from_slice(&inner);
    let tunnel = mavlink::dialects::common::TUNNEL_DATA {
        payload_length: inner.len() as u8,
        payload,
        ..mavlink::dialects::common::TUNNEL_DATA::DEFAULT
    };
    let frame = by_the_crate(&mavlink::dialects::common::MavMessage::TUNNEL(tunnel), 2);
    let read = parse(&mut Parser::new(), &frame);
    assert_eq!(read.len(), 1);
    assert_eq!((read[0].id, read[0].message), (385, None));
}

/// Checks that an unknown message is skipped, and the message after it is read.
#[test]
fn an_unknown_message_costs_only_its_bytes() {
    let mut rng = rng(6);
    let unknown = mavlink::dialects::common::ATTITUDE_DATA {
        roll: rng.random(),
        pitch: rng.random(),
        ..mavlink::dialects::common::ATTITUDE_DATA::DEFAULT
    };
    let mut line = by_the_crate(&mavlink::dialects::common::MavMessage::ATTITUDE(unknown), 1);
    let (message, expected) = random_message(&mut rng);
    line.extend(by_the_crate(&message, 2));
    let mut parser = Parser::new();
    let read = parse(&mut parser, &line);
    assert_eq!(read.len(), 1);
    assert_eq!(read[0].message, Some(expected));
    assert_eq!(parser.counters().broken, 0);
}

/// Checks that the costliest known input causes only one checksum per five to six bytes.
///
/// Each 16 bytes of this input have three false frame starts, each of which costs a checksum over 260 bytes.
#[test]
fn adversarial_bytes_cost_one_checksum_per_five_bytes() {
    let made = [
        0xFD, 0xFF, 0, 0xFD, 0xFF, 0, 0xFD, 248, 0, 0, 11, 1, 0, 11, 1, 0,
    ];
    let line = made.repeat(1_000);
    let mut parser = Parser::new();
    assert!(parse(&mut parser, &line).is_empty());
    let checksums = parser.counters().broken as usize;
    println!("{checksums} checksums in {} bytes", line.len());
    assert!((line.len() / 6..=line.len() / 5).contains(&checksums));
    // The next frame is found.
    let (message, expected) = random_message(&mut rng(7));
    let after = [by_the_crate(&message, 1), vec![0; 300]].concat();
    let read = parse(&mut parser, &after);
    assert_eq!(read.last().unwrap().message, Some(expected));
}
