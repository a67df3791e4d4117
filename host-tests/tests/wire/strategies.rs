//! Random messages by the workspace's generator, headers, nearly valid bodies, and pieces of a stream.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use uav_relay::wire::frame::Header;
use uav_relay_decode::draw::Draw;
use uav_relay_decode::envelope::{sealed, stuffed};
use uav_relay_decode::write::write_fields;

use super::message::{FORMAT, WireMessage, wire};

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

/// Draws valid messages of the kinds `names`. After a failure, proptest replaces values by 0 to find a simple message.
pub(crate) fn kinds(names: &'static [&'static str]) -> BoxedStrategy<WireMessage> {
    (proptest::sample::select(names), vec(any::<u8>(), 0..400))
        .prop_map(|(name, bytes)| {
            let mut messages = (0_u8..).zip(&FORMAT.messages);
            let (tag, layout) = messages.find(|(_, layout)| layout.name == name).unwrap();
            let mut bytes = bytes.into_iter();
            let mut source = || bytes.next().unwrap_or(0);
            let mut body = vec![tag];
            write_fields(&Draw::new(&mut source).valid(layout), &mut body);
            WireMessage::read(&body).unwrap_or_else(|error| panic!("{error}: {name} {body:02x?}"))
        })
        .boxed()
}

/// Draws valid messages of all kinds.
pub(crate) fn messages() -> BoxedStrategy<WireMessage> {
    let names = FORMAT.messages.iter().map(|layout| layout.name.as_str());
    kinds(names.collect::<Vec<_>>().leak())
}

/// Draws message bodies that are valid, nearly valid or invalid.
pub(crate) fn bodies() -> BoxedStrategy<Vec<u8>> {
    let valid = || messages().prop_map(|message| message.body().to_vec());
    let changed = || (valid(), any::<Index>());
    let replaced = (changed(), any::<u8>()).prop_map(|((mut body, at), byte)| {
        let at = at.index(body.len());
        body[at] = byte;
        body
    });
    let recounted = (changed(), 0..20_u8).prop_map(|((mut body, at), count)| {
        let at = at.index(body.len());
        body[at] = count;
        body
    });
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
    let renumbered = (changed(), strange).prop_map(|((mut body, at), number)| {
        let at = at.index(body.len());
        if let Some(place) = body.get_mut(at..at + 4) {
            place.copy_from_slice(&f32::to_le_bytes(number));
        }
        body
    });
    let cut = changed().prop_map(|(mut body, at)| {
        body.truncate(at.index(body.len()));
        body
    });
    let longer = (valid(), vec(any::<u8>(), 1..4)).prop_map(|(body, more)| [body, more].concat());
    // A byte as a varint with padding: the tag, a count, or another byte.
    let padded = (changed(), 0..9_usize).prop_map(|((mut body, at), more)| {
        let at = at.index(body.len());
        let rest = body.split_off(at);
        let padding = vec![0x80; more];
        [&body[..], &[rest[0] | 0x80], &padding, &[0], &rest[1..]].concat()
    });
    let tagged = (0..=21_u8, vec(any::<u8>(), 0..=120)).prop_map(|(tag, mut body)| {
        body.insert(0, tag);
        body
    });
    prop_oneof![
        2 => valid(),
        3 => replaced,
        2 => renumbered,
        2 => recounted,
        1 => cut,
        1 => longer,
        1 => padded,
        2 => tagged,
        1 => vec(any::<u8>(), 0..=120),
    ]
    .boxed()
}

/// Draws pieces of a byte stream: valid, damaged and oversized frames, noise, and delimiters.
pub(crate) fn pieces(heads: impl Strategy<Value = Header> + 'static) -> BoxedStrategy<Vec<u8>> {
    let heads = heads.boxed();
    let good = (heads.clone(), messages()).prop_map(|(head, message)| wire(head, message.body()));
    let good = good.boxed();
    let sealed_body = (heads, bodies()).prop_map(|(head, body)| wire(head, &body));
    let sealed_noise = vec(any::<u8>(), 0..=124).prop_map(|bytes| stuffed(&sealed(bytes)));
    let changed = || (good.clone(), any::<Index>());
    let damaged = (changed(), 0..8_u8).prop_map(|((mut frame, at), bit)| {
        let at = at.index(frame.len());
        frame[at] ^= 1 << bit;
        frame
    });
    let cut = (changed(), any::<bool>()).prop_map(|((mut frame, at), ended)| {
        frame.truncate(at.index(frame.len()));
        if ended {
            frame.push(0);
        }
        frame
    });
    let oversized = vec(1..=u8::MAX, 100..700).prop_map(|mut bytes| {
        bytes.push(0);
        bytes
    });
    prop_oneof![
        4 => good.clone(),
        2 => sealed_body,
        1 => sealed_noise,
        2 => damaged,
        1 => cut,
        1 => vec(any::<u8>(), 0..300),
        1 => oversized,
        1 => vec(Just(0), 1..4),
    ]
    .boxed()
}
