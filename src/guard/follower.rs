//! Fence on the upstream side of this relay, set by the upstream neighbour.

use super::association::{Fence, HoldReason};
use super::link::{FenceLink, Role};
use super::own::Own;
use crate::place::Placement;
use crate::serial_number::is_newer;
use crate::side::Side;
use crate::time::Jitter;

/// Fence toward Tx: the plane x = constant that is a lower limit of this relay's x. The upstream neighbour sets it.
pub(super) type FenceFollower = FenceLink<Follower>;

/// State of the fence toward Tx that only this relay, its follower, has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower {
    /// True once the upstream neighbour has been told that this relay has reached the newest fence. The fence is the
    /// lower limit of this relay's x.
    owner_informed: bool,
}

impl Role for Follower {
    const FIRST_FENCE_M: f32 = f32::NEG_INFINITY;
    const NEW: Self = Self {
        owner_informed: false,
    };
}

impl FenceFollower {
    /// Replaces the upstream neighbour by `node`; 0 for none.
    pub(super) fn link(&mut self, node: u16, own: &Own, jitter: &mut Jitter) {
        if self.is_out_of_order(own) {
            self.keep_out.mark_disordered();
        }
        if node < self.association.node {
            self.record_lost_x(own);
        }
        self.renew(own, jitter);
        self.association.node = node;
    }

    /// Records the x of the upstream neighbour, which is lost or has restarted. Its fence and its agreed position are
    /// known, but not where it is on its way.
    fn record_lost_x(&mut self, own: &Own) {
        if !self.association.has_no_flown_neighbour() && self.has_fence() {
            let most_m = self.fence_m - self.requested_m.min(own.config.separation_m);
            let (node, x_m) = (self.association.node, most_m.min(self.target_m));
            self.keep_out.record_lost_x(Side::Upstream, node, x_m);
        }
    }

    /// Starts a new association with the upstream neighbour. The field `keep_out` keeps the lower limit of
    /// this relay's x from the old association. If the neighbour had set no fence in it, the limit is the
    /// x of this relay's setpoint.
    fn renew(&mut self, own: &Own, jitter: &mut Jitter) {
        let mut keep_out = self.keep_out;
        if !self.association.has_no_flown_neighbour() {
            // The limit is the x at which this relay has arrived, not the requested one.
            let limit_m = self.min_x(own).min(own.reachable.setpoint_m);
            let separation_m = own.config.separation_m;
            // Distance to be added if the neighbour was permitted to be closer than the separation, or was never
            // received.
            let missing_m = separation_m - self.requested_m.min(self.agreed_m).min(separation_m);
            keep_out.add_lost(Side::Upstream, self.association.node, limit_m + missing_m);
            if missing_m > 0.0 {
                keep_out.mark_near(limit_m + missing_m);
            } else if !self.has_fence() {
                keep_out.mark_near(limit_m + separation_m);
            } else if !self.passed_first_fence {
                keep_out.mark_near(self.fence_m);
            }
        }
        *self = Self {
            keep_out,
            ..Self::new(self.association.node, jitter)
        };
    }

    /// Handles the notice that the upstream neighbour no longer flies to setpoints. This relay comes no nearer to that
    /// neighbour. If the two were in the wrong order along x, this relay holds its position.
    fn release(&mut self, association: u16, own: &Own, jitter: &mut Jitter) {
        let (was_absent, is_ordered) = (self.association.is_absent(), self.is_ordered());
        self.renew(own, jitter);
        if !was_absent {
            let (node, at_m) = (self.association.node, own.reachable.setpoint_m);
            self.keep_out.add_lost(Side::Upstream, node, at_m);
        }
        if is_ordered {
            self.association.mark_absent(association);
        }
    }

