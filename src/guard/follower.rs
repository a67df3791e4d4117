//! The fence upstream, which the neighbour places.

use super::association::{Association, KeepOut};
use super::fence::{Fence, HoldReason};
use super::own::Own;
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
    /// How far before it the neighbour asked to stay, m; infinite for the separation.
    asked_m: f32,
    /// What of that this relay has agreed to, m.
    taken_m: f32,
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
            asked_m: f32::INFINITY,
            taken_m: f32::INFINITY,
            target_m: 0.0,
            clear: false,
            told: false,
        }
    }

    /// Another neighbour, 0 for none.
    pub(super) fn link(&mut self, node: u16, own: &Own, jitter: &mut Jitter) {
        if self.is_out_of_order(own) {
            self.keep_out.disorder();
        }
        self.renew(own, jitter);
        self.association.node = node;
    }

    /// Begins anew; where this relay may go because of the neighbour so far stays as a keep_out, and that is nowhere if it was
    /// never heard.
    fn renew(&mut self, own: &Own, jitter: &mut Jitter) {
        let mut keep_out = self.keep_out;
        if !self.association.is_none() {
            // As far as this relay has come, not as far as it was asked to.
            let limit_m = self.least(own).min(own.reachable.at_m);
            let separation_m = own.config.separation_m;
            // What may be missing where the neighbour was allowed to come nearer than the separation, or was never heard.
            let missing_m = separation_m - self.asked_m.min(self.taken_m).min(separation_m);
            keep_out.raise(Side::Upstream, self.association.node, limit_m + missing_m);
            if missing_m > 0.0 {
                keep_out.near(limit_m + missing_m);
            } else if !self.is_agreed() {
                keep_out.near(limit_m + separation_m);
            } else if !self.clear {
                keep_out.near(self.fence_m);
            }
        }
        *self = Self {
            keep_out,
            ..Self::new(self.association.node, jitter)
        };
    }

    /// This relay is not flown any more: it begins anew, and tells the neighbour so. What it had to keep to says nothing of where it is from
    /// now on.
    pub(super) fn leave(&mut self, jitter: &mut Jitter) {
        *self = Self {
            keep_out: self.keep_out,
            association: self.association.leave(jitter),
            ..Self::new(self.association.node, jitter)
        };
    }

    /// Places are along another line: it begins anew, and what it knows of who is lost is that there is somebody.
    pub(super) fn leave_line(&mut self, jitter: &mut Jitter) {
        *self = Self {
            keep_out: self.keep_out.leave_line(),
            association: self.association.renew(jitter),
            ..Self::new(self.association.node, jitter)
        };
    }

    /// The neighbour is not flown any more: this relay stays where it is toward it. It is otherwise free if the two were known to be in
    /// order.
    fn release(&mut self, association: u16, own: &Own, jitter: &mut Jitter) {
        let (was_absent, is_ordered) = (self.association.is_absent(), self.is_ordered());
        self.renew(own, jitter);
        if !was_absent {
            let (node, at_m) = (self.association.node, own.reachable.at_m);
            self.keep_out.raise(Side::Upstream, node, at_m);
        }
        if is_ordered {
            self.association.miss(association);
        }
    }

    pub(super) fn hear(&mut self, fence: &Fence, own: &Own, jitter: &mut Jitter) {
        let is_placed = !fence.says(Fence::RELEASED) && fence.number != 0;
        self.association.hear_halt(fence, is_placed);
        self.keep_out.see(&self.association, fence);
        // With a number it is the place of a fence, which may be far from its owner.
        if fence.says(Fence::UNPLACED) || !fence.says(Fence::RELEASED) && fence.number == 0 {
            self.association.see(fence.x_m);
        }
        if self.association.is_over(fence) || fence.says(Fence::RELEASED) {
            if self.association.is_left(fence) {
                self.release(fence.association, own, jitter);
            }
            // A relay that is in no association needs no answer.
            self.association.due |= !fence.says(Fence::UNPLACED);
            return;
        }
        self.keep_out.flies();
        if self.association.heard == 0 {
            self.association.meet(fence.association);
        } else if fence.association != self.association.heard && self.association.stray() {
            self.renew(own, jitter);
            self.association.heard = fence.association;
        }
        // It is answered in any case: it may have been said again because an answer was lost.
        self.association.due = true;
        if !self.association.knows(fence.association, fence.echo) {
            return;
        }
        self.association.hear_open(fence);
        self.target_m = fence.target_m;
        let ahead = fence.number.wrapping_sub(self.number);
        if fence.number != 0 && (self.number == 0 || (1..AHEAD).contains(&ahead)) {
            if self.number == 0 {
                self.keep_out.spoken(Side::Upstream, self.association.node);
            }
            self.number = fence.number;
            self.fence_m = fence.x_m;
            self.asked_m = fence.apart_m;
            self.told = false;
        }
    }

    /// How far back this relay may go, m; above where it is, it is asked to go there.
    #[inline(never)] // called from several places
    pub(super) fn least(&self, own: &Own) -> f32 {
        let granted = match (self.association.is_none(), self.number) {
            (true, _) => f32::NEG_INFINITY,
            (false, 0) => own.reachable.at_m,
            (false, _) => self.fence_m,
        };
        granted.max(self.keep_out.limit_m().unwrap_or(f32::NEG_INFINITY))
    }

    /// Whether this relay may move across the line as far as this side is concerned.
    pub(super) fn is_clear(&self, own: &Own) -> bool {
        (self.association.is_none() || self.clear) && !self.is_held(own) && !self.keep_out.is_near()
    }

    /// Whether this relay has to stay where it is across the line, since that may keep the two apart.
    pub(super) fn is_held(&self, own: &Own) -> bool {
        self.asked_m < own.config.separation_m
    }

    /// Whether the neighbour may have been too near since it was switched on.
    pub(super) const fn is_tight(&self) -> bool {
        self.is_agreed() && !self.clear
    }

    /// Whether the two are to be closer along x than the separation.
    pub(super) fn is_close(&self, own: &Own) -> bool {
        self.is_agreed() && own.is_close(own.target_m() - self.target_m)
    }

    /// Agrees to what the neighbour asked, if with `downstream_m` on the other side its two neighbours stay the separation apart.
    pub(super) fn agree(&mut self, own: &Own, downstream_m: f32) {
        let missing_m = own.config.separation_m - self.asked_m;
        let enough = missing_m <= downstream_m + own.config.rounding();
        if self.asked_m >= self.taken_m || enough {
            self.taken_m = self.asked_m;
        }
    }

    /// How near the neighbour upstream may come at most, m, as far as the one downstream is concerned.
    pub(super) const fn taken_m(&self) -> f32 {
        if self.keep_out.is_near() || self.is_agreed() && !self.clear {
            0.0
        } else {
            self.taken_m
        }
    }

    /// Whether nobody is there, or whoever is has found this relay beyond it: before, it announces no fence.
    pub(super) const fn is_ordered(&self) -> bool {
        !self.keep_out.is_disordered() && (self.association.is_none() || self.is_agreed())
    }

    /// Returns true if the neighbour upstream has told that it is beyond this relay.
    pub(super) fn is_out_of_order(&self, own: &Own) -> bool {
        self.keep_out.is_disordered()
            || !self.is_ordered() && self.association.is_passed(own, Side::Upstream)
    }

    /// Whether a fence was heard of.
    pub(super) const fn is_agreed(&self) -> bool {
        self.number != 0
    }

    /// After a report: the owner waits to hear that the newest fence has been cleared.
    pub(super) fn settle(&mut self, own: &Own, low_m: f32) {
        if self.is_agreed() && own.reachable.is_known() {
            self.clear |= own.reachable.low_m >= self.fence_m;
            self.association.due |= low_m >= self.fence_m && !self.told;
        }
    }

    /// Returns the highest x at which the neighbour upstream may be, or any relay beyond it that is not the separation below it yet, m, until
    /// this relay has cleared the first fence: then all of them are below this relay.
    pub(super) fn high_m(&self, own: &Own) -> f32 {
        if self.is_agreed() && !self.clear {
            self.fence_m - self.asked_m.min(own.config.separation_m)
        } else {
            f32::NEG_INFINITY
        }
    }

    /// Returns the pending message, with `low_m` as the place that counts. A relay that is not `placed`, in order with its neighbour
    /// downstream, has one only for a request.
    pub(super) fn tell(&mut self, own: &Own, low_m: f32, placed: bool) -> Option<Fence> {
        let is_due = self.association.due && (placed || self.association.tells_halt());
        if self.association.node == 0 || !is_due {
            return None;
        }
        self.association.due = false;
        self.told = low_m >= self.fence_m;
        let mut fence = self.association.fence(own);
        (fence.number, fence.x_m) = (self.number, low_m);
        if !placed {
            fence.x_m = own.reachable.low_m;
            fence.flags |= Fence::UNPLACED;
        } else if self.taken_m <= self.asked_m {
            fence.flags |= Fence::AGREES;
        }
        Some(fence)
    }

    pub(super) fn hold_reason(&self, own: &Own) -> Option<HoldReason> {
        if self.keep_out.is_disordered() {
            return Some(HoldReason::Order);
        }
        let target_m = own.target_m();
        let limit = self.keep_out.limit_m();
        let stays = self.keep_out.is_near() && !own.is_across();
        let bars = self.keep_out.bars(own);
        if stays || bars || limit.is_some_and(|limit| target_m < limit) {
            return Some(
                self.keep_out
                    .reason(self.association.node, HoldReason::Lost),
            );
        }
        if self.association.is_none() {
            return None;
        }
        if self.is_out_of_order(own) {
            return Some(HoldReason::Order);
        }
        if !self.is_agreed() {
            return Some(HoldReason::Unheard);
        }
        let step_m = target_m - self.target_m + own.config.rounding();
        (step_m < self.taken_m.min(own.config.separation_m)).then_some(HoldReason::Close)
    }
}
