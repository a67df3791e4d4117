//! Invariants of a run. Setpoints stay within their limits, and Algorithm 2 never makes the chain worse.

use uav_relay::{Method, Placement};

use super::state::Chain;

impl Chain {
    /// Checks the current setpoint and the rounds of relay `index` (from 0).
    pub(super) fn check(&mut self, index: usize) {
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let by = member.node;
        if let Some(place) = member.relay.setpoint()
            && member.safe != Some(place)
        {
            let config = member.relay.mission().config();
            let end = config.distance_m;
            // Allowed altitude: the configured one, or any in the band.
            let given = self.setup.profiles.iter().find(|(of, _)| *of == by);
            let altitude = given.map_or(config.common, |(_, own)| *own).altitude_m;
            let chosen = self.setup.settings.method != Method::Align
                && !self.setup.held.contains(&by)
                && (config.band.least_m..=config.band.most_m).contains(&place.altitude_m);
            let beside = config.lateral.least_m..=config.lateral.most_m;
            let aside = if self.setup.settings.method == Method::Joint {
                beside.contains(&place.y_m)
            } else {
                place.y_m.to_bits() == 0
            };
            let chosen = (0.0..=end).contains(&place.x_m)
                && aside
                && (chosen || place.altitude_m.to_bits() == altitude.to_bits());
            // With a guard, a drone may come from anywhere and be halted anywhere on its path: its setpoint may not leave the box
            // by more than it has since the drone was engaged.
            let [low, high] = member.been.unwrap_or([place; 2]);
            let guard = self.setup.settings.guard;
            let inside = guard.map_or(chosen, |guard| {
                let fence = guard.fence;
                // The box grows with the line of an uploaded mission.
                let longer_m = end - self.setup.mission.config().distance_m;
                let most_x_m = fence.most_x_m + longer_m;
                [
                    (place.x_m, low.x_m, high.x_m, fence.least_x_m, most_x_m),
                    (
                        place.y_m,
                        low.y_m,
                        high.y_m,
                        fence.least_y_m,
                        fence.most_y_m,
                    ),
                    (
                        place.altitude_m,
                        low.altitude_m,
                        high.altitude_m,
                        fence.least_altitude_m,
                        fence.most_altitude_m,
                    ),
                ]
                .iter()
                .all(|(is, low, high, least, most)| {
                    (least.min(*low)..=most.max(*high)).contains(is)
                })
            });
            self.outcome.unsafe_setpoints += u64::from(!inside);
            // After an upload, the drone keeps its position until the next agreement.
            member.safe = inside.then_some(place);
        }
        member.been = member.relay.setpoint().map(|place| {
            let [low, high] = member.been.unwrap_or([place; 2]);
            let of = |low: Placement, pick: fn(f32, f32) -> f32| Placement {
                x_m: pick(low.x_m, place.x_m),
                y_m: pick(low.y_m, place.y_m),
                altitude_m: pick(low.altitude_m, place.altitude_m),
            };
            [of(low, f32::min), of(high, f32::max)]
        });
        if let Some((done, sir)) = member.relay.rounds()
            && sir > 0.0
            && self.outcome.rounds.len() <= usize::from(done)
        {
            // Algorithm 2 moves a relay only if this improves the worse of its two hops.
            debug_assert!(
                self.attacker.is_some()
                    || self.outcome.rounds.last().is_none_or(|last| sir >= *last),
                "round {done} has made the chain worse"
            );
            self.outcome.rounds.push(sir);
        }
    }
}
