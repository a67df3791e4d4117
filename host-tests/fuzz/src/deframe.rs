//! Fuzz target: a byte stream gives the same frames, however it is split into pieces.

use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::{MAX_DECODED, MAX_FRAME};
use uav_relay::{Identity, Instant, Port, Relay, Settings};
use uav_relay_decode::envelope::unstuffed;

use super::input::Input;
use super::setting;

/// Fuzz target. Reads `data` as two lengths and a byte stream.
///
/// A deframer receives the stream byte by byte. One relay receives the stream as a whole, and a second relay in pieces
/// of these lengths.
///
/// # Panics
/// The deframer deviates from the definition of COBS, returns a frame that is too long, or returns more bytes than it
/// has received. Or the states of the two relays differ after the stream.
pub fn deframe(data: &[u8]) {
    let mut input = Input::new(data);
    let lengths = input.word();
    let stream = input.rest();
    frames_by_definition(stream);
    cut(stream, lengths);
}

fn frames_by_definition(stream: &[u8]) {
    let mut deframer = Deframer::new();
    let mut chunk = Vec::with_capacity(stream.len());
    for &byte in stream {
        let outcome = deframer.push(byte);
        if byte != 0 {
            assert_eq!(outcome, None, "an end without a delimiter");
            chunk.push(byte);
            continue;
        }
        let (plain, whole) = unstuffed(&chunk);
        let expected = if chunk.is_empty() {
            None
        } else if plain.len() > MAX_DECODED {
            Some(Err(DeframeError::Oversized))
        } else if whole {
            Some(Ok(&*plain))
        } else {
            Some(Err(DeframeError::Truncated))
        };
        assert_eq!(outcome, expected, "{chunk:?}");
        if let Some(Ok(frame)) = outcome {
            assert!(frame.len() <= MAX_DECODED && frame.len() < chunk.len());
        }
        chunk.clear();
    }
}

/// Checks that a relay handles a stream in the same way in one piece and in many pieces.
///
/// The pieces have two alternating lengths of 1 to 256 bytes.
fn cut(stream: &[u8], lengths: u16) {
    let Some(mut whole) = relay() else { return };
    let mut pieces = whole.clone();
    whole.handle_bytes(Instant::ZERO, Port::Upstream, stream);
    let mut rest = stream;
    for len in lengths.to_le_bytes().into_iter().cycle() {
        let len = (usize::from(len) + 1).min(rest.len());
        let (piece, after) = rest.split_at_checked(len).unwrap_or((rest, &[]));
        pieces.handle_bytes(Instant::ZERO, Port::Upstream, piece);
        rest = after;
        if rest.is_empty() {
            break;
        }
    }
    assert_eq!(whole.stats(), pieces.stats());
    assert_eq!(whole.phase(), pieces.phase());
    assert_eq!(whole.setpoint(), pieces.setpoint());
    assert_eq!(whole.unpersisted(), pieces.unpersisted());
    whole.persist(|_| true);
    pieces.persist(|_| true);
    let mut buffers = ([0; MAX_FRAME], [0; MAX_FRAME]);
    loop {
        let one = whole.poll_transmit(Instant::ZERO, &mut buffers.0);
        let other = pieces.poll_transmit(Instant::ZERO, &mut buffers.1);
        assert_eq!((one, buffers.0), (other, buffers.1));
        if one.is_none() {
            return;
        }
    }
}

fn relay() -> Option<Relay> {
    let mission = setting::mission(&mut Input::new(&[0, 2]), 3)?;
    let identity = Identity {
        network: 7,
        index: 2,
    };
    Relay::new(mission, identity, Settings::default(), 1, Instant::ZERO).ok()
}
