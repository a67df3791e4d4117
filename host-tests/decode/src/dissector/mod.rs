//! The tables for Wireshark: a dissector in Lua, of data that is written from them and an engine that reads it.

use crate::format::Format;

/// The dissector.
pub fn lua(_format: &Format) -> String {
    String::new()
}
