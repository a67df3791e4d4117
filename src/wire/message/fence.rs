//! Encoding of a [`Fence`] between two neighbours.

use super::parts::{MessageError, PassId, Word, read, tag, write};
use crate::guard::Fence;
use crate::place::CrossSection;

/// Encodes a fence; the number in the pass id is that of the association.
pub(super) fn encode(mission: u16, fence: &Fence, buffer: &mut [u8]) -> Option<usize> {
    let pass = PassId::new(fence.association, mission);
    let numbers = [fence.echo, fence.number].map(Word::new);
    let CrossSection { y_m, altitude_m } = fence.across;
    let places = [fence.x_m, fence.target_m, y_m, altitude_m, fence.apart_m];
    write(&(tag::FENCE, pass, numbers, places, fence.flags), buffer)
}

pub(super) fn decode(body: &[u8]) -> Result<(u16, Fence), MessageError> {
    type FenceBody = (PassId, [Word; 2], [f32; 5], u8);
    let (pass, [echo, number], places, flags): FenceBody = read(body)?;
    let [x_m, target_m, y_m, altitude_m, apart_m] = places;
    let fence = Fence {
        association: pass.number(),
        echo: echo.number(),
        number: number.number(),
        x_m,
        target_m,
        across: CrossSection { y_m, altitude_m },
        apart_m,
        flags,
    };
    if fence.is_valid() {
        Ok((pass.mission(), fence))
    } else {
        Err(MessageError::Value)
    }
}
