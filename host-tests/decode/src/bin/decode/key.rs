//! Reads the network key.

use std::path::Path;

const LENGTH: usize = 32;

pub(crate) fn load(file: &Path) -> Result<[u8; LENGTH], String> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| format!("--key {}: cannot be read: {error}", file.display()))?;
    parse(text.trim()).ok_or_else(|| {
        let what = "must be 64 hexadecimal digits and nothing else, as of `openssl rand -hex 32`";
        format!("--key {}: {what}", file.display())
    })
}

/// Returns the key at the end of a simulation's capture comment.
pub(crate) fn of_comment(comment: &str) -> Option<[u8; LENGTH]> {
    let (_, key) = comment.rsplit_once(", key ")?;
    parse(key)
}

fn parse(digits: &str) -> Option<[u8; LENGTH]> {
    if digits.len() != 2 * LENGTH || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let mut key = [0; LENGTH];
    for (byte, at) in key.iter_mut().zip((0..).step_by(2)) {
        *byte = u8::from_str_radix(digits.get(at..at + 2)?, 16).ok()?;
    }
    Some(key)
}
