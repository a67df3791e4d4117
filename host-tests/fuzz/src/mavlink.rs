//! Fuzz target: arbitrary bytes from an autopilot, and arbitrary calls of its link.

mod link;
mod payload;
mod peer;
mod reference;
mod wire;

use uav_relay::flight::mavlink::incoming::{Counters, Parser, Received};

use super::heap::without_allocation;
use super::input::Input;
use reference::Reference;
use wire::{Placed, stream};

/// Fuzz target. Reads `data` as operations on an autopilot link, or as a stream of intact and damaged MAVLink frames.
///
/// # Panics
/// - The parser deviates from the definition of frames, misses an intact frame, or exceeds its bound on work.
/// - The link sends numbers that are not finite, targets far from the line, or targets that its state does not permit.
/// - The results of the link depend on how the received bytes are split, or the link allocates memory, or it requests
///   needless calls.
/// - A link with a key accepts unsigned or repeated frames, rejects other frames, or does not sign its frames with
///   rising timestamps.
pub fn mavlink(data: &[u8]) {
    let mut input = Input::new(data);
    match input.below(4) {
        1 => link::operate(&mut input, false),
        3 => link::operate(&mut input, true),
        _ => {
            let (bytes, placed) = stream(&mut input);
            frames_by_definition(&bytes, &placed);
        }
    }
}

fn parsed(bytes: &[u8]) -> (Vec<Received>, Counters) {
    let mut parser = Parser::new();
    let mut all = Vec::new();
    for &byte in bytes {
        parser.push(byte);
        while let Some(received) = without_allocation(|| parser.next_message()) {
            all.push(received);
        }
    }
    (all, parser.counters())
}

fn frames_by_definition(bytes: &[u8], placed: &[Placed]) {
    let reference = Reference::read(bytes);
    let (found, counters) = parsed(bytes);
    assert_eq!(found.len(), reference.frames.len());
    for (received, frame) in found.iter().zip(&reference.frames) {
        let from = (received.from.system, received.from.component);
        assert_eq!((received.id, from), (frame.id, frame.from));
        assert_eq!(received.is_signed, frame.is_signed);
    }
    let begun = reference.frames.len() + reference.broken;
    let counted = u64::from(counters.frames) + u64::from(counters.broken);
    assert_eq!(u64::try_from(begun), Ok(counted));
    assert!(
        3 * reference.checksums <= bytes.len() + 3,
        "{} checksums in {} bytes",
        reference.checksums,
        bytes.len()
    );
    for &Placed { at, .. } in placed {
        // An inserted frame must be found, unless it lies inside a different valid frame.
        let is_in = |frame: &reference::Frame| (frame.at..frame.end).contains(&at);
        assert!(reference.frames.iter().any(is_in), "lost at {at}");
    }
}
