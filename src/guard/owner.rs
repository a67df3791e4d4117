//! Fence on the downstream side of this relay, set by this relay.

use super::association::{Fence, HoldReason};
use super::link::{FenceLink, Role};
use super::own::Own;
use crate::features::DEPARTURES;
use crate::place::Placement;
use crate::serial_number::next_nonzero;
use crate::side::Side;
use crate::time::Jitter;

/// Fence toward Rx: a plane x = constant, the downstream neighbour's lower limit of x. This relay sets the fence.
pub(super) type FenceOwner = FenceLink<Owner>;

/// State of the fence toward Rx that only this relay, its owner, has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Owner {
    /// Lowest x at which the downstream neighbour can be, m. Negative infinity before its first message.
    follower_low_m: f32,
    /// True once the downstream neighbour is at the lateral offset and altitude of its setpoint.
    arrived: bool,
    /// True if the downstream neighbour has received the newest fence, the lower limit of its x.
    is_acknowledged: bool,
}

impl Role for Owner {
    const FIRST_FENCE_M: f32 = f32::INFINITY;
    const NEW: Self = Self {
        follower_low_m: f32::NEG_INFINITY,
        arrived: false,
        is_acknowledged: false,
    };
}

impl FenceOwner {
    /// Replaces the downstream neighbour by `node`; 0 for none.
    pub(super) fn link(&mut self, node: u16, own: &Own, jitter: &mut Jitter) {
        if self.is_out_of_order(own) {
            self.keep_out.mark_disordered();
        }
        if node == 0 || node > self.association.node {
            self.record_lost_x();
        }
        self.renew(own, jitter);
        self.association.node = node;
    }

    /// Records the x of the downstream neighbour, which is lost or has restarted. It is its last known x, or on its way
    /// to its agreed position, but not before the last fence that it has passed.
    fn record_lost_x(&mut self) {
        if !self.association.has_no_flown_neighbour() && self.role.follower_low_m.is_finite() {
            let last_m = self.association.last_x_m().min(self.target_m);
            let (node, x_m) = (self.association.node, last_m.max(self.role.follower_low_m));
            self.keep_out.record_lost_x(Side::Downstream, node, x_m);
        }
    }

    /// Starts a new association with the downstream neighbour. The field `keep_out` keeps the upper limit of
    /// this relay's x from the old association. If the neighbour was not known to be at a larger x, the limit is the x
    /// of this relay's setpoint.
    fn renew(&mut self, own: &Own, jitter: &mut Jitter) {
        let mut keep_out = self.keep_out;
        if !self.association.has_no_flown_neighbour() {
            let limit_m = self.max_x(own, own.config.separation_m);
            keep_out.add_lost(Side::Downstream, self.association.node, limit_m);
            if !self.is_ordered(own) {
                keep_out.mark_near(limit_m - own.config.separation_m);
            } else if self.has_reduced_step(own) || !self.passed_first_fence {
                keep_out.mark_near(limit_m);
            }
        }
        *self = Self {
            keep_out,
            ..Self::new(self.association.node, jitter)
        };
    }

    /// Handles the notice that the downstream neighbour no longer flies to setpoints. This relay comes no nearer to
    /// that neighbour. If the two were in the wrong order along x, this relay holds its position.
    fn release(&mut self, association: u16, own: &Own, jitter: &mut Jitter) {
        let (was_absent, is_ordered) = (self.association.is_absent(), self.is_ordered(own));
        self.renew(own, jitter);
        if !was_absent {
            let (node, at_m) = (self.association.node, own.reachable.setpoint_m);
            self.keep_out.add_lost(Side::Downstream, node, at_m);
        }
        if is_ordered {
            self.association.mark_absent(association);
        }
    }

    pub(super) const fn has_reply(&self) -> bool {
        self.association.peer_number != 0
    }

    /// Returns true if the downstream neighbour is known to be at a larger x than this relay. Also true if it does not
    /// fly to setpoints, or if the chain ends here.
    pub(super) fn is_ordered(&self, own: &Own) -> bool {
        !self.keep_out.is_disordered()
            && (self.association.has_no_flown_neighbour()
                || self.has_reply() && self.is_beyond(own))
    }

    /// Returns true if the downstream neighbour was last reported at a smaller x, the wrong order.
    ///
    /// Reports outside of an association count, too. Also true while a lost relay downstream may be at a
    /// smaller x.
    pub(super) fn is_out_of_order(&self, own: &Own) -> bool {
        if self.keep_out.is_disordered() {
            true
        } else if self.has_reply() {
            !self.is_beyond(own) && self.role.follower_low_m > f32::NEG_INFINITY
        } else {
            !self.is_ordered(own) && self.association.is_on_wrong_side(own, Side::Downstream)
        }
    }

