//! Adoption of a decided view, with its mission.

use super::Node;
use crate::event::Event;
use crate::features::UPLOAD;
use crate::mission::Mission;
use crate::node::context::ProposalOutcome;
use crate::settings::Method;
use crate::side::Heading;
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;

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
            let before = proposed.base.relays;
            self.layers
                .lease
                .exclude_joined(before.min(relays.saturating_sub(1)));
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
