//! A line that hurts frames.

use super::theirs::{by_the_crate, said};
use super::*;

const FRAMES: usize = 20_000;

/// One frame in five is hurt: a bit of it flips, bytes are missing, bytes come between.
fn hurt(rng: &mut ChaCha8Rng, frame: &mut Vec<u8>) {
    let at = rng.random_range(0..frame.len());
    match rng.random_range(0..4) {
        0 => frame[at] ^= 1 << rng.random_range(0..8),
        1 => drop(frame.drain(at..frame.len().min(at + rng.random_range(1..5)))),
        2 => drop(frame.splice(at..at, (0..rng.random_range(1..40)).map(|_| rng.random()))),
        // It looks as if it were long.
        _ => frame[1] = 255,
    }
}

#[test]
fn every_frame_that_is_whole_is_found_whatever_is_around_it() {
    let mut rng = rng(4);
    let (mut line, mut whole) = (Vec::new(), Vec::new());
    for number in 0..FRAMES {
        let (message, expected) = said(&mut rng);
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
    // What a false start waits for comes in the end.
    line.extend([0; 300]);
    let mut parser = Parser::new();
    let found: Vec<_> = parse(&mut parser, &line)
        .into_iter()
        .filter_map(|read| read.message)
        .collect();
    println!("{} of {FRAMES} whole, {} found", whole.len(), found.len());
    // In order, each that is whole; a frame may be hurt where nobody sees it, behind its end.
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

/// Frames inside the payload of another are bytes of that.
#[test]
fn what_is_carried_by_another_message_is_not_read() {
    let inner = by_the_crate(&said(&mut rng(5)).0, 1);
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

/// A message that the table has not, and one cut short by zeros at its end.
#[test]
fn an_unknown_message_costs_nothing_but_its_bytes() {
    let mut rng = rng(6);
    let unknown = mavlink::dialects::common::ATTITUDE_DATA {
        roll: rng.random(),
        pitch: rng.random(),
        ..mavlink::dialects::common::ATTITUDE_DATA::DEFAULT
    };
    let mut line = by_the_crate(&mavlink::dialects::common::MavMessage::ATTITUDE(unknown), 1);
    let (message, expected) = said(&mut rng);
    line.extend(by_the_crate(&message, 2));
    let mut parser = Parser::new();
    let read = parse(&mut parser, &line);
    assert_eq!(read.len(), 1);
    assert_eq!(read[0].message, Some(expected));
    assert_eq!(parser.counters().broken, 0);
}

/// The most work that was found: three long false starts in sixteen bytes, each of which costs a checksum of some 260 bytes.
#[test]
fn bytes_that_are_made_for_it_cost_a_checksum_for_five_of_them() {
    let made = [
        0xFD, 0xFF, 0, 0xFD, 0xFF, 0, 0xFD, 248, 0, 0, 11, 1, 0, 11, 1, 0,
    ];
    let line = made.repeat(1_000);
    let mut parser = Parser::new();
    assert!(parse(&mut parser, &line).is_empty());
    let checksums = parser.counters().broken as usize;
    println!("{checksums} checksums in {} bytes", line.len());
    assert!((line.len() / 6..=line.len() / 5).contains(&checksums));
    // And what follows is found.
    let (message, expected) = said(&mut rng(7));
    let after = [by_the_crate(&message, 1), vec![0; 300]].concat();
    let read = parse(&mut parser, &after);
    assert_eq!(read.last().unwrap().message, Some(expected));
}
