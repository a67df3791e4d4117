//! Which incarnation of the neighbour a message is from.
//!
//! Each side numbers its association with the other at random, and a message counts only if it bears the sender's number and echoes the
//! receiver's. The owner's number goes with the first number that echoes it; the follower takes a new number whenever it
//! takes up another of the owner's. So two numbers go together once, and what was said in an earlier one cannot count in a
//! later one, however late it comes.

use super::fence::Fence;
use super::own::Own;
use crate::jitter::Jitter;
use crate::place::CrossSection;
use crate::side::Side;

/// So many messages of another association in a row are of a new one, not late ones of an old.
const STRAYS: u8 = 3;

/// An association that this relay has left, until the neighbour has begun anew.
#[derive(Clone, Copy, Debug)]
struct Parting {
    own: u16,
    heard: u16,
    due: bool,
}

/// An association with the neighbour on one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Association {
    /// The neighbour, 0 for none.
    pub(super) node: u16,
    /// The number of this relay's association.
    pub(super) own: u16,
    /// The neighbour's, as it goes with `own`; 0 for none.
    pub(super) heard: u16,
    /// Messages of other associations in a row.
    strays: u8,
    /// Whether there is something to tell.
    pub(super) due: bool,
    /// Whether the neighbour passed on that the chain is to open, and whether it was last told so.
    pub(super) opens: bool,
    pub(super) told_open: bool,
    /// The neighbour's number of the association that it has left, 0 for none: it is counted as absent.
    absent: u16,
    /// What this relay still has to say of the one that it has left itself.
    parting: Option<Parting>,
}

impl Association {
    #[inline(never)] // called from several places
    pub(super) const fn new(node: u16, jitter: &mut Jitter) -> Self {
        Self {
            node,
            own: jitter.number(),
            heard: 0,
            strays: 0,
            due: true,
            opens: false,
            told_open: false,
            absent: 0,
            parting: None,
        }
    }

    /// Whether nobody is there that this relay could agree with: the chain ends, or the neighbour is not flown.
    pub(super) const fn is_none(&self) -> bool {
        self.node == 0 || self.is_absent()
    }

    /// Whether the neighbour is not flown.
    pub(super) const fn is_absent(&self) -> bool {
        self.absent != 0
    }

    /// The neighbour has left the association of that number, and may be anywhere.
    pub(super) const fn miss(&mut self, association: u16) {
        self.absent = association;
    }

    /// From now on the neighbour's number is that one: whoever was absent is back.
    pub(super) const fn meet(&mut self, association: u16) {
        self.heard = association;
        self.absent = 0;
    }

    /// Whether a message says that the neighbour has left this association. The number it echoes is not used after that, so what is said of it
    /// again is of an earlier one.
    pub(super) const fn is_left(&self, fence: &Fence) -> bool {
        fence.says(Fence::RELEASED) && fence.echo == self.own
    }

    /// Leaves it: the next one, which has to say so where the neighbour may count on this one.
    pub(super) fn leave(&self, jitter: &mut Jitter) -> Self {
        let left = Parting {
            own: self.own,
            heard: self.heard,
            due: true,
        };
        Self {
            parting: if self.heard == 0 {
                self.parting
            } else {
                Some(left)
            },
            ..Self::new(self.node, jitter)
        }
    }

    /// The next one, whatever was said in this one. What it has still to say of one that it left before it says.
    pub(super) fn renew(&self, jitter: &mut Jitter) -> Self {
        Self {
            parting: self.parting,
            ..Self::new(self.node, jitter)
        }
    }

    /// Whether a message is of an association that this relay, or the neighbour, has left. The neighbour is told again until it has begun
    /// anew.
    pub(super) fn is_over(&mut self, fence: &Fence) -> bool {
        if let Some(parting) = &mut self.parting {
            let left = fence.association == parting.heard;
            let is_new = fence.echo == 0 || fence.echo == self.own;
            if left && fence.says(Fence::RELEASED) || !left && is_new {
                self.parting = None;
            } else {
                // It still counts on that one, or on an earlier one.
                parting.heard = fence.association;
                parting.due = true;
            }
            if left || !is_new {
                return true;
            }
        }
        fence.association == self.absent
    }

    /// Whether the neighbour has still to be told that this relay has left; it is told again.
    pub(super) const fn remind(&mut self) -> bool {
        if let Some(parting) = &mut self.parting {
            parting.due = true;
        }
        self.parting.is_some()
    }

