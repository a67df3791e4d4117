//! Bodies with one thing changed, and what a receiver makes of them.

use uav_relay::wire::frame::{self, FrameError, Header};
use uav_relay::wire::message::{MAX_BODY, Message, MessageError};

use super::codec::{Said, Swept, plain};
use super::stream_strategies::pad;

pub(crate) const HEADER: Header = Header {
    network: 7,
    sender: 1,
    destination: 2,
    counter: 3,
};

pub(crate) const ENCODING: Result<(), MessageError> = Err(MessageError::Encoding);
pub(crate) const VALUE: Result<(), MessageError> = Err(MessageError::Value);

/// Numbers that are none.
pub(crate) const STRANGE: [f32; 5] = [
    f32::NAN,
    -f32::NAN,
    f32::from_bits(0x7F80_0001),
    f32::INFINITY,
    f32::NEG_INFINITY,
];

/// What a receiver makes of a body in an intact frame; whatever it takes it writes as it was.
pub(crate) fn verdict_on(body: &[u8]) -> Result<(), MessageError> {
    match frame::decode(&plain(HEADER, body)) {
        Ok((_, message)) => {
            assert_eq!(written(&message), body);
            Ok(())
        }
        Err(FrameError::Message(error)) => Err(error),
        Err(other) => panic!("{other:?}: {body:x?}"),
    }
}

/// The body of a message.
pub(crate) fn written(message: &Message) -> Vec<u8> {
    let mut body = [0; MAX_BODY];
    let len = message.encode(&mut body).unwrap();
    body[..len].to_vec()
}

/// What a sweep for a single target says.
pub(crate) fn single(anchor: f32) -> Swept {
    Swept {
        number: 1,
        mission: 2,
        anchor,
        gap: 0,
        growth: 0,
        altitude_m: 20.0,
        power_w: 1.0,
        reaches: vec![100.0],
    }
}

/// Puts `number` at `at` of a body.
pub(crate) fn with(said: &Said, at: usize, number: f32) -> Vec<u8> {
    let mut body = said.body();
    body[at..at + 4].copy_from_slice(&number.to_le_bytes());
    body
}

/// Cuts a body off at its count, which is at `at`, and has so many zeros follow.
pub(crate) fn zeros(mut body: Vec<u8>, at: usize, count: u8) -> Vec<u8> {
    body.truncate(at);
    body.push(count);
    body.extend(vec![0; 4 * usize::from(count)]);
    body
}

/// A number is taken from the least to the most, and nothing beyond, whichever message it is in: the message, where the
/// number stands in its body, the range, and what it is.
pub(crate) fn assert_ranges(ranges: &[(&Said, usize, f32, f32, &str)]) {
    for &(said, at, least, most, what) in ranges {
        for good in [least, most] {
            assert_eq!(verdict_on(&with(said, at, good)), Ok(()), "{what} {good}");
        }
        let beyond = [least.next_down(), most.next_up()];
        for bad in beyond.into_iter().chain(STRANGE) {
            assert_eq!(verdict_on(&with(said, at, bad)), VALUE, "{what} {bad}");
        }
        for zero in [0.0, -0.0] {
            let fits = (least..=most).contains(&zero);
            let read = verdict_on(&with(said, at, zero));
            assert_eq!(read.is_ok(), fits, "{what} {zero}");
        }
    }
}

/// A body is refused when its tag, or its count where it `is_counted`, is a varint longer than need be.
pub(crate) fn assert_refused_padded(body: &[u8], is_counted: bool) {
    for tag in [true, false].into_iter().filter(|&tag| tag || is_counted) {
        for more in 0..9 {
            let mut padded = body.to_vec();
            pad(&mut padded, tag, more);
            assert_eq!(padded.len(), body.len() + 1 + more);
            assert_eq!(verdict_on(&padded), ENCODING, "{padded:x?}");
        }
    }
}

/// A body is taken as it is, and refused when it ends early or goes on for a byte.
pub(crate) fn assert_refused_cut_and_longer(body: &[u8], what: &str) {
    assert_eq!(verdict_on(body), Ok(()), "{what}");
    for len in 0..body.len() {
        assert_eq!(verdict_on(&body[..len]), ENCODING, "{len} of {what}");
    }
    for extra in 0..=u8::MAX {
        let longer = [body, &[extra]].concat();
        assert_eq!(verdict_on(&longer), ENCODING, "{extra} after {what}");
    }
}
