//! Interference level at an end of the chain, reported by the ground station.

use super::parts::{MessageError, Word, read, tag, write};
use crate::sensing::sums::is_level;

pub(super) fn encode(mission: u16, power_w: f32, buffer: &mut [u8]) -> Option<usize> {
    write(&(tag::LEVEL, Word::new(mission), power_w), buffer)
}

pub(super) fn decode(body: &[u8]) -> Result<(u16, f32), MessageError> {
    let (mission, power_w): (Word, f32) = read(body)?;
    if !is_level(power_w) {
        return Err(MessageError::Value);
    }
    Ok((mission.number(), power_w))
}