    /// Returns true if the downstream neighbour is known to be at a larger x than this relay.
    ///
    /// Each report has an error of up to `hover_m`. Before the neighbour is beyond the first fence, two
    /// relays can be closer along x than these errors. They then count as in order only if lateral offset and altitude
    /// keep them at least the separation apart.
    ///
    /// Once the neighbour is beyond the first fence, it counts as in order even if the reports show the wrong order by
    /// up to four times `hover_m`. Relays in order can move by the error when one of them halts or restarts.
    fn is_beyond(&self, own: &Own) -> bool {
        let off_m = 2.0 * own.config.hover_m;
        let may_pass = own.config.least_step(own.cross_section(), self.across) <= 0.0;
        let least_m = match (self.passed_first_fence, may_pass) {
            (true, _) => -2.0 * off_m - own.config.rounding(),
            (false, true) => -off_m - own.config.rounding(),
            (false, false) => off_m,
        };
        self.role.follower_low_m - own.reachable.high_m >= least_m
    }

    /// Returns the lowest x of this relay and of the relays downstream, m. A relay downstream is at a smaller x than
    /// this relay only within the errors of the reports.
    pub(super) fn low_m(&self, own: &Own) -> f32 {
        let low_m = own.reachable.low_m;
        let is_lower = self.role.follower_low_m < low_m - 2.0 * own.config.rounding();
        if !self.association.has_no_flown_neighbour() && self.has_reply() && is_lower {
            self.role.follower_low_m
        } else {
            low_m
        }
    }

    /// Returns the distance along x that this relay keeps from the downstream neighbour, m. `kept_m` is the distance to
    /// the upstream neighbour, m. The sum of the two distances is at least the minimum separation, so that the two
    /// neighbours are at least the separation apart.
    pub(super) fn step(&self, own: &Own, kept_m: f32) -> f32 {
        let separation_m = own.config.separation_m;
        self.agreed_m.max(separation_m - kept_m).min(separation_m)
    }

    /// Returns the guaranteed distance along x between this relay and its downstream neighbour, m.
    ///
    /// The result is 0 while a lost relay may be closer to this relay than the minimum separation, and until the
    /// neighbour has reached its first fence (lower limit of its x). `kept_m` is the guaranteed distance along x between
    /// this relay and its upstream neighbour, m.
    pub(super) fn kept_distance(&self, own: &Own, kept_m: f32) -> f32 {
        let is_open = self.association.has_no_flown_neighbour() || self.passed_first_fence;
        if self.keep_out.is_near() || !is_open {
            0.0
        } else {
            self.step(own, kept_m)
        }
    }

    /// Returns true if the distance to the downstream neighbour may be less than the minimum separation.
    ///
    /// This relay has requested a smaller distance along x, or the neighbour has agreed to one. The neighbour must then
    /// not change its lateral offset or altitude, because perhaps only these keep the two relays apart.
    pub(super) fn has_reduced_step(&self, own: &Own) -> bool {
        self.requested_m.min(self.agreed_m) < own.config.separation_m
    }

    /// Returns the downstream neighbour's agreed position; `None` before its first fence message. A fence message
    /// contains a limit of x and the agreed position.
    pub(super) fn neighbour_place(&self) -> Option<Placement> {
        self.role
            .follower_low_m
            .is_finite()
            .then(|| self.across.at(self.target_m))
    }

