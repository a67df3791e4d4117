//! Golden vectors in both directions: `data/vectors.json`, from an independent Python program.
//!
//! It encodes bodies by the byte tables (tags 0 and 2 also by the postcard implementation pohlednice 0.2.1), CRC bit by bit,
//! COBS by definition, and ladders with each step rounded.

use serde::Deserialize;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::{MAX_BODY, Message};

use super::codec::{self, Said};

#[derive(Deserialize)]
pub(crate) struct Vectors {
    pub(crate) frames: Vec<Frame>,
    pub(crate) ladders: Vec<LadderVector>,
}

#[derive(Deserialize)]
pub(crate) struct Frame {
    pub(crate) name: String,
    header: Addresses,
    pub(crate) message: Said,
    pub(crate) body: String,
    plain: String,
    wire: String,
}

#[derive(Deserialize)]
struct Addresses {
    network: u16,
    sender: u16,
    destination: u16,
    counter: u32,
}

#[derive(Deserialize)]
pub(crate) struct LadderVector {
    anchor: String,
    gap: u8,
    growth: u8,
    pub(crate) targets: Vec<String>,
}

impl Frame {
    pub(crate) fn header(&self) -> Header {
        let Addresses {
            network,
            sender,
            destination,
            counter,
        } = self.header;
        Header {
            network,
            sender,
            destination,
            counter,
        }
    }

    pub(crate) fn plain(&self) -> Vec<u8> {
        bytes(&self.plain)
    }

    pub(crate) fn wire(&self) -> Vec<u8> {
        bytes(&self.wire)
    }
}

pub(crate) fn vectors() -> Vectors {
    let vectors: Vectors = serde_json::from_str(include_str!("../data/vectors.json")).unwrap();
    assert!(vectors.frames.len() >= 69 && vectors.ladders.len() >= 10);
    vectors
}

/// Decodes hexadecimal digits.
pub(crate) fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u32> = hex
        .chars()
        .filter(|digit| !digit.is_whitespace())
        .map(|digit| digit.to_digit(16).unwrap())
        .collect();
    assert_eq!(digits.len() % 2, 0, "{hex}");
    digits
        .chunks(2)
        .map(|pair| u8::try_from(pair[0] << 4 | pair[1]).unwrap())
        .collect()
}

pub(crate) fn only_frame(wire: &[u8]) -> Vec<u8> {
    let mut deframer = Deframer::new();
    let (end, before) = wire.split_last().unwrap();
    for &byte in before {
        assert!(deframer.push(byte).is_none());
    }
    deframer.push(*end).unwrap().unwrap().to_vec()
}

#[test]
fn the_vectors_follow_from_the_rules() {
    for vector in vectors().frames {
        let name = &vector.name;
        assert_eq!(vector.message.body(), bytes(&vector.body), "{name}");
        let plain = codec::plain(vector.header(), &bytes(&vector.body));
        assert_eq!(plain, vector.plain(), "{name}");
        assert_eq!(codec::wire(&plain), vector.wire(), "{name}");
    }
}

#[test]
fn the_crate_writes_the_vectors() {
    for vector in vectors().frames {
        let name = &vector.name;
        let message = vector.message.message();
        let mut body = [0; MAX_BODY];
        let len = message.encode(&mut body).unwrap();
        assert_eq!(body[..len], bytes(&vector.body), "{name}");
        let mut frame = [0xAA; MAX_FRAME];
        let len = frame::encode(vector.header(), &message, &mut frame);
        assert_eq!(frame[..len], vector.wire(), "{name}");
        assert!(frame[len..].iter().all(|&byte| byte == 0xAA), "{name}");
    }
}

#[test]
fn the_crate_reads_the_vectors() {
    for vector in vectors().frames {
        let name = &vector.name;
        let body = bytes(&vector.body);
        let message = Message::decode(&body).unwrap();
        assert_eq!(message, vector.message.message(), "{name}");
        let plain = only_frame(&vector.wire());
        assert_eq!(plain, vector.plain(), "{name}");
        assert_eq!(
            frame::decode(&plain),
            Ok((vector.header(), message)),
            "{name}"
        );
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
        let by_the_rules = codec::targets(anchor, vector.gap, vector.growth);
        assert_eq!(hex(&by_the_rules), vector.targets);
    }
}