    pub(super) fn handle_fence(&mut self, fence: &Fence, own: &Own, jitter: &mut Jitter) {
        let [has_left, is_unplaced] =
            [Fence::LEFT, Fence::UNPLACED].map(|flag| fence.has_flag(flag));
        // In a message with a fence number the x is that of the fence, which may be far from the neighbour.
        let has_fence = !has_left && fence.number != 0;
        if !self.association.receive(
            &mut self.keep_out,
            fence,
            has_fence,
            is_unplaced || !has_left && !has_fence,
        ) {
            if self.association.is_leave_notice(fence) {
                self.release(fence.association, own, jitter);
            }
            // A relay without an association expects no reply.
            self.association.due |= !fence.has_flag(Fence::UNPLACED);
            return;
        }
        let is_first = self.association.peer_number == 0;
        // A fence with a number does not have its sender's x, and is of an association that this relay has left.
        if fence.association != self.association.peer_number
            && (is_first || self.association.count_foreign())
            && fence.number == 0
        {
            let node = self.association.node;
            let keep_out = &self.keep_out;
            if keep_out.bars(Side::Upstream, node, fence.x_m, &own.config) {
                return;
            }
            if !is_first {
                self.record_lost_x(own);
                self.renew(own, jitter);
            }
            self.association.pair(fence.association);
        }
        // Always reply: a message is repeated if its reply was lost.
        self.association.due = true;
        if !self.association.is_current(fence.association, fence.echo) {
            return;
        }
        let is_other = fence.number != self.number;
        let is_late = is_other && !is_newer(fence.number, self.number);
        if self.has_fence() && (fence.number == 0 || is_late) {
            return;
        }
        self.association.receive_open(fence);
        (self.target_m, self.across) = (fence.target_m, fence.across);
        if is_other {
            if self.number == 0 {
                self.keep_out
                    .on_fence(Side::Upstream, self.association.node);
            }
            self.number = fence.number;
            self.fence_m = fence.x_m;
            self.requested_m = fence.apart_m;
            self.role.owner_informed = false;
        }
    }

    /// Returns the upstream neighbour's agreed position; `None` before the neighbour's first fence message. A fence
    /// message contains a limit of x and the agreed position.
    pub(super) fn neighbour_place(&self) -> Option<Placement> {
        (self.number != 0).then(|| self.across.at(self.target_m))
    }

    /// Returns the smallest x allowed for this relay, m. If its setpoint has a smaller x, the relay has to fly to this
    /// x.
    #[inline(never)] // called from several places
    pub(super) fn min_x(&self, own: &Own) -> f32 {
        let granted = match (self.association.has_no_flown_neighbour(), self.number) {
            (true, _) => f32::NEG_INFINITY,
            (false, 0) => own.reachable.setpoint_m,
            (false, _) => self.fence_m,
        };
        granted.max(self.keep_out.limit_m())
    }

    /// Returns true if the upstream neighbour permits this relay to change its lateral offset and altitude. A lost
    /// relay that may be closer than the separation forbids it, too.
    pub(super) fn may_move_across(&self, own: &Own) -> bool {
        self.may_change_cross_section() && !self.has_reduced_step(own)
    }

    /// Returns true if the upstream neighbour requests to come closer along x than the minimum separation. Meanwhile
    /// this relay must not change its lateral offset or altitude.
    pub(super) fn has_reduced_step(&self, own: &Own) -> bool {
        self.requested_m < own.config.separation_m
    }

    /// Returns true while this relay may be as close to its upstream neighbour as it was at its start.
    ///
    /// The neighbour has announced a fence (lower limit of this relay's x), but no position report has shown this relay
    /// at or beyond a fence yet. So the two may be closer along x than the minimum separation.
    pub(super) const fn is_tight(&self) -> bool {
        self.has_fence() && !self.passed_first_fence
    }

    /// Returns true if this relay's agreed x is less than the separation beyond its upstream neighbour's.
    pub(super) fn is_close(&self, own: &Own) -> bool {
        self.has_fence() && own.is_close(own.target_m() - self.target_m)
    }

    /// Agrees to the distance along x that the upstream neighbour requests, if it is large enough. The sum of this
    /// distance and `downstream_m`, the distance to the downstream neighbour, must be at least the separation. Then the
    /// upstream and the downstream neighbour are the separation apart.
    pub(super) fn agree(&mut self, own: &Own, downstream_m: f32) {
        let missing_m = own.config.separation_m - self.requested_m;
        let enough = missing_m <= downstream_m + own.config.rounding();
        if self.requested_m >= self.agreed_m || enough {
            self.agreed_m = self.requested_m;
        }
    }

