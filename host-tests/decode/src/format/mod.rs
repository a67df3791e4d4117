//! The tables of `FORMAT.md`: which messages there are, and the fields of each.

mod document;
mod rows;

/// The document itself.
const DOCUMENT: &str = include_str!("../../../../src/wire/FORMAT.md");

/// What a field is on the wire.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Kind {
    /// One byte.
    U8,
    /// Two bytes.
    U16,
    /// Eight bytes.
    U64,
    /// Four bytes.
    U32,
    /// Four bytes, two's complement.
    I32,
    /// binary32.
    F32,
    /// binary64.
    F64,
    /// One byte, 00 or 01.
    Bool,
    /// A u16 that stands for a mission, a view or a line.
    Digest,
    /// A u32: the number of a view and the node that has proposed it.
    View,
    /// One byte; the names of its bits, the lowest first.
    Flags(Vec<String>),
    /// One byte; the words for its values, from 0 on.
    Words(Vec<String>),
    /// So many of a kind.
    Array(usize, Box<Kind>),
    /// 00 for none; 01 and one of a kind.
    Option(Box<Kind>),
    /// How many, as a varint, at most so many; then these.
    List(u64, Box<Kind>),
    /// Some fields, one after the other.
    Group(Vec<Field>),
}

/// A row of a table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Field {
    /// What it is called.
    pub name: String,
    /// What it is on the wire.
    pub kind: Kind,
    /// What it says.
    pub meaning: String,
    /// Its unit; empty if it has none.
    pub unit: String,
    /// Which values are in range, in words.
    pub range: String,
}

/// What a body consists of, its first byte aside.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Layout {
    /// The name of the message.
    pub name: String,
    /// Its fields, in order.
    pub fields: Vec<Field>,
}

/// All messages, and the handshake.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Format {
    /// The messages, each at its tag.
    pub messages: Vec<Layout>,
    /// The handshake.
    pub handshake: Layout,
}

impl Format {
    /// The format as `FORMAT.md` has it.
    ///
    /// # Errors
    /// Names the row that cannot be read; a test sees to it that there is none.
    pub fn load() -> Result<Self, String> {
        document::read(DOCUMENT)
    }

    /// The message of this tag.
    pub fn message(&self, tag: u8) -> Option<&Layout> {
        self.messages.get(usize::from(tag))
    }
}

impl Field {
    /// Of a unit that is a multiple, such as 0.1 s: how many of the base unit it is (10 of them make one), and that.
    pub fn scale(&self) -> Option<(f64, &str)> {
        let (number, base) = self.unit.split_once(' ')?;
        let multiple: f64 = number.parse().ok()?;
        Some(((1.0 / multiple).round(), base))
    }
}
