//! Setpoint for the autopilot, and the reports of the drone that it depends on.

use super::Node;
use super::departure::Leaving;
use crate::event::Event;
use crate::guard::HoldReason;
use crate::node::context::Member;
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};

impl Node {
    /// Returns the agreed position, changed as `Settings::without_quorum` requires if there is no quorum. `None`
    /// before the first agreement.
    fn wanted_place(&self) -> Option<Placement> {
        let agreed = self.layers.round.agreed_place()?;
        Some(if self.layers.view.has_no_quorum() {
            let place = self.member.settings.without_quorum.place(agreed);
            if place == agreed {
                // A motion to the agreed position stops.
                self.steering.stopped().unwrap_or(place)
            } else {
                place
            }
        } else {
            agreed
        })
    }

    pub(super) fn steer(&mut self, now: Instant) {
        let wanted = self.wanted_place();
        let span = if self.layers.view.has_no_quorum() {
            Duration::from_micros(0)
        } else {
            Leaving::respacing(&self.member.settings)
        };
        if self.steering.steer(now, wanted, span) {
            self.raise(Event::SetpointChanged);
        }
        self.update_goal(wanted);
    }

    pub(crate) fn handle_position(&mut self, now: Instant, place: Placement, measured_at: Instant) {
        self.steering.handle_position(measured_at, place);
        self.reporting.handle_position(measured_at, place);
        self.layers.leaving.record_place(place);
        self.steer(now);
    }

    /// Records that the drone follows the setpoints from now on if `flown` is true, else that it does not. Returns
    /// true if that is a change for the guard (collision avoidance).
    pub(crate) fn handle_control(&mut self, now: Instant, flown: bool) -> bool {
        let is_news = self.steering.handle_control(now, flown);
        if is_news {
            self.steer(now);
        }
        is_news
    }

    /// Handles the report that the lost relays at `side` are not in the air any more. The guard (collision avoidance)
    /// then no longer avoids them, only the other relays of the view at that side.
    pub(crate) fn clear_lost(&mut self, now: Instant, side: Side) {
        let Member { index, mission, .. } = &self.member;
        let in_view = match side {
            Side::Upstream => index.saturating_sub(1),
            Side::Downstream => mission.relays().saturating_sub(*index),
        };
        let lost = u16::from(self.layers.neighbours.at(side).node() != 0);
        self.steering.clear_lost(side, in_view > lost);
        self.steer(now);
    }

    pub(crate) const fn agreed_place(&self) -> Option<Placement> {
        self.layers.round.agreed_place()
    }

    /// Returns the current setpoint. `None` before the first agreement, and while the relay is passive.
    pub(crate) fn setpoint(&self) -> Option<Placement> {
        if self.is_passive() {
            return None;
        }
        self.steering.setpoint(self.wanted_place())
    }

    /// Returns the position of the next node at `side`: a relay's agreed position, or that of Tx or Rx. `None` if it
    /// is unknown.
    pub(crate) fn place_toward(&self, side: Side) -> Option<Placement> {
        if !self.layers.neighbours.at(side).has_no_peer() {
            return self.steering.neighbour_place(side);
        }
        let x_m = match side {
            Side::Upstream => 0.0,
            Side::Downstream => self.member.mission.config().distance_m,
        };
        Some(Placement::on_line(x_m, 0.0))
    }

    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.steering.hold_reason(side)
    }
}
