//! What proptest draws: messages in range with all their extremes, bodies that are nearly messages, headers, streams.
//!
//! Nested ones are boxed: by value their trees overflow the stack of a test's thread.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay::wire::frame::Header;

use super::codec::{Said, plain, sealed, targets, wire};

/// The largest node number.
const MAX_NODE: u16 = 4094;

pub(crate) fn headers() -> impl Strategy<Value = Header> {
    (any::<u16>(), 0..=MAX_NODE, 0..=MAX_NODE, any::<u32>()).prop_map(
        |(network, sender, destination, counter)| Header {
            network,
            sender,
            destination,
            counter,
        },
    )
}

fn metres(least: f32) -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => least.max(-1e6)..=1e6_f32,
        2 => least..=2e9_f32,
        1 => Just(least),
        1 => Just(2e9_f32),
        1 => Just(0.0),
        1 => Just(-0.0),
        1 => Just(f32::from_bits(1)),
    ]
}

/// Anchor, gap code and growth code of a valid ladder.
pub(crate) fn ladders() -> BoxedStrategy<(f32, u8, u8)> {
    let ordinary = (-20.0..20.0_f32).prop_map(f32::exp2);
    let any_normal = (0x0080_0000..0x7F80_0000_u32).prop_map(f32::from_bits);
    let anchors = prop_oneof![3 => ordinary, 1 => any_normal];
    let growths = prop_oneof![1 => Just(0), 3 => 0..32_u8, 1 => any::<u8>()];
    (anchors, any::<u8>(), growths)
        .prop_map(|(anchor, gap, growth)| (anchor, gap, if gap == 0 { 0 } else { growth }))
        .prop_filter("a ladder within the f32s", |&(anchor, gap, growth)| {
            let targets = targets(anchor, gap, growth);
            targets[0] >= f32::MIN_POSITIVE && targets[targets.len() - 1].is_finite()
        })
        .boxed()
}

/// A sweep in range, of `least` reaches at least and with as many targets as that takes.
pub(crate) fn sweeps(least: usize) -> BoxedStrategy<Said> {
    let ladders = prop_oneof![
        4 => ladders(),
        1 => (0.1..10.0_f32).prop_map(|anchor| (anchor, 0, 0)),
    ]
    .prop_filter("room for the reaches", move |&(_, gap, _)| {
        gap > 0 || least <= 1
    });
    let altitudes = prop_oneof![0.1..=1e5_f32, Just(0.1), Just(1e5)];
    let powers = prop_oneof![1e-6..=1e6_f32, Just(1e-6), Just(1e6)];
    let numbers = (any::<u16>(), any::<u16>());
    (
        numbers,
        ladders,
        altitudes,
        powers,
        vec(metres(0.0), least..=16),
    )
        .prop_map(
            |((number, mission), (anchor, gap, growth), altitude_m, power_w, mut reaches)| {
                if gap == 0 {
                    reaches.truncate(1);
                }
                Said::Sweep {
                    number,
                    mission,
                    anchor,
                    gap,
                    growth,
                    altitude_m,
                    power_w,
                    reaches,
                }
            },
        )
        .boxed()
}

/// A message in range.
pub(crate) fn messages() -> BoxedStrategy<Said> {
    let verdicts = (
        any::<u16>(),
        any::<u16>(),
        proptest::option::of(0..16_u8),
        vec(metres(-2e9), 0..=16),
    )
        .prop_map(|(number, mission, commit, slacks)| Said::Verdict {
            number,
            mission,
            commit,
            slacks,
        });
    prop_oneof![
        3 => sweeps(0),
        3 => verdicts,
        1 => any::<u16>().prop_map(|number| Said::Busy { number }),
        1 => (any::<u16>(), any::<bool>())
            .prop_map(|(mission, answer)| Said::Heartbeat { mission, answer }),
    ]
    .boxed()
}

/// Bytes that are a body, nearly one, or none.
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
            // Numbers begin at 5, 11, 15 and 20 in a sweep, at 7 or 8 in a verdict, and every four bytes from there.
            let starts = [5, 7, 8, 11, 15, 20, 24];
            let at = starts[at.index(starts.len())];
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
    let padded = (valid(), any::<bool>(), 0..9_usize).prop_map(|(mut body, tag, more)| {
        pad(&mut body, tag, more);
        body
    });
    let tagged = (0..6_u8, vec(any::<u8>(), 0..84)).prop_map(|(tag, mut body)| {
        body.insert(0, tag);
        body
    });
    prop_oneof![
        2 => valid(),
        3 => replaced.boxed(),
        2 => renumbered.boxed(),
        1 => cut.boxed(),
        1 => longer.boxed(),
        1 => padded.boxed(),
        2 => tagged.boxed(),
        1 => vec(any::<u8>(), 0..=84).boxed(),
    ]
    .boxed()
}

/// Writes the tag or the count of a body as a varint with one byte more, and another `more` on top.
pub(crate) fn pad(body: &mut Vec<u8>, tag: bool, more: usize) {
    let count = match (body[0], body.get(5)) {
        (0, _) => 19,
        (1, Some(commit)) => 6 + usize::from(*commit),
        _ => 0,
    };
    let at = if tag { 0 } else { count };
    body[at] |= 0x80;
    for _ in 0..more {
        body.insert(at + 1, 0x80);
    }
    body.insert(at + 1 + more, 0);
}

/// Pieces of a stream: good frames, damaged ones, noise, oversized ones, delimiters.
pub(crate) fn pieces(heads: impl Strategy<Value = Header> + 'static) -> BoxedStrategy<Vec<u8>> {
    let heads = heads.boxed();
    let good = (heads.clone(), messages())
        .prop_map(|(head, said)| wire(&plain(head, &said.body())))
        .boxed();
    let sealed_body = (heads, bodies()).prop_map(|(head, body)| wire(&plain(head, &body)));
    let sealed_noise = vec(any::<u8>(), 0..=94).prop_map(|bytes| wire(&sealed(bytes)));
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
    let noise = vec(any::<u8>(), 0..150);
    let oversized = vec(1..=u8::MAX, 90..400).prop_map(|mut bytes| {
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
