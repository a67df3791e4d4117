//! A frame as text and as JSON.

mod json;
mod text;

use std::fmt::Write as _;

use crate::frame::Frame;
use crate::source::Packet;
use crate::tags::TagCheck;

pub use json::json;
pub use text::text;

/// Decoded frame with its context, for output.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Number of the frame in its source, from 1.
    pub number: u64,
    /// Frame as captured, with its time and interface.
    pub packet: &'a Packet<'a>,
    /// Decoded frame that is shown.
    pub frame: &'a Frame<'a>,
    /// Result of the tag's verification, if the frame has a tag.
    pub tag: Option<TagCheck>,
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        _ = write!(text, "{byte:02x}");
        text
    })
}
