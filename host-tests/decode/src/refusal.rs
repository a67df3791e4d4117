//! Reasons for rejecting a frame.

use std::fmt;

/// Reason for rejecting a frame: the first one that a receiver would find.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// The stream ends before the delimiter.
    Unended,
    /// The frame exceeds the largest length; with its length on the wire.
    Oversized(usize),
    /// The delimiter is inside a COBS run.
    Truncated,
    /// The frame is too short for header and CRC, or the tag; with its length without COBS.
    Short(usize),
    /// The CRC is wrong: the received and the computed one.
    Crc(u32, u32),
    /// The version of the format or its flags are unknown.
    Version(u8, u8),
    /// The tag of the message is unknown.
    UnknownTag(u8),
    /// The body is not the canonical encoding of any message.
    Malformed(String),
    /// A number is out of range.
    Range,
}

impl Refusal {
    /// Returns the reason as one word, for programs.
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
            Self::Oversized(len) => write!(f, "too long: {len} bytes, a frame has at most 145"),
            Self::Truncated => f.write_str("cut short: the delimiter comes inside a COBS run"),
            Self::Short(len) => write!(f, "too short: {len} bytes without COBS"),
            Self::Crc(has, is) => write!(f, "CRC {has:08x}, but its bytes give {is:08x}"),
            Self::Version(version, flags) => {
                write!(
                    f,
                    "version {version} with flags {flags}: must be 1 with 0, 1 or 3"
                )
            }
            Self::UnknownTag(tag) => write!(f, "unknown tag {tag:02x}"),
            Self::Malformed(what) => write!(f, "malformed: {what}"),
            Self::Range => f.write_str("a number is outside its range"),
        }
    }
}
