//! The fence between two neighbours, as [`Fence`] has it.

use serde::{Deserialize, Serialize};

use super::parts::PassId;
use crate::guard::Fence;

#[derive(Serialize, Deserialize)]
pub(super) struct FenceBody {
    /// The number is that of the association.
    pass: PassId,
    echo: [u8; 2],
    number: [u8; 2],
    x_m: f32,
    target_m: f32,
}

impl FenceBody {
    pub(super) const LENGTH: usize = 17;

    pub(super) const fn of(mission: u16, fence: &Fence) -> Self {
        Self {
            pass: PassId::new(fence.association, mission),
            echo: fence.echo.to_le_bytes(),
            number: fence.number.to_le_bytes(),
            x_m: fence.x_m,
            target_m: fence.target_m,
        }
    }

    /// The mission of the sender, and the fence.
    pub(super) fn checked(self) -> Option<(u16, Fence)> {
        let fence = Fence {
            association: self.pass.number(),
            echo: u16::from_le_bytes(self.echo),
            number: u16::from_le_bytes(self.number),
            x_m: self.x_m,
            target_m: self.target_m,
        };
        fence.is_valid().then_some((self.pass.mission(), fence))
    }
}