    /// What there is to tell of the association that this relay has left.
    pub(super) fn part(&mut self) -> Option<Fence> {
        let parting = self.parting.as_mut()?;
        core::mem::take(&mut parting.due).then_some(Fence {
            association: parting.own,
            echo: parting.heard,
            number: 0,
            x_m: 0.0,
            target_m: 0.0,
            across: CrossSection::on_line(0.0),
            apart_m: 0.0,
            flags: Fence::RELEASED,
        })
    }

    /// Whether a message is of this association.
    pub(super) const fn knows(&mut self, association: u16, echo: u16) -> bool {
        let known = association == self.heard && echo == self.own;
        if known {
            self.strays = 0;
        }
        known
    }

    /// A message of this association, but for what is of the fence.
    pub(super) fn fence(&self, own: &Own) -> Fence {
        Fence {
            association: self.own,
            echo: self.heard,
            number: 0,
            x_m: 0.0,
            target_m: own.target_m(),
            across: own.across(),
            apart_m: 0.0,
            flags: u8::from(own.still) * Fence::STILL
                + u8::from(self.told_open) * Fence::OPENS
                + u8::from(self.opens) * Fence::ECHO_OPENS,
        }
    }

    /// What a message of this association says of opening the chain; it is answered if the neighbour has not heard the last of that.
    pub(super) const fn hear_open(&mut self, fence: &Fence) {
        self.opens = fence.says(Fence::OPENS);
        self.due |= fence.says(Fence::ECHO_OPENS) != self.told_open;
    }

    /// This is passed on from now on.
    pub(super) const fn pass_open(&mut self, opens: bool) {
        self.due |= self.told_open != opens;
        self.told_open = opens;
    }

    /// One more message of another association; whether they are too many to be late ones.
    pub(super) const fn stray(&mut self) -> bool {
        self.strays = self.strays.saturating_add(1);
        self.strays >= STRAYS
    }
}

/// Where a relay that fell silent may still hover, as a limit of this relay's own x.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeepOut {
    /// Of the lost relays the nearest node, and the limit, m.
    lost: Option<(u16, f32)>,
    /// Where along x this relay may be no farther than the separation from it, and has not been beyond since, m: only where the two are
    /// across the line keeps them apart. Not a number where that is over.
    near_m: f32,
}

impl KeepOut {
    /// Nothing there.
    pub(super) const fn none() -> Self {
        Self {
            lost: None,
            near_m: f32::NAN,
        }
    }

    /// The limit, m.
    pub(super) fn limit_m(&self) -> Option<f32> {
        self.lost.map(|(_, limit_m)| limit_m)
    }

    /// One more relay, `node`, may hover so that this one may not go beyond `limit_m`; which node is nearer and which limit
    /// tighter depends on the side.
    #[inline(never)] // called from both sides
    pub(super) fn raise(&mut self, side: Side, node: u16, limit_m: f32) {
        let (nearest, tightest_m) = self.lost.unwrap_or((node, limit_m));
        self.lost = Some(match side {
            Side::Upstream => (nearest.max(node), tightest_m.max(limit_m)),
            Side::Downstream => (nearest.min(node), tightest_m.min(limit_m)),
        });
    }

    /// `node` speaks for itself: all that are lost are it, or beyond it.
    pub(super) fn spoken(&mut self, side: Side, node: u16) {
        let is_beyond = |lost: u16| match side {
            Side::Upstream => lost <= node,
            Side::Downstream => lost >= node,
        };
        if self.lost.is_some_and(|(lost, _)| is_beyond(lost)) {
            self.clear();
        }
    }

    /// The first setpoint is `x_m`: whoever was lost before was never heard, and may hover anywhere beyond, from `near_m` on the
    /// separation apart.
    pub(super) fn begin(&mut self, x_m: f32, near_m: f32) {
        if let Some((_, limit_m)) = &mut self.lost {
            *limit_m = x_m;
            self.near_m = near_m;
        }
    }

    /// The relay that was lost last was nearer than the separation, or may have been, unless this one is at `near_m` or beyond.
    pub(super) const fn near(&mut self, near_m: f32) {
        self.near_m = near_m;
    }

    /// Whether that may still be so.
    pub(super) const fn is_near(&self) -> bool {
        !self.near_m.is_nan()
    }

    /// This relay is somewhere now; `is_beyond` says whether that is beyond a limit.
    pub(super) fn part(&mut self, is_beyond: impl Fn(f32) -> bool) {
        if is_beyond(self.near_m) {
            self.near_m = f32::NAN;
        }
    }

    pub(super) const fn clear(&mut self) {
        *self = Self::none();
    }
}
