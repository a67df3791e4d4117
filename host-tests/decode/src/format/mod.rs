//! Tables of `FORMAT.md`: the messages and their fields.

mod document;
mod rows;

const DOCUMENT: &str = include_str!("../../../../src/wire/FORMAT.md");

/// Type of a field on the wire.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Unsigned, one byte.
    U8,
    /// Unsigned, two bytes.
    U16,
    /// Unsigned, eight bytes.
    U64,
    /// Unsigned, four bytes.
    U32,
    /// Four bytes, two's complement.
    I32,
    /// IEEE 754 binary32.
    F32,
    /// IEEE 754 binary64.
    F64,
    /// Boolean in one byte, 00 or 01.
    Bool,
    /// A u16 digest of a mission, view or line.
    Digest,
    /// A u32: number of a view and its proposer.
    View,
    /// Flags in one byte, with the names of its bits, lowest first.
    Flags(Vec<String>),
    /// Enumeration in one byte, with the words for its values, from 0 on.
    Words(Vec<String>),
    /// A fixed number of items.
    Array(usize, Box<Kind>),
    /// 00 for none; 01 and an item.
    Option(Box<Kind>),
    /// List: a varint count, at most the given number, and the items.
    List(u64, Box<Kind>),
    /// Consecutive fields.
    Group(Vec<Field>),
}

impl Kind {
    /// Returns the bytes of a number; 0 for kinds of variable size.
    pub const fn size(&self) -> usize {
        match self {
            Self::U8 | Self::Bool | Self::Flags(_) | Self::Words(_) => 1,
            Self::U16 | Self::Digest => 2,
            Self::U32 | Self::I32 | Self::F32 | Self::View => 4,
            Self::U64 | Self::F64 => 8,
            Self::Array(..) | Self::Option(_) | Self::List(..) | Self::Group(_) => 0,
        }
    }
}

/// A field: a row of a table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Field {
    /// Name.
    pub name: String,
    /// Type on the wire.
    pub kind: Kind,
    /// Meaning.
    pub meaning: String,
    /// Unit; empty if none.
    pub unit: String,
    /// Valid range, in words.
    pub range: String,
}

/// Layout of a message body after its tag.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Layout {
    /// Name of the message.
    pub name: String,
    /// Fields in order.
    pub fields: Vec<Field>,
}

/// The messages and the handshake.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Format {
    /// Messages, indexed by tag.
    pub messages: Vec<Layout>,
    /// Handshake.
    pub handshake: Layout,
}

impl Format {
    /// Parses `FORMAT.md`.
    ///
    /// # Errors
    /// Names the row that cannot be parsed; a test ensures that there is none.
    pub fn load() -> Result<Self, String> {
        document::read(DOCUMENT)
    }

    /// Returns the message of this tag.
    pub fn message(&self, tag: u8) -> Option<&Layout> {
        self.messages.get(usize::from(tag))
    }
}

impl Field {
    /// Returns the factor and the base unit of a scaled unit: (10, "s") for 0.1 s.
    pub fn scale(&self) -> Option<(f64, &str)> {
        let (number, base) = self.unit.split_once(' ')?;
        let multiple: f64 = number.parse().ok()?;
        Some(((1.0 / multiple).round(), base))
    }
}
