//! A frame as text and as JSON.

mod json;
mod text;

use std::fmt::Write as _;

use crate::frame::Frame;
use crate::members::TagCheck;
use crate::source::Packet;

pub use json::json;
pub use text::text;

/// A frame, and all that is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Which one of its source, from 1.
    pub number: u64,
    /// As it came.
    pub packet: &'a Packet<'a>,
    /// What it says.
    pub frame: &'a Frame<'a>,
    /// What is known of its tag, if it has one.
    pub tag: Option<TagCheck>,
}

/// Bytes in hexadecimal.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        _ = write!(text, "{byte:02x}");
        text
    })
}
