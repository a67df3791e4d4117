//! Messages and their fields, from the tables of `FORMAT.md`.

mod document;
mod rows;

const DOCUMENT: &str = include_str!("../../../../src/wire/FORMAT.md");

/// Type of a field on the wire.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Unsigned integer of one byte.
    U8,
    /// Unsigned integer of two bytes.
    U16,
    /// Unsigned integer of eight bytes.
    U64,
    /// Unsigned integer of four bytes.
    U32,
    /// Signed integer of three bytes, two's complement.
    I24,
    /// Signed integer of four bytes, two's complement.
    I32,
    /// Floating-point number of four bytes, IEEE 754 binary32.
    F32,
    /// Floating-point number of eight bytes, IEEE 754 binary64.
    F64,
    /// Boolean in one byte: 00 or 01.
    Bool,
    /// Digest (u16) of a mission, of a view, or of the line between the Tx and Rx positions.
    Digest,
    /// Name of a view (membership of the chain), u32: the view's number and its proposer's node number.
    View,
    /// Flags in one byte, with their names, lowest bit first.
    Flags(Vec<String>),
    /// Enumeration in one byte, with names for its values from 0 on.
    Words(Vec<String>),
    /// Fixed number of items of one type.
    Array(usize, Box<Kind>),
    /// Optional item: byte 00 for none, or byte 01 and the item.
    Option(Box<Kind>),
    /// List of items of one type: a varint count, then the items. The number in this variant is the maximum count.
    List(u64, Box<Kind>),
    /// Group of consecutive fields.
    Group(Vec<Field>),
}

impl Kind {
    /// Returns the size of this type, bytes; 0 if the size varies.
    pub const fn size(&self) -> usize {
        match self {
            Self::U8 | Self::Bool | Self::Flags(_) | Self::Words(_) => 1,
            Self::U16 | Self::Digest => 2,
            Self::I24 => 3,
            Self::U32 | Self::I32 | Self::F32 | Self::View => 4,
            Self::U64 | Self::F64 => 8,
            Self::Array(..) | Self::Option(_) | Self::List(..) | Self::Group(_) => 0,
        }
    }
}

/// Field of a message: one row of a table in `FORMAT.md`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Field {
    /// Name of the message field.
    pub name: String,
    /// Type of the message field on the wire.
    pub kind: Kind,
    /// Meaning of the message field, in words.
    pub meaning: String,
    /// Unit of the message field; empty if it has none.
    pub unit: String,
    /// Permitted range of the message field, in words.
    pub range: String,
}

/// Layout of a message's body after its first byte, the message tag (kind of message).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Layout {
    /// Name of the message.
    pub name: String,
    /// Fields of the message, in their order on the wire.
    pub fields: Vec<Field>,
}

/// Layouts of all messages and of the handshake.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Format {
    /// Layouts of the messages, by message tag.
    pub messages: Vec<Layout>,
    /// Layout of the authentication handshake's body.
    pub handshake: Layout,
}

impl Format {
    /// Reads the layouts from the tables of `FORMAT.md`.
    ///
    /// # Errors
    /// Names the row that cannot be parsed. Tests exclude that there is such a row.
    pub fn load() -> Result<Self, String> {
        document::read(DOCUMENT)
    }

    /// Returns the layout of the message with this tag; `None` for an unknown tag.
    pub fn message(&self, tag: u8) -> Option<&Layout> {
        self.messages.get(usize::from(tag))
    }
}

impl Field {
    /// Returns factor and base unit: (10, "s") for a unit of 0.1 s. `None` if the unit is a base unit, without a
    /// factor.
    pub fn scale(&self) -> Option<(f64, &str)> {
        let (number, base) = self.unit.split_once(' ')?;
        let multiple: f64 = number.parse().ok()?;
        Some(((1.0 / multiple).round(), base))
    }
}
