//! Test vectors of the wire format, made by an independent Python program.
//!
//! Their file is `host-tests/tests/data/vectors.json`.
//!
//! The program encodes bodies by the byte tables, and tags 0 and 2 also with the postcard implementation pohlednice
//! 0.2.1. It computes CRCs bit by bit, COBS by definition, and lists of target SIRs step by step with rounding.
//! `FORMAT.md` describes the file.

use serde::{Deserialize, Deserializer, de::Error as _};

const FILE: &str = include_str!("../../tests/data/vectors.json");

/// Test vectors: the content of the file `vectors.json`.
#[derive(Deserialize, Debug)]
pub struct Vectors {
    /// Valid frames without a tag.
    pub frames: Vec<Frame>,
    /// Handshakes and a message, all with authentication tags, in the order of sending.
    pub signed: Vec<Signed>,
    /// Lists of target SIRs, with their compact form in a sweep message.
    pub ladders: Vec<Ladder>,
    /// Byte streams that a receiver rejects, or whose message has no effect.
    pub rejected: Vec<Rejected>,
}

/// Test vector: a valid frame.
#[derive(Deserialize, Debug)]
pub struct Frame {
    /// Name of the test vector.
    pub name: String,
    /// Header of the frame: addresses and counter.
    pub header: Header,
    /// Name of the message.
    pub message: String,
    /// Fields of the message, as `cargo decode --json` prints them.
    pub fields: serde_json::Value,
    /// Bytes of the message body.
    #[serde(deserialize_with = "hex")]
    pub body: Vec<u8>,
    /// Bytes of the frame before COBS.
    #[serde(deserialize_with = "hex")]
    pub plain: Vec<u8>,
    /// Bytes of the frame on the wire.
    #[serde(deserialize_with = "hex")]
    pub wire: Vec<u8>,
}

/// Header of a valid frame.
#[derive(Clone, Copy, Deserialize, Debug)]
pub struct Header {
    /// Number of the network in the frame's header.
    pub network: u16,
    /// Node number of the frame's sender.
    pub sender: u16,
    /// Node number of the frame's destination.
    pub destination: u16,
    /// Frame counter of the sender, as in the frame's header.
    pub counter: u32,
}

/// Test vector: a frame with an authentication tag.
#[derive(Deserialize, Debug)]
pub struct Signed {
    /// Name of the test vector.
    pub name: String,
    /// Nonces of sender and receiver that the tag covers, in hexadecimal.
    pub nonces: [String; 2],
    /// Bytes of the frame before COBS.
    #[serde(deserialize_with = "hex")]
    pub plain: Vec<u8>,
    /// Bytes of the frame on the wire.
    #[serde(deserialize_with = "hex")]
    pub wire: Vec<u8>,
}

/// Test vector: a list of target SIRs, and its compact form in a sweep message.
#[derive(Deserialize, Debug)]
pub struct Ladder {
    /// Target SIR with index 7 (from 0) of 16, or the single target. The text has the bits of its f32, hexadecimal.
    pub anchor: String,
    /// Code of the gap from the anchor to the next higher target SIR, as a ratio; 0 for a single target.
    pub gap: u8,
    /// Code of the factor from each gap to the next gap, which is farther from the anchor.
    pub growth: u8,
    /// Target SIRs: the bits of each f32, hexadecimal.
    pub targets: Vec<String>,
}

/// Test vector: a byte stream that is rejected or has no effect.
#[derive(Deserialize, Debug)]
pub struct Rejected {
    /// Reason why the stream is rejected or has no effect.
    pub what: String,
    /// Names of the receive counters that the stream increments.
    pub counted: Vec<String>,
    /// Bytes of the stream, with the delimiter.
    #[serde(deserialize_with = "hex")]
    pub wire: Vec<u8>,
}

impl Vectors {
    /// Reads the built-in test vectors.
    ///
    /// # Errors
    /// The file does not have this format. A test excludes this.
    pub fn load() -> Result<Self, serde_json::Error> {
        serde_json::from_str(FILE)
    }
}

/// Decodes hexadecimal digits to bytes; `None` for other characters.
pub fn bytes(digits: &str) -> Option<Vec<u8>> {
    let pairs = (0..digits.len()).step_by(2);
    pairs
        .map(|at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok())
        .collect()
}

fn hex<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<u8>, D::Error> {
    let digits = String::deserialize(from)?;
    bytes(&digits).ok_or_else(|| D::Error::custom(format!("not hexadecimal bytes: {digits}")))
}
