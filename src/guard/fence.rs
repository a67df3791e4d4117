//! What two neighbours tell each other about the fence between them, and why a relay may not get on.

/// What a relay tells a neighbour about the fence between them. It is a state, not a step: it may be lost, come twice, late, or
/// in another order.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fence {
    /// Number of the sender's present talk with this neighbour, never 0.
    pub association: u16,
    /// The number of the receiver's as the sender has heard it, 0 for none.
    pub echo: u16,
    /// From the owner: number of the fence, 0 before the first. From the follower: of the newest fence it has heard of.
    pub number: u16,
    /// From the owner: where the fence is. From the follower: the low end of its own stretch. m along x, -1e7 to 1e7.
    pub x_m: f32,
    /// Where the sender is to be in the end, m along x, -1e7 to 1e7.
    pub target_m: f32,
}

/// No place is farther than this from Tx, m.
const FARTHEST_M: f32 = 1e7;

impl Fence {
    /// Whether its numbers are within their ranges.
    pub fn is_valid(&self) -> bool {
        self.association != 0 && is_place(self.x_m) && is_place(self.target_m)
    }
}

/// Why a relay may not get where it is to be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HoldReason {
    /// The neighbour has not agreed to a fence yet.
    Unheard,
    /// The neighbour stands on the wrong side of this relay: neither moves.
    Order,
    /// The two are to be closer along x than the separation.
    Close,
    /// A relay that fell silent may still hover there.
    Lost,
}

/// Whether it is a number that may be a place along x, m; not so for NaN.
pub(super) fn is_place(x_m: f32) -> bool {
    x_m.abs() <= FARTHEST_M
}
