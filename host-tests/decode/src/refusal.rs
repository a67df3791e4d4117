//! Why a frame is no message.

use std::fmt;

/// Why a frame is refused: what a receiver would find first.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// The stream ends before the delimiter.
    Unended,
    /// More bytes than any frame has: on the wire so many.
    Oversized(usize),
    /// The delimiter comes inside a COBS run.
    Truncated,
    /// Too few bytes for header and CRC, or the tag: so many without COBS.
    Short(usize),
    /// The CRC that it has, and the one of its bytes.
    Crc(u32, u32),
    /// Another version of the format, or flags that this one does not have.
    Version(u8, u8),
    /// There is no message of this tag.
    UnknownTag(u8),
    /// The body is not the one encoding of any message.
    Malformed(String),
    /// A number is outside its range.
    Range,
}

impl Refusal {
    /// One word for it, for programs.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Unended => "unended",
            Self::Oversized(_) => "oversized",
            Self::Truncated => "truncated",
            Self::Short(_) => "short",
            Self::Crc(..) => "crc",
            Self::Version(..) => "version",
            Self::UnknownTag(_) => "unknown_tag",
            Self::Malformed(_) => "malformed",
            Self::Range => "range",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unended => f.write_str("it has no delimiter at its end"),
            Self::Oversized(len) => write!(f, "too long: {len} bytes, a frame has at most 137"),
            Self::Truncated => f.write_str("cut short: the delimiter comes inside a COBS run"),
            Self::Short(len) => write!(f, "too short: {len} bytes without COBS"),
            Self::Crc(has, is) => write!(f, "CRC {has:08x}, its bytes have {is:08x}"),
            Self::Version(version, flags) => {
                write!(
                    f,
                    "version {version} with flags {flags}: known is 1 with 0, 1 or 3"
                )
            }
            Self::UnknownTag(tag) => write!(f, "unknown tag {tag:02x}"),
            Self::Malformed(what) => write!(f, "malformed: {what}"),
            Self::Range => f.write_str("a number is outside its range"),
        }
    }
}
