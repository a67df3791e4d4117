//! The fence upstream, which the neighbour places.

use super::association::{Association, KeepOut};
use super::fence::{Fence, HoldReason};
use super::reachable::ReachableInterval;
use crate::jitter::Jitter;
use crate::side::Side;

/// A fence is newer than another one if its number is less than this ahead.
const AHEAD: u16 = 0x8000;

/// This relay's side of the fence toward Tx.
#[derive(Clone, Copy, Debug)]
pub(super) struct FenceFollower {
    pub(super) association: Association,
    pub(super) keep_out: KeepOut,
    /// Number of the newest fence heard of, 0 before the first.
    number: u16,
    /// Where it is, m.
    fence_m: f32,
    /// Where the neighbour is to be, m.
    target_m: f32,
    /// Whether this relay has cleared a fence.
    clear: bool,
    /// Whether the owner was told that the newest fence has been cleared.
    told: bool,
}

impl FenceFollower {
    pub(super) const fn new(node: u16, jitter: &mut Jitter) -> Self {
        Self {
            association: Association::new(node, jitter),
            keep_out: KeepOut::none(),
            number: 0,
            fence_m: f32::NEG_INFINITY,
            target_m: 0.0,
            clear: false,
            told: false,
        }
    }

    /// Another neighbour, 0 for none.
    pub(super) fn link(&mut self, node: u16, reachable: &ReachableInterval, jitter: &mut Jitter) {
        self.renew(reachable, jitter);
        self.association.node = node;
    }

    /// Begins anew; where this relay may go because of the neighbour so far stays as a keep_out, and that is nowhere if it was
    /// never heard.
    fn renew(&mut self, reachable: &ReachableInterval, jitter: &mut Jitter) {
        let mut keep_out = self.keep_out;
        if self.association.node != 0 {
            // As far as this relay has come, not as far as it was asked to.
            let limit_m = self.least(reachable).min(reachable.at_m);
            keep_out.raise(Side::Upstream, self.association.node, limit_m);
        }
        *self = Self {
            keep_out,
            ..Self::new(self.association.node, jitter)
        };
    }

    pub(super) fn hear(
        &mut self,
        fence: &Fence,
        reachable: &ReachableInterval,
        jitter: &mut Jitter,
    ) {
        if self.association.heard == 0 {
            self.association.heard = fence.association;
        } else if fence.association != self.association.heard && self.association.stray() {
            self.renew(reachable, jitter);
            self.association.heard = fence.association;
        }
        // It is answered in any case: it may have been said again because an answer was lost.
        self.association.due = true;
        if !self.association.knows(fence.association, fence.echo) {
            return;
        }
        self.target_m = fence.target_m;
        let ahead = fence.number.wrapping_sub(self.number);
        if fence.number != 0 && (self.number == 0 || (1..AHEAD).contains(&ahead)) {
            if self.number == 0 {
                self.keep_out.spoken(Side::Upstream, self.association.node);
            }
            self.number = fence.number;
            self.fence_m = fence.x_m;
            self.told = false;
        }
    }

    /// How far back this relay may go, m; above where it is, it is asked to go there.
    #[inline(never)] // called from several places
    pub(super) fn least(&self, reachable: &ReachableInterval) -> f32 {
        let granted = match (self.association.node, self.number) {
            (0, _) => f32::NEG_INFINITY,
            (_, 0) => reachable.at_m,
            _ => self.fence_m,
        };
        granted.max(self.keep_out.limit_m().unwrap_or(f32::NEG_INFINITY))
    }

    /// Whether the altitude is free as far as this side is concerned.
    pub(super) const fn is_clear(&self) -> bool {
        self.association.node == 0 || self.clear
    }

    /// Whether nobody is there, or whoever is has found this relay beyond it: before, it announces no fence.
    pub(super) const fn is_ordered(&self) -> bool {
        self.association.node == 0 || self.is_agreed()
    }

    /// Whether a fence was heard of.
    pub(super) const fn is_agreed(&self) -> bool {
        self.number != 0
    }

    /// After a report: the owner waits to hear that the newest fence has been cleared.
    pub(super) fn settle(&mut self, reachable: &ReachableInterval) {
        if self.is_agreed() && reachable.is_known() && reachable.low_m >= self.fence_m {
            self.clear = true;
            self.association.due |= !self.told;
        }
    }

    /// What there is to tell.
    pub(super) fn tell(&mut self, reachable: &ReachableInterval, target_m: f32) -> Option<Fence> {
        if self.association.node == 0 || !core::mem::take(&mut self.association.due) {
            return None;
        }
        self.told = reachable.low_m >= self.fence_m;
        Some(Fence {
            association: self.association.own,
            echo: self.association.heard,
            number: self.number,
            x_m: reachable.low_m,
            target_m,
        })
    }

    pub(super) fn hold_reason(&self, target_m: f32, near: f32) -> Option<HoldReason> {
        if self
            .keep_out
            .limit_m()
            .is_some_and(|limit| target_m < limit)
        {
            return Some(HoldReason::Lost);
        }
        if self.association.node == 0 {
            return None;
        }
        if !self.is_agreed() {
            return Some(HoldReason::Unheard);
        }
        (target_m - self.target_m < near).then_some(HoldReason::Close)
    }
}
