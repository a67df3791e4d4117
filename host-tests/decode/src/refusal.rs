//! Reasons for rejecting a frame.

use std::fmt;

/// Reason for rejecting a frame. If there are several, it is the first one that a receiver finds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// The stream ends before the frame's delimiter.
    Unended,
    /// The frame is too long. The value is its length on the wire, bytes.
    Oversized(usize),
    /// The frame was cut short: its delimiter is inside a COBS run (bytes after a code byte).
    Truncated,
    /// The frame is too short for header and CRC, or for the tag. The value is its length without COBS, bytes.
    Short(usize),
    /// The CRC is wrong. The values are the received and the computed CRC.
    Crc(u32, u32),
    /// The format version or the header flags are unknown. The values are version and flags of the frame.
    Version(u8, u8),
    /// The message tag (kind of message) is unknown.
    UnknownTag(u8),
    /// The body is not the canonical encoding of a message. The value names the fault.
    Malformed(String),
    /// A number in the message is out of range.
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
            Self::Unended => f.write_str("the delimiter at its end is missing"),
            Self::Oversized(len) => write!(f, "too long: {len} bytes, a frame has at most 149"),
            Self::Truncated => f.write_str("cut short: the delimiter is inside a COBS block"),
            Self::Short(len) => write!(f, "too short: {len} bytes after COBS decoding"),
            Self::Crc(has, is) => write!(
                f,
                "CRC mismatch: the frame has {has:08x}, its bytes give {is:08x}"
            ),
            Self::Version(version, flags) => {
                write!(
                    f,
                    "frame version {version} with flags {flags}: must be version 1 with flags 0, 1 or 3"
                )
            }
            Self::UnknownTag(tag) => write!(f, "unknown message type (tag {tag:02x})"),
            Self::Malformed(what) => write!(f, "malformed: {what}"),
            Self::Range => f.write_str("a number in the message is outside its range"),
        }
    }
}