    /// Returns the distance along x that this relay and its upstream neighbour surely keep, m. Infinity stands for the
    /// minimum separation. The result is 0 while a lost relay may be closer than the separation, and until this relay
    /// has reached its first fence (lower limit of its x).
    pub(super) const fn kept_distance(&self) -> f32 {
        if self.keep_out.is_near() || self.has_fence() && !self.passed_first_fence {
            0.0
        } else {
            self.agreed_m
        }
    }

    /// Returns true if this relay is known to be at a larger x than its upstream neighbour. Also true if the neighbour
    /// does not fly to setpoints, or if the chain ends here.
    ///
    /// The proof is a fence (lower limit of x) from the neighbour: the neighbour announces one only after it has found
    /// this relay at a larger x than its own. False while a lost relay on the upstream side may be at a larger x than
    /// this relay.
    pub(super) const fn is_ordered(&self) -> bool {
        !self.keep_out.is_disordered()
            && (self.association.has_no_flown_neighbour() || self.has_fence())
    }

    /// Returns true if the upstream neighbour was reported at a larger x than this relay (wrong order).
    ///
    /// Also true while a lost relay may be on the wrong side of this relay.
    pub(super) fn is_out_of_order(&self, own: &Own) -> bool {
        self.keep_out.is_disordered()
            || !self.is_ordered() && self.association.is_on_wrong_side(own, Side::Upstream)
    }

    /// Returns true if the upstream neighbour has announced a fence in this association.
    pub(super) const fn has_fence(&self) -> bool {
        self.number != 0
    }

    /// Checks if this relay has reached the newest fence (lower limit of its x), and records it. It has if its lowest
    /// possible x is not below the fence. A message to the upstream neighbour is due if `low_m` is not below the fence
    /// either. `low_m` is the lowest x of this relay and of the relays downstream, m.
    pub(super) fn update_clearance(&mut self, own: &Own, low_m: f32) {
        if self.has_fence() && own.reachable.is_known() {
            self.passed_first_fence |= own.reachable.low_m >= self.fence_m;
            self.association.due |= low_m >= self.fence_m && !self.role.owner_informed;
        }
    }

    /// Returns the highest x that the relays upstream of this relay can still take, m.
    ///
    /// The relays upstream may be closer than the separation until this relay has reached its first fence (lower limit
    /// of its x). After that they are all at a smaller x than this relay, and the result is negative infinity.
    pub(super) fn high_m(&self, own: &Own) -> f32 {
        if self.has_fence() && !self.passed_first_fence {
            self.fence_m - self.requested_m.min(own.config.separation_m)
        } else {
            f32::NEG_INFINITY
        }
    }

    /// Returns the pending message to the upstream neighbour; `None` if none is pending. The x in the message is
    /// `low_m`, m. If `placed` is false, the order of this relay and its downstream neighbour is not confirmed. Then a
    /// message is only sent to request a halt, and the x in it is this relay's own lowest x.
    pub(super) fn poll_fence(&mut self, own: &Own, low_m: f32, placed: bool) -> Option<Fence> {
        let is_due = self.association.due && (placed || self.association.sends_halt());
        if self.association.node == 0 || !is_due {
            return None;
        }
        self.association.due = false;
        self.role.owner_informed = low_m >= self.fence_m;
        let mut fence = self.association.fence(own);
        (fence.number, fence.x_m) = (self.number, low_m);
        if !placed {
            fence.x_m = own.reachable.low_m;
            fence.flags |= Fence::UNPLACED;
        } else if self.agreed_m <= self.requested_m {
            fence.flags |= Fence::AGREES;
        }
        Some(fence)
    }

    pub(super) fn hold_reason(&self, own: &Own) -> Option<HoldReason> {
        let obstacle = self
            .keep_out
            .obstacle(Side::Upstream, self.association.node, own);
        if obstacle.is_some() || self.association.has_no_flown_neighbour() {
            return obstacle;
        }
        if self.is_out_of_order(own) {
            return Some(HoldReason::Order);
        }
        if !self.has_fence() {
            return Some(
                self.association
                    .unpaired_reason(Side::Upstream, &self.keep_out, own),
            );
        }
        let step_m = own.target_m() - self.target_m + own.config.rounding();
        (step_m < self.agreed_m.min(own.config.separation_m)).then_some(HoldReason::Close)
    }
}
