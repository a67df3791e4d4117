//! The fence downstream, which this relay places.

use super::association::{Association, KeepOut};
use super::fence::{Fence, HoldReason};
use super::reachable::ReachableInterval;
use crate::jitter::Jitter;
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
    /// What the neighbour is counted on to stay at or beyond, m; without end before it has spoken.
    counted_m: f32,
    /// Where it is to be, m.
    target_m: f32,
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
            counted_m: f32::NEG_INFINITY,
            target_m: 0.0,
            answered: false,
            clear: false,
        }
    }

    /// Another neighbour, 0 for none.
    pub(super) fn link(
        &mut self,
        node: u16,
        reachable: &ReachableInterval,
        apart: f32,
        jitter: &mut Jitter,
    ) {
        self.renew(reachable, apart, jitter);
        self.association.node = node;
    }

    /// Begins anew; where this relay may go because of the neighbour so far stays as a keep_out, and that is nowhere if it was
    /// never heard.
    fn renew(&mut self, reachable: &ReachableInterval, apart: f32, jitter: &mut Jitter) {
        let mut keep_out = self.keep_out;
        if self.association.node != 0 {
            let limit_m = self.most(reachable, apart);
            keep_out.raise(Side::Downstream, self.association.node, limit_m);
        }
        *self = Self {
            keep_out,
            ..Self::new(self.association.node, jitter)
        };
    }

    const fn is_heard(&self) -> bool {
        self.association.heard != 0
    }

    /// Whether nobody is there, or whoever is stands beyond this relay.
    pub(super) fn is_ordered(&self, reachable: &ReachableInterval) -> bool {
        self.association.node == 0 || self.is_heard() && self.is_beyond(reachable)
    }

    /// Whether the neighbour is known to be beyond this relay.
    fn is_beyond(&self, reachable: &ReachableInterval) -> bool {
        self.counted_m >= reachable.high_m
    }

    pub(super) fn hear(
        &mut self,
        fence: &Fence,
        reachable: &ReachableInterval,
        apart: f32,
        jitter: &mut Jitter,
    ) {
        if !self.is_heard() && fence.echo == self.association.own {
            self.association.heard = fence.association;
            self.association.due = true;
            self.keep_out
                .spoken(Side::Downstream, self.association.node);
        }
        if !self.association.knows(fence.association, fence.echo) {
            if self.is_heard() && self.association.stray() {
                self.renew(reachable, apart, jitter);
            }
            return;
        }
        self.target_m = fence.target_m;
        self.answered = fence.number == self.number;
        if self.answered {
            self.counted_m = self.counted_m.max(fence.x_m.min(self.fence_m));
            self.clear |= self.number != 0 && fence.x_m >= self.fence_m;
        } else {
            self.association.due = true;
        }
    }

    /// How far this relay may go, m.
    #[inline(never)] // called from several places
    pub(super) fn most(&self, reachable: &ReachableInterval, apart: f32) -> f32 {
        let granted = match (self.association.node, self.is_beyond(reachable)) {
            (0, _) => f32::INFINITY,
            (_, true) => self.counted_m - apart,
            (_, false) => reachable.at_m,
        };
        granted.min(self.keep_out.limit_m().unwrap_or(f32::INFINITY))
    }

    /// Whether the altitude is free as far as this side is concerned.
    pub(super) const fn is_clear(&self) -> bool {
        self.association.node == 0 || self.clear
    }

    /// Whether there is nothing that the neighbour still has to hear of, or to do.
    pub(super) fn is_agreed(&self) -> bool {
        self.clear && self.answered && self.counted_m >= self.fence_m
    }

    /// Where the fence may be best now, m, if there is to be one, and whether it is there for good.
    #[inline(never)] // called from several places
    fn wish(
        &self,
        reachable: &ReachableInterval,
        target_m: f32,
        apart: f32,
    ) -> Option<(f32, bool)> {
        if !self.is_heard() || !self.is_beyond(reachable) {
            return None;
        }
        let nearest = reachable.high_m + apart;
        if !self.clear {
            return Some((nearest, true));
        }
        let goal = 0.5 * (target_m + self.target_m + apart);
        Some((goal.max(nearest), goal >= nearest))
    }

    /// After the setpoint has moved: a fence that gets where it stays is told at once, what is under way only when reminded.
    pub(super) fn settle(&mut self, reachable: &ReachableInterval, target_m: f32, apart: f32) {
        if let Some((x_m, last)) = self.wish(reachable, target_m, apart) {
            let stays = last || reachable.is_still();
            self.association.due |= stays && self.is_elsewhere(x_m);
        }
    }

    fn is_elsewhere(&self, x_m: f32) -> bool {
        self.number == 0 || (x_m - self.fence_m).abs() > 0.0
    }

    /// What there is to tell. It is here that the fence moves, if it may: what nobody is told costs no number.
    pub(super) fn tell(
        &mut self,
        reachable: &ReachableInterval,
        target_m: f32,
        apart: f32,
        moves: bool,
    ) -> Option<Fence> {
        if self.association.node == 0 || !core::mem::take(&mut self.association.due) {
            return None;
        }
        let wish = self.wish(reachable, target_m, apart);
        if let Some((x_m, _)) = wish.filter(|(x_m, _)| moves && self.is_elsewhere(*x_m)) {
            self.number = match self.number.wrapping_add(1) {
                0 => 1,
                number => number,
            };
            self.fence_m = x_m;
            self.answered = false;
            self.counted_m = self.counted_m.min(x_m);
        }
        Some(Fence {
            association: self.association.own,
            echo: self.association.heard,
            number: self.number,
            x_m: if self.number == 0 {
                reachable.high_m
            } else {
                self.fence_m
            },
            target_m,
        })
    }

    pub(super) fn hold_reason(
        &self,
        reachable: &ReachableInterval,
        target_m: f32,
        near: f32,
    ) -> Option<HoldReason> {
        if self
            .keep_out
            .limit_m()
            .is_some_and(|limit| target_m > limit)
        {
            return Some(HoldReason::Lost);
        }
        if self.association.node == 0 {
            return None;
        }
        if !self.is_heard() {
            return Some(HoldReason::Unheard);
        }
        if !self.is_beyond(reachable) {
            return Some(HoldReason::Order);
        }
        (self.target_m - target_m < near).then_some(HoldReason::Close)
    }
}
