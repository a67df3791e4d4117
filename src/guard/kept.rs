//! The fence upstream, which the neighbour places.

use super::fence::{Fence, Hindrance};
use super::hull::Hull;
use super::tie::{Random, Tie, Wall};
use crate::side::Side;

/// A fence is newer than another one if its number is less than this ahead.
const AHEAD: u16 = 0x8000;

/// This relay's side of the fence toward Tx.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub(super) tie: Tie,
    pub(super) wall: Wall,
    /// Number of the newest fence heard of, 0 before the first.
    number: u16,
    /// Where it is, m.
    fence_m: f32,
    /// Where the neighbour is to be, m.
    target_m: f32,
    /// Whether this relay has cleared a fence.
    clear: bool,
    /// Whether the keeper was told that the newest fence has been cleared.
    told: bool,
}

impl Kept {
    pub(super) const fn new(node: u16, random: &mut Random) -> Self {
        Self {
            tie: Tie::new(node, random),
            wall: Wall::none(),
            number: 0,
            fence_m: f32::NEG_INFINITY,
            target_m: 0.0,
            clear: false,
            told: false,
        }
    }

    /// Another neighbour, 0 for none.
    pub(super) fn link(&mut self, node: u16, hull: &Hull, random: &mut Random) {
        self.renew(hull, random);
        self.tie.node = node;
    }

    /// Begins anew; where this relay may go because of the neighbour so far stays as a wall, and that is nowhere if it was
    /// never heard.
    fn renew(&mut self, hull: &Hull, random: &mut Random) {
        let mut wall = self.wall;
        if self.tie.node != 0 {
            // As far as this relay has come, not as far as it was asked to.
            let limit_m = self.least(hull).min(hull.at_m);
            wall.raise(Side::Upstream, self.tie.node, limit_m);
        }
        *self = Self {
            wall,
            ..Self::new(self.tie.node, random)
        };
    }

    pub(super) fn hear(&mut self, fence: &Fence, hull: &Hull, random: &mut Random) {
        if self.tie.heard == 0 {
            self.tie.heard = fence.tie;
        } else if fence.tie != self.tie.heard && self.tie.stray() {
            self.renew(hull, random);
            self.tie.heard = fence.tie;
        }
        // It is answered in any case: it may have been said again because an answer was lost.
        self.tie.due = true;
        if !self.tie.knows(fence.tie, fence.echo) {
            return;
        }
        self.target_m = fence.target_m;
        let ahead = fence.number.wrapping_sub(self.number);
        if fence.number != 0 && (self.number == 0 || (1..AHEAD).contains(&ahead)) {
            if self.number == 0 {
                self.wall.spoken(Side::Upstream, self.tie.node);
            }
            self.number = fence.number;
            self.fence_m = fence.x_m;
            self.told = false;
        }
    }

    /// How far back this relay may go, m; above where it is, it is asked to go there.
    #[inline(never)] // called from several places
    pub(super) fn least(&self, hull: &Hull) -> f32 {
        let granted = match (self.tie.node, self.number) {
            (0, _) => f32::NEG_INFINITY,
            (_, 0) => hull.at_m,
            _ => self.fence_m,
        };
        granted.max(self.wall.limit_m().unwrap_or(f32::NEG_INFINITY))
    }

    /// Whether the altitude is free as far as this side is concerned.
    pub(super) const fn is_clear(&self) -> bool {
        self.tie.node == 0 || self.clear
    }

    /// Whether a fence was heard of.
    pub(super) const fn is_agreed(&self) -> bool {
        self.number != 0
    }

    /// After a report: the keeper waits to hear that the newest fence has been cleared.
    pub(super) fn settle(&mut self, hull: &Hull) {
        if self.is_agreed() && hull.is_known() && hull.low_m >= self.fence_m {
            self.clear = true;
            self.tie.due |= !self.told;
        }
    }

    /// What there is to tell.
    pub(super) fn tell(&mut self, hull: &Hull, target_m: f32) -> Option<Fence> {
        if self.tie.node == 0 || !core::mem::take(&mut self.tie.due) {
            return None;
        }
        self.told = hull.low_m >= self.fence_m;
        Some(Fence {
            tie: self.tie.own,
            echo: self.tie.heard,
            number: self.number,
            x_m: hull.low_m,
            target_m,
        })
    }

    pub(super) fn hindrance(&self, target_m: f32, near: f32) -> Option<Hindrance> {
        if self.wall.limit_m().is_some_and(|limit| target_m < limit) {
            return Some(Hindrance::Lost);
        }
        if self.tie.node == 0 {
            return None;
        }
        if !self.is_agreed() {
            return Some(Hindrance::Unheard);
        }
        (target_m - self.target_m < near).then_some(Hindrance::Close)
    }
}
