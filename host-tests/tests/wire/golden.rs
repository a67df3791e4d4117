//! Golden vectors in both directions, by the crate and by the second codec.

use serde_json::Value;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::{MAX_BODY, Message};
use uav_relay_decode::envelope::{stuffed, unsigned};
use uav_relay_decode::vectors::Vectors;
use uav_relay_decode::{range, write};

use super::meaning::message;
use super::message::{FORMAT, WireMessage};

pub(crate) fn vectors() -> Vectors {
    let vectors = Vectors::load().unwrap();
    assert!(vectors.frames.len() >= 92 && vectors.ladders.len() >= 12);
    vectors
}

/// Encodes a message's body by the crate's codec.
pub(crate) fn written(message: &Message) -> Vec<u8> {
    let mut body = [0; MAX_BODY];
    let len = message.encode(&mut body).unwrap();
    body[..len].to_vec()
}

pub(crate) fn only_frame(wire: &[u8]) -> Vec<u8> {
    let mut deframer = Deframer::new();
    let (end, before) = wire.split_last().unwrap();
    for &byte in before {
        assert!(deframer.push(byte).is_none());
    }
    deframer.push(*end).unwrap().unwrap().to_vec()
}

/// Returns true if two JSON values are the same, however their numbers are written.
fn is_same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            a == b || a as f32 == b as f32
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            let same = |(name, a)| b.get(name).is_some_and(|b| is_same(a, b));
            a.len() == b.len() && a.iter().all(same)
        }
        _ => a == b,
    }
}

#[test]
fn both_codecs_write_and_read_the_vectors() {
    for vector in vectors().frames {
        let (name, body) = (&vector.name, &vector.body);
        let header = Header {
            network: vector.header.network,
            sender: vector.header.sender,
            destination: vector.header.destination,
            counter: vector.header.counter,
        };
        // The second codec.
        let by_the_tables = write::write(&FORMAT, &vector.message, &vector.fields);
        assert_eq!(by_the_tables.as_ref(), Ok(body), "{name}");
        let wire_message = WireMessage::read(body).unwrap();
        let shown = serde_json::to_value(wire_message.fields()).unwrap();
        assert!(is_same(&shown, &vector.fields), "{name}: {shown}");
        assert_eq!(unsigned(header, body), vector.plain, "{name}");
        assert_eq!(stuffed(&vector.plain), vector.wire, "{name}");
        // The crate.
        let message = message(&wire_message);
        assert_eq!(written(&message), *body, "{name}");
        let mut frame = [0xAA; MAX_FRAME];
        let len = frame::encode(header, &message, &mut frame);
        assert_eq!(frame[..len], vector.wire, "{name}");
        assert!(frame[len..].iter().all(|&byte| byte == 0xAA), "{name}");
        assert_eq!(Message::decode(body).as_ref(), Ok(&message), "{name}");
        let plain = only_frame(&vector.wire);
        assert_eq!(plain, vector.plain, "{name}");
        assert_eq!(frame::decode(&plain), Ok((header, message)), "{name}");
    }
}

#[test]
fn the_ladders_of_the_file_are_met_to_the_bit() {
    for vector in vectors().ladders {
        let anchor = f32::from_bits(u32::from_str_radix(&vector.anchor, 16).unwrap());
        let ladder = Ladder::from_parts(anchor, vector.gap, vector.growth).unwrap();
        let hex = |targets: &[f32]| -> Vec<String> {
            let bits = targets.iter().map(|target| target.to_bits());
            bits.map(|bits| format!("{bits:08x}")).collect()
        };
        assert_eq!(hex(&ladder.targets()), vector.targets);
        let by_the_rules = range::targets(anchor, vector.gap, vector.growth);
        assert_eq!(hex(&by_the_rules), vector.targets);
    }
}
