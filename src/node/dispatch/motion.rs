//! Setpoint for the autopilot, and the drone's reports that it depends on.

use super::Node;
use crate::event::Event;
use crate::guard::HoldReason;
use crate::node::context::{Member, respacing};
use crate::node::steering::Begin;
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// Longest wait of a motion for the common start time, which follows from the first lease renewal.
///
/// The time between the last relay's answer to this renewal and the start is added.
const WAIT: Duration = Duration::from_millis(15_000);

impl Node {
    /// Returns the agreed position, changed as `Settings::without_quorum` requires if there is no quorum. `None`
    /// until the chain has agreed.
    fn destination(&self) -> Option<Placement> {
        let agreed = self.layers.round.agreed_place()?;
        Some(if self.layers.view.has_no_quorum() {
            let place = self.member.settings.without_quorum.place(agreed);
            if place == agreed {
                // A motion to the agreed position stops.
                self.steering.waypoint().unwrap_or(place)
            } else {
                place
            }
        } else {
            agreed
        })
    }

    pub(super) fn steer(&mut self, now: Instant) {
        let destination = self.destination();
        let span = if self.layers.view.has_no_quorum() {
            Duration::from_micros(0)
        } else {
            respacing(&self.member.settings)
        };
        // The order to this relay or the next one comes first: a relay that also requests to leave closes up to the relay
        // that leaves now. The guard asks about no other relays.
        let leavers = self.layers.lease.orders().leavers;
        let next = self.layers.neighbours.at(Side::Downstream).node();
        let mut beside = [self.member.node, next].into_iter();
        let ordered = beside.find(|node| *node != 0 && leavers.contains(node));
        let requests = self.departure_granted().is_some() && !self.steering.is_moving();
        let leaver = ordered.unwrap_or(if requests { self.member.node } else { 0 });
        self.steering.set_leaver(leaver);
        // All relays know the turn of the first renewal by then.
        let relays = u32::from(self.member.mission.relays());
        let lead = self.member.settings.hop_time.times(4 * relays);
        let turned_at = self.layers.lease.turned_at();
        let begin = turned_at.map_or(Begin::By(now + WAIT + lead), |at| Begin::At(at + lead));
        let spans = (span, self.member.settings.hop_time);
        if self.steering.steer(now, destination, spans, begin) {
            self.raise(Event::SetpointChanged);
        }
        self.update_goal(destination);
    }

    pub(crate) fn handle_position(&mut self, now: Instant, place: Placement, measured_at: Instant) {
        self.steering.handle_position(measured_at, place);
        self.reporting.handle_position(measured_at, place);
        self.layers.leaving.record_place(place);
        self.steer(now);
    }

    /// Records if the drone follows the setpoints from now on: yes if `flown` is true. Returns true if this is a
    /// change for the guard (collision avoidance).
    pub(crate) fn handle_control(&mut self, now: Instant, flown: bool) -> bool {
        let is_news = self.steering.handle_control(now, flown);
        if is_news {
            self.steer(now);
        }
        is_news
    }

    /// Handles the report that the lost relays at `side` are not in the air any more. The guard (collision avoidance)
    /// then no longer avoids these lost relays. It still avoids the other relays of the view at this side.
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
        self.steering.setpoint(self.destination())
    }

    /// Returns the position of the next node at `side`. It is the agreed position of a relay, or the position of Tx
    /// or Rx. `None` if the position is unknown.
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
