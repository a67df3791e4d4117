//! What came of a proposal: the view and the mission of it are those of this relay from now on.

use super::state::Node;
use crate::event::Event;
use crate::mission::{Heading, Mission};
use crate::node::context::Decided;
use crate::settings::Method;
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;

impl Node {
    /// What came of a proposal is known: how many relays there are, or that they are too few.
    pub(super) fn decided(&mut self, now: Instant, decided: Decided) {
        let Some(proposed) = self.layers.view.proposed() else {
            return;
        };
        let (place, id) = (proposed.place, proposed.mission_id);
        let leads = place == 1;
        let (relays, lease_left) = match decided {
            Decided::Granted { relays, lease_left } => (relays, lease_left),
            Decided::Earlier => {
                if leads {
                    self.layers.view.asking.ask(now);
                }
                return;
            }
            Decided::Refused => {
                if !core::mem::replace(&mut self.telemetry.told_refused, true) {
                    self.raise(Event::NoQuorum);
                }
                return self.layers.neighbours.refuse();
            }
        };
        let mission = self.layers.update.mission_of(&self.member, id);
        let mission = mission.and_then(|mission| mission.with_relays(relays).ok());
        let Some(mission) = mission else {
            return self.layers.view.asking.ask(now);
        };
        let before = self.member.mission.relays();
        self.member.index = match mission.heading() {
            Heading::TowardRx => place,
            Heading::TowardTx => relays.saturating_sub(place).saturating_add(1),
        };
        self.member.view = proposed.view;
        self.fly(now, mission, id);
        self.layers.view.heard_of(proposed.view);
        let (back, onward) = (self.back(), self.onward());
        self.layers.neighbours.at_mut(back).agree_with_proposer();
        self.layers.neighbours.at_mut(onward).agree(place == relays);
        let works = self.member.settings.method == Method::Joint;
        let rest = now + Duration::from_millis(100).times(u32::from(lease_left));
        let views = (proposed.view, proposed.base.id);
        self.layers.lease.renew(now, views, rest, relays < before);
        if leads {
            self.layers.lease.commit();
        }
        self.layers.round.renew(rest, leads, works);
        bump(&mut self.telemetry.stats.views);
        self.telemetry.told_lapsed = false;
        self.telemetry.told_refused = false;
        self.raise(Event::Reformed);
        if id != self.layers.update.latest() {
            // A newer one has come in the meantime.
            self.layers.view.asking.ask(now);
        }
    }

    /// Flies `mission` from now on, which is that of `id`.
    fn fly(&mut self, now: Instant, mission: Mission, id: MissionId) {
        if id == self.member.active {
            // With other relays.
            self.member.mission = mission;
            return;
        }
        self.adopt(mission, id, Some(now));
        self.raise(Event::Adopted);
    }

    /// `mission` is another one than before, and the one held; since `now` if the relay has flown another one. Between other sites no place
    /// is what it was: there is none to be at until the chain has agreed on new ones, and the guard begins anew.
    pub(super) fn adopt(&mut self, mission: Mission, id: MissionId, now: Option<Instant>) {
        self.member.mission = mission;
        self.member.interference = *mission.interference();
        self.member.active = id;
        #[cfg(feature = "upload")]
        {
            if self.member.fly_between(self.layers.update.sites()) {
                self.layers.round.discard_place();
                self.steering.leave_line(now);
            }
            self.steering.set_box(self.member.geofence());
        }
        #[cfg(not(feature = "upload"))]
        let _ = now;
        let common = mission.config().common;
        let profile = self.member.settings.profile.unwrap_or(common);
        self.layers.round.load(profile);
    }
}
