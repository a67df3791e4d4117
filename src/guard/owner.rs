//! The fence downstream, which this relay places.

use super::association::{Association, KeepOut};
use super::fence::{Fence, HoldReason};
use super::own::Own;
use crate::jitter::Jitter;
use crate::place::CrossSection;
use crate::side::Side;

/// This relay's side of the fence toward Rx.
#[derive(Clone, Copy, Debug)]
pub(super) struct FenceOwner {
    pub(super) association: Association,
    pub(super) keep_out: KeepOut,
    /// Number of the newest fence, 0 before the first.
    number: u16,
    /// Where it is, m; infinite before the first.
    fence_m: f32,
    /// How far before it this relay asked to stay, m; infinite for the separation.
    asked_m: f32,
    /// How far it does since the neighbour agreed, where nothing else asks for more.
    granted_m: f32,
    /// What the neighbour is counted on to stay at or beyond, m; without end before it has spoken.
    counted_m: f32,
    /// Where it is to be, m.
    target_m: f32,
    /// Where it flies across the line, and whether it has arrived there.
    across: CrossSection,
    still: bool,
    /// Whether it has heard of the newest fence.
    answered: bool,
    /// Whether it has cleared the first fence.
    clear: bool,
}

impl FenceOwner {
    pub(super) const fn new(node: u16, jitter: &mut Jitter) -> Self {
        Self {
            association: Association::new(node, jitter),
            keep_out: KeepOut::none(),
            number: 0,
            fence_m: f32::INFINITY,
            asked_m: f32::INFINITY,
            granted_m: f32::INFINITY,
            counted_m: f32::NEG_INFINITY,
            target_m: 0.0,
            across: CrossSection::on_line(0.0),
            still: false,
            answered: false,
            clear: false,
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
            let limit_m = self.most(own, own.config.separation_m);
            keep_out.raise(Side::Downstream, self.association.node, limit_m);
            if !self.is_ordered(own) {
                keep_out.near(limit_m - own.config.separation_m);
            } else if self.holds(own) || !self.clear {
                keep_out.near(limit_m);
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
        let (was_absent, is_ordered) = (self.association.is_absent(), self.is_ordered(own));
        self.renew(own, jitter);
        if !was_absent {
            let (node, at_m) = (self.association.node, own.reachable.at_m);
            self.keep_out.raise(Side::Downstream, node, at_m);
        }
        if is_ordered {
            self.association.miss(association);
        }
    }

    const fn is_heard(&self) -> bool {
        self.association.heard != 0
    }

    /// Whether nobody is there, or whoever is stands beyond this relay.
    pub(super) fn is_ordered(&self, own: &Own) -> bool {
        !self.keep_out.is_disordered()
            && (self.association.is_none() || self.is_heard() && self.is_beyond(own))
    }

    /// Returns true if the neighbour downstream has told that it is not beyond this relay, in this association or in none.
    pub(super) fn is_out_of_order(&self, own: &Own) -> bool {
        if self.keep_out.is_disordered() {
            true
        } else if self.is_heard() {
            !self.is_beyond(own) && self.counted_m > f32::NEG_INFINITY
        } else {
            !self.is_ordered(own) && self.association.is_passed(own, Side::Downstream)
        }
    }

    /// Returns true if the neighbour is known to be beyond this relay along x.
    ///
    /// Reported places are off by up to `hover_m` each. Before the first fence is cleared, two relays whose reports are nearer than
    /// that along x are in order only if they may pass each other: the separation apart across the line. A pair that has been in order may
    /// have moved by that error once more at each of the two since then, each time that one halts or is rebooted.
    fn is_beyond(&self, own: &Own) -> bool {
        let off_m = 2.0 * own.config.hover_m;
        let may_pass = own.config.least_step(own.across(), self.across) <= 0.0;
        let least_m = match (self.clear, may_pass) {
            (true, _) => -2.0 * off_m - own.config.rounding(),
            (false, true) => -off_m - own.config.rounding(),
            (false, false) => off_m,
        };
        self.counted_m - own.reachable.high_m >= least_m
    }

    /// Returns the lowest x at which this relay, or any relay beyond it that is not in order with it but for the error of the reports, may
    /// be, m.
    pub(super) fn low_m(&self, own: &Own) -> f32 {
        let low_m = own.reachable.low_m;
        let is_lower = self.counted_m < low_m - 2.0 * own.config.rounding();
        if !self.association.is_none() && self.is_heard() && is_lower {
            self.counted_m
        } else {
            low_m
        }
    }

    /// How far this relay stays from what the neighbour is counted on, m, where the follower has allowed the one upstream `taken_m`.
    pub(super) fn apart(&self, own: &Own, taken_m: f32) -> f32 {
        let separation_m = own.config.separation_m;
        self.granted_m.max(separation_m - taken_m).min(separation_m)
    }

    /// How far it is from the one downstream at least, m: nothing is known while one that is lost may be nearer than the separation, or
    /// before the first fence is cleared.
    pub(super) fn kept(&self, own: &Own, taken_m: f32) -> f32 {
        let is_open = self.association.is_none() || self.clear;
        if self.keep_out.is_near() || !is_open {
            0.0
        } else {
            self.apart(own, taken_m)
        }
    }

    /// Whether the places across the line have to stay, since they may keep the two apart.
    pub(super) fn holds(&self, own: &Own) -> bool {
        self.asked_m.min(self.granted_m) < own.config.separation_m
    }

    pub(super) fn hear(&mut self, fence: &Fence, own: &Own, jitter: &mut Jitter) {
        let is_placed = !fence.says(Fence::RELEASED) && !fence.says(Fence::UNPLACED);
        self.association.hear_halt(fence, is_placed);
        self.keep_out.see(&self.association, fence);
        if !fence.says(Fence::RELEASED) || fence.says(Fence::UNPLACED) {
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
        if !self.is_heard() && fence.echo == self.association.own {
            self.association.meet(fence.association);
            self.association.due = true;
            self.keep_out
                .spoken(Side::Downstream, self.association.node);
        }
        if !self.association.knows(fence.association, fence.echo) {
            if self.is_heard() && self.association.stray() {
                self.renew(own, jitter);
            }
            self.association.due |= self.association.is_absent();
            return;
        }
        self.association.hear_open(fence);
        if fence.says(Fence::UNPLACED) {
            return;
        }
        self.target_m = fence.target_m;
        (self.across, self.still) = (fence.across, fence.says(Fence::STILL));
        self.answered = fence.number == self.number;
        if self.answered {
            self.counted_m = self.counted_m.max(fence.x_m.min(self.fence_m));
            self.clear |= self.number != 0 && fence.x_m >= self.fence_m;
            if self.still && fence.says(Fence::AGREES) {
                let least_m = own.config.least_step(own.across(), fence.across);
                self.granted_m = self.granted_m.min(self.asked_m.max(least_m));
            }
        } else {
            self.association.due = true;
        }
    }

    /// How far this relay may go, m, if it is to stay `apart` from the neighbour.
    #[inline(never)] // called from several places
    pub(super) fn most(&self, own: &Own, apart: f32) -> f32 {
        let granted = match (self.association.is_none(), self.is_beyond(own)) {
            (true, _) => f32::INFINITY,
            (false, true) => self.counted_m - apart,
            (false, false) => own.reachable.at_m,
        };
        granted.min(self.keep_out.limit_m().unwrap_or(f32::INFINITY))
    }

    /// Whether this relay may move across the line as far as this side is concerned.
    pub(super) fn is_clear(&self, own: &Own) -> bool {
        (self.association.is_none() || self.clear) && !self.holds(own) && !self.keep_out.is_near()
    }

    /// Whether the neighbour may have been too near since it was switched on.
    pub(super) const fn is_tight(&self) -> bool {
        self.is_heard() && !self.clear
    }

    /// Whether the two are to be closer along x than the separation.
    pub(super) fn is_close(&self, own: &Own) -> bool {
        self.is_heard() && own.is_close(self.target_m - own.target_m())
    }

    /// Whether there is nothing that the neighbour still has to hear of, or to do.
    pub(super) fn is_agreed(&self) -> bool {
        self.clear && self.answered && self.counted_m >= self.fence_m
    }

    /// How far before the fence this relay would best stay, m: less than the separation only if both have arrived across the line and
    /// are to be that close.
    fn best_apart(&self, own: &Own) -> f32 {
        let separation_m = own.config.separation_m;
        let step_m = self.target_m - own.target_m();
        let settled = self.clear && self.still && own.still && own.is_across() && !own.open;
        if !(settled && own.is_close(step_m)) {
            return separation_m;
        }
        let least_m = own.config.least_step(own.across(), self.across);
        step_m.max(least_m).min(separation_m)
    }

    /// Where the fence may be best now, m, if there is to be one, and how far this relay would stay before it; and whether it is there
    /// for good.
    #[inline(never)] // called from several places
    fn wish(&self, own: &Own, taken_m: f32, upstream_m: f32) -> Option<(f32, f32, bool)> {
        if !self.is_heard() || !self.is_beyond(own) {
            return None;
        }
        let best = self.best_apart(own);
        // More than now only if it has come so far.
        let now_m = self.counted_m - own.reachable.high_m + own.config.rounding();
        let ask = if best > self.granted_m.max(now_m) {
            self.asked_m
        } else {
            best
        };
        let nearest = own.reachable.high_m + self.apart(own, taken_m).max(ask);
        if !self.clear {
            return Some((nearest.max(upstream_m + own.config.separation_m), ask, true));
        }
        let other_m = own.goal_of(self.association.node, self.target_m);
        let goal = 0.5 * (own.goal_m() + other_m + best);
        Some((goal.max(nearest), ask, goal >= nearest))
    }

    /// After the setpoint has moved: a fence that gets where it stays is told at once, what is under way only when reminded.
    pub(super) fn settle(&mut self, own: &Own, taken_m: f32, upstream_m: f32) {
        if let Some((x_m, ask, last)) = self.wish(own, taken_m, upstream_m) {
            let stays = last || own.reachable.is_still();
            self.association.due |= stays && self.is_other(own, x_m, ask);
        }
    }

    fn is_other(&self, own: &Own, x_m: f32, ask: f32) -> bool {
        let asked = self.asked_m.min(own.config.separation_m);
        self.number == 0 || (x_m - self.fence_m).abs() > 0.0 || (ask - asked).abs() > 0.0
    }

    /// What there is to tell. It is here that the fence moves, if it may: what nobody is told costs no number.
    pub(super) fn tell(
        &mut self,
        own: &Own,
        taken_m: f32,
        upstream_m: f32,
        moves: bool,
    ) -> Option<Fence> {
        if self.association.node == 0 || !core::mem::take(&mut self.association.due) {
            return None;
        }
        let wish = self.wish(own, taken_m, upstream_m);
        if let Some((x_m, ask, _)) =
            wish.filter(|(x_m, ask, _)| moves && self.is_other(own, *x_m, *ask))
        {
            self.number = match self.number.wrapping_add(1) {
                0 => 1,
                number => number,
            };
            self.fence_m = x_m;
            self.asked_m = ask;
            self.granted_m = self.granted_m.max(ask);
            self.answered = false;
            self.counted_m = self.counted_m.min(x_m);
        }
        let x_m = if self.number == 0 {
            own.reachable.high_m
        } else {
            self.fence_m
        };
        Some(Fence {
            number: self.number,
            x_m,
            apart_m: self.asked_m.min(own.config.separation_m),
            ..self.association.fence(own)
        })
    }

    pub(super) fn hold_reason(&self, own: &Own, taken_m: f32) -> Option<HoldReason> {
        if self.keep_out.is_disordered() {
            return Some(HoldReason::Order);
        }
        let target_m = own.target_m();
        let limit = self.keep_out.limit_m();
        let stays = self.keep_out.is_near() && !own.is_across();
        let bars = self.keep_out.bars(own);
        if stays || bars || limit.is_some_and(|limit| target_m > limit) {
            return Some(
                self.keep_out
                    .reason(self.association.node, HoldReason::Lost),
            );
        }
        if self.association.is_none() {
            return None;
        }
        if !self.is_heard() {
            return Some(HoldReason::Unheard);
        }
        if !self.is_beyond(own) {
            return Some(HoldReason::Order);
        }
        let step_m = self.target_m - target_m;
        let far = step_m + own.config.rounding() < self.apart(own, taken_m);
        far.then_some(HoldReason::Close)
    }
}
