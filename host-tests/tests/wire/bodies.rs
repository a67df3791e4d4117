//! Bodies with one change, and a receiver's verdict on them.

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

pub(crate) const STRANGE: [f32; 5] = [
    f32::NAN,
    -f32::NAN,
    f32::from_bits(0x7F80_0001),
    f32::INFINITY,
    f32::NEG_INFINITY,
];

/// Returns a receiver's verdict on a body; an accepted body must be encoded to the same bytes.
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

pub(crate) fn written(message: &Message) -> Vec<u8> {
    let mut body = [0; MAX_BODY];
    let len = message.encode(&mut body).unwrap();
    body[..len].to_vec()
}

/// Returns a sweep for a single target.
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

/// Writes `number` at offset `at` of a body.
pub(crate) fn with(said: &Said, at: usize, number: f32) -> Vec<u8> {
    let mut body = said.body();
    body[at..at + 4].copy_from_slice(&number.to_le_bytes());
    body
}

/// Truncates a body at its count, which is at `at`, and appends `count` zeros.
pub(crate) fn zeros(mut body: Vec<u8>, at: usize, count: u8) -> Vec<u8> {
    body.truncate(at);
    body.push(count);
    body.extend(vec![0; 4 * usize::from(count)]);
    body
}

/// Asserts that each message accepts a number's limits at an offset of its body, and nothing beyond.
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

/// Asserts that a body with a padded varint as its tag, or as its count if it `is_counted`, is refused.
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

/// Asserts that a body is accepted as it is, and refused if it is shorter or longer by a byte.
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