    pub(super) fn handle_fence(&mut self, fence: &Fence, own: &Own, jitter: &mut Jitter) {
        let [has_left, is_unplaced] =
            [Fence::LEFT, Fence::UNPLACED].map(|flag| fence.has_flag(flag));
        if !self.association.receive(
            &mut self.keep_out,
            fence,
            !has_left && !is_unplaced,
            !has_left || is_unplaced,
        ) {
            if self.association.is_leave_notice(fence) {
                self.release(fence.association, own, jitter);
            }
            // A relay without an association expects no reply.
            self.association.due |= !fence.has_flag(Fence::UNPLACED);
            return;
        }
        if !self.has_reply() && fence.echo == self.association.own_number {
            let node = self.association.node;
            let keep_out = &self.keep_out;
            if keep_out.bars(Side::Downstream, node, fence.x_m, &own.config) {
                return;
            }
            self.association.pair(fence.association);
            self.association.due = true;
            self.keep_out.on_fence(Side::Downstream, node);
        }
        if !self.association.is_current(fence.association, fence.echo) {
            if self.has_reply() && self.association.count_foreign() {
                self.record_lost_x();
                self.renew(own, jitter);
            }
            self.association.due |= self.association.is_absent();
            return;
        }
        self.association.receive_open(fence);
        if fence.has_flag(Fence::UNPLACED) {
            return;
        }
        self.target_m = fence.target_m;
        (self.across, self.role.arrived) = (fence.across, fence.has_flag(Fence::ARRIVED));
        self.role.is_acknowledged = fence.number == self.number;
        if self.role.is_acknowledged {
            self.role.follower_low_m = self.role.follower_low_m.max(fence.x_m.min(self.fence_m));
            self.passed_first_fence |= self.number != 0 && fence.x_m >= self.fence_m;
            if self.role.arrived && fence.has_flag(Fence::AGREES) {
                let least_m = own.config.least_step(own.cross_section(), fence.across);
                self.agreed_m = self.agreed_m.min(self.requested_m.max(least_m));
            }
        } else {
            self.association.due = true;
        }
    }

    /// Returns the largest x at which this relay keeps `apart` metres from its downstream neighbour, m. While the order
    /// of the two along x is not known, the result is the x of this relay's setpoint. A lost relay can lower the
    /// result.
    #[inline(never)] // called from several places
    pub(super) fn max_x(&self, own: &Own, apart: f32) -> f32 {
        let granted = match (
            self.association.has_no_flown_neighbour(),
            self.is_beyond(own),
        ) {
            (true, _) => f32::INFINITY,
            (false, true) => self.role.follower_low_m - apart,
            (false, false) => own.reachable.setpoint_m,
        };
        granted.min(self.keep_out.limit_m())
    }

    /// Returns true if the downstream neighbour permits this relay to change lateral offset and altitude. A lost relay
    /// that may be closer than the separation forbids it, too.
    pub(super) fn may_move_across(&self, own: &Own) -> bool {
        self.may_change_cross_section() && !self.has_reduced_step(own)
    }

    /// Returns true while this relay may be as close to its downstream neighbour as it was at its start.
    ///
    /// The neighbour has answered, but has not reported yet that it has reached a fence (lower limit of its x). So the
    /// two may be closer along x than the minimum separation.
    pub(super) const fn is_tight(&self) -> bool {
        self.has_reply() && !self.passed_first_fence
    }

    /// Returns true if the downstream neighbour's agreed x is less than the separation beyond this relay's.
    pub(super) fn is_close(&self, own: &Own) -> bool {
        // Before its first position the neighbour's agreed x is unknown.
        let place = self.neighbour_place();
        place.is_some_and(|place| own.is_close(place.x_m - own.target_m()))
    }

    /// Returns true if the downstream neighbour is known to be beyond the newest fence.
    pub(super) fn is_cleared(&self) -> bool {
        self.passed_first_fence
            && self.role.is_acknowledged
            && self.role.follower_low_m >= self.fence_m
    }

    /// Returns true if the downstream neighbour has received the newest fence.
    pub(super) const fn is_received(&self) -> bool {
        self.has_reply() && self.role.is_acknowledged
    }

    /// Returns true unless the downstream neighbour still has to answer the newest fence. It has to answer
    /// none before its first message, and while it does not fly to setpoints.
    pub(super) fn is_answered(&self) -> bool {
        let cannot = !self.has_reply() || self.association.has_no_flown_neighbour();
        cannot || self.role.is_acknowledged && !self.association.due
    }

    /// Returns the smallest permitted distance along x between this relay and its downstream neighbour, m.
    ///
    /// The result is usually the minimum separation. It is smaller if the agreed positions of the two relays are closer
    /// along x, and both relays have arrived at their agreed lateral offsets and altitudes, which then keep them apart.
    fn best_step(&self, own: &Own) -> f32 {
        let separation_m = own.config.separation_m;
        let step_m = self.target_m - own.target_m();
        let settled = self.passed_first_fence
            && self.role.arrived
            && own.arrived
            && own.has_agreed_cross_section()
            && !own.open;
        if !(settled && own.is_close(step_m)) {
            return separation_m;
        }
        let least_m = own.config.least_step(own.cross_section(), self.across);
        step_m.max(least_m).min(separation_m)
    }

