//! The fence between two neighbours, as [`Fence`] has it.

use super::parts::{MessageError, PassId, read, write};
use super::tag;
use crate::guard::Fence;

/// The number beside the mission is that of the association.
pub(super) fn encode(mission: u16, fence: &Fence, buffer: &mut [u8]) -> Option<usize> {
    let pass = PassId::new(fence.association, mission);
    let numbers = [fence.echo.to_le_bytes(), fence.number.to_le_bytes()];
    write(
        &(tag::FENCE, pass, numbers, fence.x_m, fence.target_m),
        buffer,
    )
}

/// The mission of the sender, and the fence.
pub(super) fn decode(body: &[u8]) -> Result<(u16, Fence), MessageError> {
    let (pass, [echo, number], x_m, target_m): (PassId, [[u8; 2]; 2], f32, f32) = read(body)?;
    let fence = Fence {
        association: pass.number(),
        echo: u16::from_le_bytes(echo),
        number: u16::from_le_bytes(number),
        x_m,
        target_m,
    };
    if fence.is_valid() {
        Ok((pass.mission(), fence))
    } else {
        Err(MessageError::Value)
    }
}
