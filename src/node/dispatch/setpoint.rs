//! Where a relay is to be, and where to fly now.

use super::state::Node;
use crate::event::Event;
use crate::guard::HoldReason;
use crate::place::Placement;
use crate::side::Side;
use crate::time::Instant;

impl Node {
    /// Where to be in the end: at the place agreed on, or beside it while others may fly there.
    fn wanted(&self) -> Option<Placement> {
        let agreed = self.layers.round.setpoint()?;
        Some(if self.layers.view.has_no_quorum() {
            self.member.settings.without_quorum.place(agreed)
        } else {
            agreed
        })
    }

    /// Moves the setpoint as far as it may go by what is known now.
    pub(super) fn steer(&mut self, now: Instant) {
        if self.steering.steer(now, self.wanted()) {
            self.raise(Event::SetpointChanged);
        }
    }

    /// The drone was at `place` at time `at`.
    pub(crate) fn handle_position(&mut self, now: Instant, at: Instant, place: Placement) {
        self.steering.position(at, place);
        self.steer(now);
    }

    /// Whether the drone flies to the setpoints from now on.
    pub(crate) fn handle_control(&mut self, now: Instant, flown: bool) {
        self.steering.control(now, flown);
        self.steer(now);
    }

    /// Who fell silent at `side` is not in the air any more.
    pub(crate) fn clear_lost(&mut self, now: Instant, side: Side) {
        self.steering.clear_lost(side);
        self.steer(now);
    }

    /// Where to be in the end.
    pub(crate) const fn final_setpoint(&self) -> Option<Placement> {
        self.layers.round.setpoint()
    }

    /// Where to fly now.
    pub(crate) fn setpoint(&self) -> Option<Placement> {
        if self.is_passive() {
            return None;
        }
        self.steering.setpoint(self.wanted())
    }

    /// What keeps the relay from its place at `side`.
    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.steering.hold_reason(side)
    }
}
