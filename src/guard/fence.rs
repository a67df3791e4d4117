//! Fence message between two neighbours, and reasons for a hold.

use crate::place::CrossSection;

/// Message of a relay to a neighbour about the fence between them.
///
/// It is a state, not a step: it may be lost, duplicated, delayed or reordered.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fence {
    /// Number of the sender's association with this neighbour, never 0.
    pub association: u16,
    /// Last number received from the destination's association, 0 for none.
    pub echo: u16,
    /// Owner: number of the fence, 0 before the first. Follower: number of the newest fence received.
    pub number: u16,
    /// Owner: x of the fence. Follower: low end of its reachable interval. m, -1e7 to 1e7.
    pub x_m: f32,
    /// Agreed x of the sender, m, -1e7 to 1e7.
    pub target_m: f32,
    /// Position of the sender across the line, or its target there, m. Both coordinates are -1e7 to 1e7.
    pub across: CrossSection,
    /// Owner: requested step, its distance from the fence along x, m, 0 to 1e5. If it is less than the separation, the follower
    /// must not move across the line.
    pub apart_m: f32,
    /// Sum of the flags [`STILL`](Self::STILL) to [`UNPLACED`](Self::UNPLACED) that are set.
    pub flags: u8,
}

/// Maximum distance of a position from Tx, m.
const FARTHEST_M: f32 = 1e7;

impl Fence {
    /// Flag: the sender has arrived at its position across the line.
    pub const STILL: u8 = 1;
    /// Flag of the follower: it agrees to `apart_m` of the newest fence.
    pub const AGREES: u8 = 2;
    /// Flag: the sender, or a relay beyond it, has to move across the line. It needs the separation along x for that.
    pub const OPENS: u8 = 4;
    /// Flag: echo of the last [`OPENS`](Self::OPENS) received from the destination.
    pub const ECHO_OPENS: u8 = 8;
    /// Flag: the sender has left this association. It does not fly to its setpoints, or did not for a time. Positions and the
    /// number of the fence are not valid.
    pub const RELEASED: u8 = 16;
    /// Flag: the sender, or a relay beyond it, is not in order with its neighbours. All relays hold their positions. It is repeated
    /// every second, and valid in any association.
    pub const HALTS: u8 = 32;
    /// Flag: the position shows the order only, and grants nothing. Of the follower: it is not in order with its neighbour
    /// downstream. With [`RELEASED`](Self::RELEASED): the sender is not flown, and `x_m` is its last reported x.
    pub const UNPLACED: u8 = 64;

    pub(super) const fn without_place(association: u16, echo: u16) -> Self {
        Self {
            association,
            echo,
            number: 0,
            x_m: 0.0,
            target_m: 0.0,
            across: CrossSection::on_line(0.0),
            apart_m: 0.0,
            flags: 0,
        }
    }

    pub(super) const fn says(&self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// Returns true if all numbers are within their ranges.
    pub fn is_valid(&self) -> bool {
        let CrossSection { y_m, altitude_m } = self.across;
        let places = [self.x_m, self.target_m, y_m, altitude_m];
        self.association != 0
            && places.into_iter().all(is_place)
            && (0.0..=1e5).contains(&self.apart_m)
            && self.flags < 2 * Self::UNPLACED
    }
}

/// Reason that keeps a relay from its agreed position.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HoldReason {
    /// The neighbour has not agreed to a fence yet.
    Unheard,
    /// The neighbour is on the wrong side of this relay along the line, or too close for certainty. Neither moves.
    Order,
    /// The agreed distance along x is less than allowed, given the current positions across the line.
    Close,
    /// A lost relay may still hover there.
    Lost,
    /// The neighbour is not flown, and blocks the path or has not made room.
    NotFlown,
    /// The neighbour has not made room for at least five seconds.
    Pending,
    /// Another relay of the chain is not in order with its neighbours, so all relays hold their positions.
    Halted,
}

/// Returns true if `x_m` is a valid position along x, m; false for NaN.
pub(super) fn is_place(x_m: f32) -> bool {
    x_m.abs() <= FARTHEST_M
}
