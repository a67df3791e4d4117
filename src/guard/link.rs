//! Fence to the neighbour on one side: the state that its owner and its follower have in common.

use super::association::{Association, KeepOut};
use crate::place::CrossSection;
use crate::time::Jitter;

/// Part of this relay at a fence: its owner, which sets it, or its follower.
pub(super) trait Role {
    /// x of the fence before the first one, m: no limit.
    const FIRST_FENCE_M: f32;
    /// State at the start of an association.
    const NEW: Self;
}

/// State of the fence on one side of this relay, with the association and the obstacles on that side.
#[derive(Clone, Copy, Debug)]
pub(super) struct FenceLink<R> {
    pub(super) association: Association,
    pub(super) keep_out: KeepOut,
    /// Sequence number of the newest fence that its owner has set; 0 for none yet.
    pub(super) number: u16,
    /// Newest fence, the lower limit of the follower's x, m. Infinite before the first one.
    pub(super) fence_m: f32,
    /// Distance along x that the owner requests to keep from its fence, m. Infinite before its first request.
    pub(super) requested_m: f32,
    /// Distance along x to the neighbour that the follower has agreed to, m. Infinity, also the initial value, stands
    /// for the minimum separation. At the owner it is also a larger distance that it has requested since.
    pub(super) agreed_m: f32,
    /// x that the chain has agreed on for the neighbour, m.
    pub(super) target_m: f32,
    /// Lateral offset and altitude of the neighbour's setpoint.
    pub(super) across: CrossSection,
    /// True once the follower's x is known to have reached a fence (lower limit of its x).
    pub(super) passed_first_fence: bool,
    pub(super) role: R,
}

impl<R: Role> FenceLink<R> {
    pub(super) const fn new(node: u16, jitter: &mut Jitter) -> Self {
        Self {
            association: Association::new(node, jitter),
            keep_out: KeepOut::none(),
            number: 0,
            fence_m: R::FIRST_FENCE_M,
            requested_m: f32::INFINITY,
            agreed_m: f32::INFINITY,
            target_m: 0.0,
            across: CrossSection::on_line(0.0),
            passed_first_fence: false,
            role: R::NEW,
        }
    }

    /// Leaves the association, and schedules a notice of this to the neighbour. This relay's drone no longer flies to
    /// setpoints, so no limit of x applies to this relay.
    pub(super) fn leave(&mut self, jitter: &mut Jitter) {
        *self = Self {
            keep_out: self.keep_out,
            association: self.association.leave(jitter),
            ..Self::new(self.association.node, jitter)
        };
    }

    /// Starts a new association, because Tx or Rx has moved. Lost relays on this side remain obstacles.
    /// Drones that do not fly to setpoints are no longer obstacles.
    pub(super) fn leave_line(&mut self, jitter: &mut Jitter) {
        *self = Self {
            keep_out: self.keep_out.leave_line(),
            association: self.association.renew(jitter),
            ..Self::new(self.association.node, jitter)
        };
    }

    /// Returns true unless the neighbour or a lost relay may be closer than the separation.
    pub(super) const fn may_change_cross_section(&self) -> bool {
        (self.association.has_no_flown_neighbour() || self.passed_first_fence)
            && !self.keep_out.is_near()
    }
}
