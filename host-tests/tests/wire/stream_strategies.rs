//! Random bodies and pieces of a stream: valid, damaged and noise.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay::wire::frame::Header;

use super::codec::{plain, sealed, wire};
use super::strategies::messages;

/// Draws a valid, nearly valid or invalid body.
pub(crate) fn bodies() -> BoxedStrategy<Vec<u8>> {
    let valid = || messages().prop_map(|said| said.body()).boxed();
    let replaced = (valid(), any::<proptest::sample::Index>(), any::<u8>()).prop_map(
        |(mut body, at, byte)| {
            let at = at.index(body.len());
            body[at] = byte;
            body
        },
    );
    let strange = proptest::sample::select(&[
        0.0,
        -0.0,
        -1.0,
        3e9,
        1e-40,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
    ]);
    let renumbered =
        (valid(), any::<proptest::sample::Index>(), strange).prop_map(|(mut body, at, number)| {
            let at = at.index(body.len());
            if let Some(place) = body.get_mut(at..at + 4) {
                place.copy_from_slice(&f32::to_le_bytes(number));
            }
            body
        });
    let cut = (valid(), any::<proptest::sample::Index>()).prop_map(|(mut body, at)| {
        body.truncate(at.index(body.len()));
        body
    });
    let longer = (valid(), vec(any::<u8>(), 1..4)).prop_map(|(body, more)| [body, more].concat());
    let recounted =
        (valid(), any::<proptest::sample::Index>(), 0..20_u8).prop_map(|(mut body, at, count)| {
            let at = at.index(body.len());
            body[at] = count;
            body
        });
    let padded = (valid(), any::<bool>(), 0..9_usize).prop_map(|(mut body, tag, more)| {
        pad(&mut body, tag, more);
        body
    });
    let tagged = (0..=19_u8, vec(any::<u8>(), 0..=120)).prop_map(|(tag, mut body)| {
        body.insert(0, tag);
        body
    });
    prop_oneof![
        2 => valid(),
        3 => replaced.boxed(),
        2 => renumbered.boxed(),
        2 => recounted.boxed(),
        1 => cut.boxed(),
        1 => longer.boxed(),
        1 => padded.boxed(),
        2 => tagged.boxed(),
        1 => vec(any::<u8>(), 0..=120).boxed(),
    ]
    .boxed()
}

/// Encodes a body's tag or count as a varint with `more` + 1 padding bytes.
pub(crate) fn pad(body: &mut Vec<u8>, tag: bool, more: usize) {
    let count = match body[0] {
        0 => 19,
        1 => 7 + usize::from(body[6]),
        4 | 5 => 23,
        6 | 7 => 7,
        _ => 0,
    };
    let at = if tag { 0 } else { count };
    body[at] |= 0x80;
    for _ in 0..more {
        body.insert(at + 1, 0x80);
    }
    body.insert(at + 1 + more, 0);
}

/// Draws pieces of a stream: valid, damaged and oversized frames, noise, delimiters.
pub(crate) fn pieces(heads: impl Strategy<Value = Header> + 'static) -> BoxedStrategy<Vec<u8>> {
    let heads = heads.boxed();
    let good = (heads.clone(), messages())
        .prop_map(|(head, said)| wire(&plain(head, &said.body())))
        .boxed();
    let sealed_body = (heads, bodies()).prop_map(|(head, body)| wire(&plain(head, &body)));
    let sealed_noise = vec(any::<u8>(), 0..=124).prop_map(|bytes| wire(&sealed(bytes)));
    let damaged = (good.clone(), any::<proptest::sample::Index>(), 0..8_u8).prop_map(
        |(mut frame, at, bit)| {
            let at = at.index(frame.len());
            frame[at] ^= 1 << bit;
            frame
        },
    );
    let cut = (
        good.clone(),
        any::<proptest::sample::Index>(),
        any::<bool>(),
    )
        .prop_map(|(mut frame, at, ended)| {
            frame.truncate(at.index(frame.len()));
            if ended {
                frame.push(0);
            }
            frame
        });
    let noise = vec(any::<u8>(), 0..300);
    let oversized = vec(1..=u8::MAX, 100..700).prop_map(|mut bytes| {
        bytes.push(0);
        bytes
    });
    prop_oneof![
        4 => good,
        2 => sealed_body.boxed(),
        1 => sealed_noise.boxed(),
        2 => damaged.boxed(),
        1 => cut.boxed(),
        1 => noise.boxed(),
        1 => oversized.boxed(),
        1 => vec(Just(0), 1..4).boxed(),
    ]
    .boxed()
}
