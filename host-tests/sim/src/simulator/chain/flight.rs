//! Drones that fly to their relays' setpoints, say where they are, and how near they come to each other.

use uav_relay::{Instant, Placement};

use super::super::drones::{Flight, Point, apart};
use super::super::queue::Happening;
use super::state::Chain;
use crate::command::narrow;

impl Chain {
    /// Has the drones take off, where there are any.
    pub(super) fn take_off(&mut self) {
        if let Some(spec) = &self.setup.flight {
            self.flight = Some(Flight::new(spec));
            self.queue.put(Instant::ZERO, 0, Happening::Fly);
        }
    }

    /// All fly on for a step; those whose relays are on say where they are.
    pub(super) fn fly(&mut self) {
        let now = self.now;
        let Some(mut flight) = self.flight.take() else {
            return;
        };
        #[expect(clippy::cast_precision_loss, reason = "some milliseconds")]
        let step_s = flight.step.as_micros() as f64 / 1e6;
        for (index, drone) in flight.drones.iter_mut().enumerate() {
            drone.fly(step_s);
            let Some(member) = self.members.get_mut(index) else {
                continue;
            };
            if member.killed.is_some() {
                continue;
            }
            member.relay.handle_position(now, now, placement(drone.at));
            if let Some(place) = member.relay.setpoint() {
                drone.goal = point(place);
            }
            self.drain(index);
        }
        self.outcome.nearest_m = self.outcome.nearest_m.min(flight.nearest_m());
        self.queue.put(now + flight.step, 0, Happening::Fly);
        self.flight = Some(flight);
    }

    /// Whether every drone whose relay is on is where that was agreed to be.
    pub(super) fn has_arrived(&self) -> bool {
        let Some(flight) = &self.flight else {
            return true;
        };
        let living = self.members.iter().zip(&flight.drones);
        living
            .filter(|(member, _)| member.killed.is_none())
            .all(|(member, drone)| {
                let agreed = member.relay.final_setpoint();
                agreed.is_some_and(|place| apart(point(place), drone.at) < 1e-3)
            })
    }
}

fn point(place: Placement) -> Point {
    [place.x_m, place.y_m, place.altitude_m].map(f64::from)
}

fn placement(at: Point) -> Placement {
    let [x_m, y_m, altitude_m] = at.map(narrow);
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}
