//! Test vectors of the wire format, made by an independent Python program. Their file is
//! `host-tests/tests/data/vectors.json`.
//!
//! It encodes bodies by the byte tables (tags 0 and 2 also by the postcard implementation pohlednice 0.2.1), CRC bit by bit,
//! COBS by definition, and ladders with each step rounded. `FORMAT.md` describes the file.

use serde::{Deserialize, Deserializer, de::Error as _};

const FILE: &str = include_str!("../../tests/data/vectors.json");

/// Content of the file.
#[derive(Deserialize, Debug)]
pub struct Vectors {
    /// Valid frames.
    pub frames: Vec<Frame>,
    /// Handshakes and a message with tags, in order.
    pub signed: Vec<Signed>,
    /// Ladders.
    pub ladders: Vec<Ladder>,
    /// Streams that a receiver does not accept, or whose message has no effect.
    pub rejected: Vec<Rejected>,
}

/// A valid frame.
#[derive(Deserialize, Debug)]
pub struct Frame {
    /// Name of the vector.
    pub name: String,
    /// Addresses and counter.
    pub header: Header,
    /// Name of the message.
    pub message: String,
    /// Fields of the message, as of `cargo decode --json`.
    pub fields: serde_json::Value,
    /// Body.
    #[serde(deserialize_with = "hex")]
    pub body: Vec<u8>,
    /// Frame before COBS.
    #[serde(deserialize_with = "hex")]
    pub plain: Vec<u8>,
    /// Frame on the wire.
    #[serde(deserialize_with = "hex")]
    pub wire: Vec<u8>,
}

/// Header of a valid frame.
#[derive(Clone, Copy, Deserialize, Debug)]
pub struct Header {
    /// Network.
    pub network: u16,
    /// Node number of the sender.
    pub sender: u16,
    /// Node number of the destination.
    pub destination: u16,
    /// Counter.
    pub counter: u32,
}

/// A frame with a tag.
#[derive(Deserialize, Debug)]
pub struct Signed {
    /// Name of the vector.
    pub name: String,
    /// Nonces of the sender and of the receiver under which it is signed, in hexadecimal.
    pub nonces: [String; 2],
    /// Frame before COBS.
    #[serde(deserialize_with = "hex")]
    pub plain: Vec<u8>,
    /// Frame on the wire.
    #[serde(deserialize_with = "hex")]
    pub wire: Vec<u8>,
}

/// A ladder.
#[derive(Deserialize, Debug)]
pub struct Ladder {
    /// Bits of the anchor in hexadecimal.
    pub anchor: String,
    /// Gap code.
    pub gap: u8,
    /// Growth code.
    pub growth: u8,
    /// Bits of the targets in hexadecimal.
    pub targets: Vec<String>,
}

/// A stream that is not accepted.
#[derive(Deserialize, Debug)]
pub struct Rejected {
    /// Reason.
    pub what: String,
    /// Counters that it increments.
    pub counted: Vec<String>,
    /// Stream with its delimiter.
    #[serde(deserialize_with = "hex")]
    pub wire: Vec<u8>,
}

impl Vectors {
    /// Reads the file.
    ///
    /// # Errors
    /// The file is not as described; a test ensures that it is.
    pub fn load() -> Result<Self, serde_json::Error> {
        serde_json::from_str(FILE)
    }
}

/// Decodes hexadecimal digits; `None` for anything else.
pub fn bytes(digits: &str) -> Option<Vec<u8>> {
    let pairs = (0..digits.len()).step_by(2);
    pairs
        .map(|at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok())
        .collect()
}

fn hex<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<u8>, D::Error> {
    let digits = String::deserialize(from)?;
    bytes(&digits).ok_or_else(|| D::Error::custom(format!("no bytes: {digits}")))
}
