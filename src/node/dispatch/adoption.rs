//! Adoption of a decided view, with its mission, and the setpoint for the autopilot.
//!
//! The setpoint depends on the drone's reports, which are handled here, too.

use super::Node;
use crate::event::Event;
use crate::features::UPLOAD;
use crate::guard::HoldReason;
use crate::mission::Mission;
use crate::node::context::{Member, ProposalOutcome, respacing};
use crate::node::steering::Begin;
use crate::place::Placement;
use crate::settings::Method;
use crate::side::{Heading, Side};
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;

/// Longest wait of a motion for the common start time, which follows from the first lease renewal.
///
/// The time between the last relay's answer to this renewal and the start is added.
const WAIT: Duration = Duration::from_millis(15_000);

impl Node {
    /// Handles the decision on a view proposal. If the proposal is accepted, starts the new view (list of members)
    /// with its mission.
    pub(super) fn adopt_view(&mut self, now: Instant, decided: ProposalOutcome) {
        let Some(proposed) = self.layers.view.proposed() else {
            return;
        };
        let (place, id) = (proposed.rank, proposed.mission_id);
        let leads = place == 1;
        let (relays, usable_in) = match decided {
            ProposalOutcome::Granted { relays, usable_in } => (relays, usable_in),
            ProposalOutcome::Superseded { view, usable_in } => {
                if let Some(view) = view {
                    let rest = now + Duration::from_millis(100).times(u32::from(usable_in));
                    let views = (view, proposed.base.id);
                    self.layers.lease.accept_decided(views, rest);
                }
                if leads {
                    self.layers.view.request.start(now);
                }
                return;
            }
            ProposalOutcome::NoQuorum => {
                if !core::mem::replace(&mut self.telemetry.no_quorum_reported, true) {
                    self.raise(Event::NoQuorum);
                }
                return self.layers.neighbours.refuse();
            }
        };
        let mission = self.layers.update.mission_of(&self.member, id);
        let mission = mission.and_then(|mission| mission.with_relays(relays).ok());
        let Some(mission) = mission else {
            return self.layers.view.request.start(now);
        };
        let before = self.member.mission.relays();
        self.member.index = match mission.heading() {
            Heading::TowardRx => place,
            Heading::TowardTx => relays.saturating_sub(place).saturating_add(1),
        };
        self.member.view = proposed.view;
        self.activate_mission(now, mission, id);
        self.layers.view.observe_view(proposed.view);
        let (back, onward) = (self.back(), self.onward());
        self.layers.neighbours.at_mut(back).agree_with_proposer();
        self.layers.neighbours.at_mut(onward).agree(place == relays);
        let works = self.member.settings.method == Method::Joint;
        let rest = now + Duration::from_millis(100).times(u32::from(usable_in));
        let views = (proposed.view, proposed.base.id);
        self.layers
            .lease
            .accept_view(now, views, rest, relays < before);
        if leads {
            self.layers.lease.confirm_view(proposed.view);
        }
        self.layers.round.renew(rest, leads, works);
        if self.layers.leaving.on_new_view() && leads {
            self.layers.lease.exclude_joined(relays);
        }
        bump(&mut self.telemetry.stats.views);
        self.telemetry.lapse_reported = false;
        self.telemetry.no_quorum_reported = false;
        self.raise(Event::ViewAccepted);
        if id != self.layers.update.latest() {
            // A newer mission has arrived in the meantime.
            self.layers.view.request.start(now);
        }
    }

    /// Makes `mission` with the identifier `id` the active mission of the new view.
    fn activate_mission(&mut self, now: Instant, mission: Mission, id: MissionId) {
        if id == self.member.active {
            // The number of relays may have changed.
            self.member.mission = mission;
            return;
        }
        self.adopt(mission, id, Some(now));
        self.raise(Event::Adopted);
    }

    /// Replaces the active mission by the stored `mission` with the identifier `id`. `now` is `None` after a start.
    ///
    /// If the positions of Tx and Rx differ from those of the previous mission, all relay positions become invalid. The
    /// relay then has no setpoint until the next agreement, and the guard (collision avoidance) restarts.
    pub(super) fn adopt(&mut self, mission: Mission, id: MissionId, now: Option<Instant>) {
        self.member.mission = mission;
        self.member.interference = *mission.interference();
        self.member.active = id;
        if UPLOAD {
            if self.layers.update.use_sites() {
                self.layers.round.discard_agreed_place();
                self.steering.switch_line(now);
            }
            let fence = self.layers.update.geofence(&self.member);
            self.steering.set_geofence(fence);
        }
        let common = mission.config().common;
        let profile = self.member.settings.profile.unwrap_or(common);
        self.layers.round.load(profile);
    }
}

impl Node {
    /// Returns the agreed position, changed as `Settings::without_quorum` requires if there is no quorum. `None`
    /// until the chain has agreed.
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
            respacing(&self.member.settings)
        };
        // The order comes first: a relay that also requests to leave closes up to the relay that leaves now.
        let leaver = match self.layers.lease.orders().leaver {
            0 if self.leaves().is_some() && !self.steering.is_moving() => self.member.node,
            ordered => ordered,
        };
        self.steering.set_leaver(leaver);
        // All relays know the turn of the first renewal by then.
        let relays = u32::from(self.member.mission.relays());
        let lead = self.member.settings.hop_time.times(4 * relays);
        let turned_at = self.layers.lease.turned_at();
        let begin = turned_at.map_or(Begin::By(now + WAIT + lead), |at| Begin::At(at + lead));
        if self.steering.steer(now, wanted, span, begin) {
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
        self.steering.setpoint(self.wanted_place())
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
