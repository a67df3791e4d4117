//! Flight of simple drones: setpoints, position reports and closest approach.

use uav_relay::Instant;

use super::super::drones::{Flight, Nearest, apart, placement, point};
use super::super::queue::QueuedEvent;
use super::state::Chain;

impl Chain {
    /// Creates the drones, if any, and starts their time steps.
    pub(super) fn take_off(&mut self) {
        if let Some(spec) = &self.setup.flight {
            self.flight = Some(Flight::new(spec, self.setup.seed));
            self.queue.put(Instant::ZERO, 0, QueuedEvent::Fly);
        }
        self.line_up();
    }

    /// Advances all drones by one time step; those with living relays report their positions.
    pub(super) fn fly(&mut self) {
        let now = self.now;
        let Some(mut flight) = self.flight.take() else {
            return;
        };
        let reports = flight.go_on();
        for index in 0..flight.drones.len() {
            let at = if reports {
                flight.reported(index)
            } else {
                None
            };
            let Some(member) = self.members.get_mut(index) else {
                continue;
            };
            if member.killed.is_some() {
                continue;
            }
            if let Some(at) = at {
                member.relay.handle_position(now, now, placement(at));
            }
            if let Some(place) = member.relay.setpoint()
                && let Some(drone) = flight.drones.get_mut(index)
            {
                drone.goal = point(place);
            }
            if reports {
                self.drain(index);
            }
        }
        self.keep(flight.nearest(now));
        self.queue.put(now + flight.step, 0, QueuedEvent::Fly);
        self.flight = Some(flight);
    }

    /// Updates the closest approach.
    pub(super) fn keep(&mut self, nearest: Option<Nearest>) {
        let known = self.outcome.nearest;
        if nearest.is_some_and(|it| known.is_none_or(|known| it.apart_m < known.apart_m)) {
            self.outcome.nearest = nearest;
        }
    }

    /// Returns true if every drone with a living relay is at its agreed position, by its own estimate.
    pub(super) fn has_arrived(&self) -> bool {
        let Some(flight) = &self.flight else {
            return true;
        };
        let living = self.members.iter().zip(&flight.drones);
        living
            .filter(|(member, _)| member.killed.is_none())
            .all(|(member, drone)| {
                let agreed = member.relay.agreed_place();
                agreed.is_some_and(|place| apart(point(place), drone.taken()) < 1e-3)
            })
    }
}