    /// Returns the next fence for the downstream neighbour: x (m), a distance (m), and true for a final x. `None` if
    /// the neighbour is not known to be at a larger x than this relay.
    ///
    /// The neighbour's x stays at or above the fence, and this relay stays the distance below the fence. An x that is
    /// not final can be lowered once this relay, or one upstream, has moved toward Tx. `kept_m` is the distance to the
    /// upstream neighbour, m. `upstream_m` is the highest possible x of the relays upstream, m.
    #[inline(never)] // called from several places
    fn next_fence(&self, own: &Own, kept_m: f32, upstream_m: f32) -> Option<(f32, f32, bool)> {
        if !self.has_reply() || !self.is_beyond(own) {
            return None;
        }
        let best = self.best_step(own);
        // The step increases only if this relay is already that far away.
        let now_m = self.role.follower_low_m - own.reachable.high_m + own.config.rounding();
        let step_m = if best > self.agreed_m.max(now_m) {
            self.requested_m
        } else {
            best
        };
        let nearest = own.reachable.high_m + self.step(own, kept_m).max(step_m);
        let nearest = nearest.max(upstream_m + own.config.separation_m);
        if !self.passed_first_fence {
            return Some((nearest, step_m, true));
        }
        let other_m = own.goal_of(self.association.node, self.target_m);
        // A relay with the order to leave holds its position: its neighbours get all the room up to it.
        let goal = if DEPARTURES && own.leaver == own.node {
            own.goal_m() + best
        } else if DEPARTURES && own.leaver == self.association.node {
            other_m
        } else {
            0.5 * (own.goal_m() + other_m + best)
        };
        Some((goal.max(nearest), step_m, goal >= nearest))
    }

    /// Schedules a message if the fence for the downstream neighbour needs another x. If the new x is
    /// final, the message is due at once. Otherwise it is due once this relay has arrived at its setpoint's x, because
    /// the fence can then be set to a lower x.
    pub(super) fn schedule_fence(&mut self, own: &Own, kept_m: f32, upstream_m: f32) {
        if let Some((x_m, step_m, last)) = self.next_fence(own, kept_m, upstream_m) {
            let stays = last || own.reachable.has_arrived();
            self.association.due |= stays && self.is_new_fence(own, x_m, step_m);
        }
    }

    fn is_new_fence(&self, own: &Own, x_m: f32, step_m: f32) -> bool {
        let announced_m = self.requested_m.min(own.config.separation_m);
        self.number == 0 || (x_m - self.fence_m).abs() > 0.0 || (step_m - announced_m).abs() > 0.0
    }

    /// Returns the pending fence message to the downstream neighbour; `None` if none is pending.
    ///
    /// If `moves` is true, the message may contain a new fence (lower limit of the neighbour's x) with the next number.
    /// Otherwise the message repeats the last fence. Only this function gives a fence its number, so that every fence
    /// with a number is sent.
    pub(super) fn poll_fence(
        &mut self,
        own: &Own,
        kept_m: f32,
        upstream_m: f32,
        moves: bool,
    ) -> Option<Fence> {
        if self.association.node == 0 || !core::mem::take(&mut self.association.due) {
            return None;
        }
        let proposed = self.next_fence(own, kept_m, upstream_m);
        if let Some((x_m, step_m, _)) =
            proposed.filter(|(x_m, step_m, _)| moves && self.is_new_fence(own, *x_m, *step_m))
        {
            self.number = next_nonzero(self.number);
            self.fence_m = x_m;
            self.requested_m = step_m;
            self.agreed_m = self.agreed_m.max(step_m);
            self.role.is_acknowledged = false;
            self.role.follower_low_m = self.role.follower_low_m.min(x_m);
        }
        let x_m = if self.number == 0 {
            own.reachable.high_m
        } else {
            self.fence_m
        };
        Some(Fence {
            number: self.number,
            x_m,
            apart_m: self.requested_m.min(own.config.separation_m),
            ..self.association.fence(own)
        })
    }

    pub(super) fn hold_reason(&self, own: &Own, kept_m: f32) -> Option<HoldReason> {
        let obstacle = self
            .keep_out
            .obstacle(Side::Downstream, self.association.node, own);
        if obstacle.is_some() || self.association.has_no_flown_neighbour() {
            return obstacle;
        }
        if !self.has_reply() {
            return Some(
                self.association
                    .unpaired_reason(Side::Downstream, &self.keep_out, own),
            );
        }
        if !self.is_beyond(own) {
            return Some(HoldReason::Order);
        }
        let step_m = self.target_m - own.target_m();
        let far = step_m + own.config.rounding() < self.step(own, kept_m);
        far.then_some(HoldReason::Close)
    }
}
