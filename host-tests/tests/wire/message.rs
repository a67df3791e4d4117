//! Messages by the tables of `FORMAT.md`: a body whose fields have the names of the tables. No code of the crate's codec.

use std::fmt;
use std::sync::LazyLock;

use serde_json::{Value as Json, json};
use uav_relay::wire::frame::Header;
use uav_relay::wire::message::MessageError;
use uav_relay_decode::envelope::{stuffed, unsigned, unstuffed};
use uav_relay_decode::format::Format;
use uav_relay_decode::refusal::Refusal;
use uav_relay_decode::value::{Fields, Value};
use uav_relay_decode::{walk, write};

/// Tables of messages and fields, read from `FORMAT.md`.
pub(crate) static FORMAT: LazyLock<Format> = LazyLock::new(|| Format::load().unwrap());

/// Valid message without the header and CRC of its frame. Its fields have the names in `FORMAT.md`.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct WireMessage(Vec<u8>);

impl fmt::Debug for WireMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name(), json!(self.fields()))
    }
}

/// Decodes and checks a message by the tables of `FORMAT.md`. The `body` is a frame without header and CRC. The error
/// is the reason for a refusal.
fn walked(body: &[u8]) -> Result<Fields<'static>, MessageError> {
    match walk::message(&FORMAT, body) {
        Ok((_, fields)) => Ok(fields),
        Err(Refusal::Range) => Err(MessageError::Value),
        Err(_) => Err(MessageError::Encoding),
    }
}

impl WireMessage {
    /// Creates the message `name`. Its `fields` are as `cargo decode --json` prints them.
    pub(crate) fn new(name: &str, fields: &Json) -> Self {
        let body = write::write(&FORMAT, name, fields);
        let message = Self(body.unwrap_or_else(|error| panic!("{error}: {name} {fields}")));
        assert_eq!(Self::verdict(&message.0), Ok(()), "{message:?}");
        message
    }

    pub(crate) fn read(body: &[u8]) -> Result<Self, MessageError> {
        walked(body).map(|_| Self(body.to_vec()))
    }

    /// Checks a message by the tables of `FORMAT.md`. The `body` is a frame without header and CRC. The error is the
    /// reason for a refusal.
    pub(crate) fn verdict(body: &[u8]) -> Result<(), MessageError> {
        walked(body).map(|_| ())
    }

    pub(crate) fn body(&self) -> &[u8] {
        &self.0
    }

    pub(crate) fn tag(&self) -> u8 {
        self.0[0]
    }

    pub(crate) fn name(&self) -> &'static str {
        &FORMAT.message(self.tag()).unwrap().name
    }

    pub(crate) fn is(&self, name: &str) -> bool {
        self.name() == name
    }

    pub(crate) fn fields(&self) -> Fields<'static> {
        walked(&self.0).unwrap()
    }

    /// Returns the value of the numeric field `name`; for `flags`, the bits.
    pub(crate) fn number(&self, name: &str) -> f64 {
        number(&self.fields(), name)
    }

    /// Returns true if all bits of `flags` are set in the message's flags.
    pub(crate) fn has(&self, flags: u8) -> bool {
        self.number("flags") as u8 & flags == flags
    }

    pub(crate) fn list(&self, name: &str) -> Vec<f32> {
        list(&self.fields(), name)
    }

    /// Returns the message with the fields in `changes` set to other values.
    pub(crate) fn with(&self, changes: Json) -> Self {
        let mut fields = json!(self.fields());
        let Json::Object(changes) = changes else {
            panic!("{changes}");
        };
        fields.as_object_mut().unwrap().extend(changes);
        Self::new(self.name(), &fields)
    }
}

/// Returns the value of the numeric field `name`.
pub(crate) fn number(fields: &Fields<'_>, name: &str) -> f64 {
    match fields.get(name) {
        Some(Value::Single(number)) => (*number).into(),
        Some(Value::Double(number)) => *number,
        Some(Value::Unsigned(number)) => *number as f64,
        Some(Value::Signed(number)) => *number as f64,
        Some(Value::Digest(number)) => (*number).into(),
        Some(Value::View(number)) => (*number).into(),
        Some(Value::Word(number, _) | Value::Flags(number, _)) => (*number).into(),
        Some(Value::Bool(value)) => f64::from(u8::from(*value)),
        other => panic!("{name}: {other:?}"),
    }
}

/// Returns the numbers of the field `name`, a list of f32.
pub(crate) fn list(fields: &Fields<'_>, name: &str) -> Vec<f32> {
    let Some(Value::List(values)) = fields.get(name) else {
        panic!("{name}: {fields:?}");
    };
    let single = |value: &Value<'_>| match value {
        Value::Single(number) => *number,
        other => panic!("{name}: {other:?}"),
    };
    values.iter().map(single).collect()
}

/// Encodes a body as a frame on the wire, with header, CRC and byte stuffing.
pub(crate) fn wire(head: Header, body: &[u8]) -> Vec<u8> {
    stuffed(&unsigned(head, body))
}

/// Returns the bytes of one complete frame on the wire without byte stuffing and delimiter.
pub(crate) fn plain_of(wire: &[u8]) -> Vec<u8> {
    let (end, stuffed) = wire.split_last().unwrap();
    let (plain, whole) = unstuffed(stuffed);
    assert!(*end == 0 && whole, "{wire:02x?}");
    plain
}
