//! What two neighbours tell each other about the fence between them, and why a relay may not get on.

use crate::place::CrossSection;

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
    /// Where the sender flies across the line, or is on its way to, m: both -1e7 to 1e7.
    pub across: CrossSection,
    /// From the owner: how far before the fence it stays, m along x, 0 to 1e5. Where that is less than the separation, the
    /// follower stays where it is across the line.
    pub apart_m: f32,
    /// What else it says: the sum of those of [`STILL`](Self::STILL) to [`UNPLACED`](Self::UNPLACED) that hold.
    pub flags: u8,
}

/// No place is farther than this from Tx, m.
const FARTHEST_M: f32 = 1e7;

impl Fence {
    /// The sender has arrived where it flies across the line.
    pub const STILL: u8 = 1;
    /// From the follower: it agrees to `apart_m` of the newest fence.
    pub const AGREES: u8 = 2;
    /// The sender, or a relay beyond it, has to move across the line and needs the separation along x for that.
    pub const OPENS: u8 = 4;
    /// The same as the sender has last heard it from the receiver.
    pub const ECHO_OPENS: u8 = 8;
    /// The sender has left this association: it does not fly to its setpoints any more, or did not for a time. Places and the number of
    /// the fence mean nothing.
    pub const RELEASED: u8 = 16;
    /// The sender, or a relay beyond it, is not in order with its neighbours: all relays stay where they are. It is told again every
    /// second, and holds in whichever association.
    pub const HALTS: u8 = 32;
    /// The place shows the order only, and grants nothing. From the follower: it is not in order with its neighbour downstream. With
    /// [`RELEASED`](Self::RELEASED): the sender is not flown, and `x_m` is the place reported last.
    pub const UNPLACED: u8 = 64;

    /// Returns a message that has no places and no flags.
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

    /// Whether its numbers are within their ranges.
    pub fn is_valid(&self) -> bool {
        let CrossSection { y_m, altitude_m } = self.across;
        let places = [self.x_m, self.target_m, y_m, altitude_m];
        self.association != 0
            && places.into_iter().all(is_place)
            && (0.0..=1e5).contains(&self.apart_m)
            && self.flags < 2 * Self::UNPLACED
    }
}

/// Reason that keeps a relay from the place agreed on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HoldReason {
    /// The neighbour has not agreed to a fence yet.
    Unheard,
    /// The neighbour is on the wrong side of this relay along the line, or too near along it to be certain: neither moves.
    Order,
    /// The two are to be closer along x than they may come yet, by where they are across the line.
    Close,
    /// A relay that fell silent may still hover there.
    Lost,
    /// The neighbour is not flown, and is in the way or has not made room.
    NotFlown,
    /// The neighbour has not made room, for five seconds or more.
    Pending,
    /// Another relay of the chain is not in order with its neighbours: all stay where they are.
    Halted,
}

/// Whether it is a number that may be a place along x, m; not so for NaN.
pub(super) fn is_place(x_m: f32) -> bool {
    x_m.abs() <= FARTHEST_M
}
