//! Drones that fly to their relays' setpoints, say where they are, and how near they come to each other.

use uav_relay::{Duration, Instant, Placement};

use super::super::queue::Happening;
use super::Chain;

/// How drones fly.
#[derive(Clone, PartialEq, Debug)]
pub struct FlightSpec {
    /// Where each one hovers when it is switched on: x and altitude, m.
    pub start: Vec<(f64, f64)>,
    /// How fast each one flies, m/s, above 0.
    pub speed_mps: Vec<f64>,
    /// Between two reports of where a drone is, and two steps of the flight.
    pub step: Duration,
}

/// The drones of a run.
#[derive(Debug)]
pub(super) struct Flight {
    drones: Vec<Drone>,
    step: Duration,
}

#[derive(Clone, Copy, Debug)]
struct Drone {
    at: (f64, f64),
    goal: (f64, f64),
    speed_mps: f64,
}

impl Drone {
    /// Flies straight to its goal for `step_s` seconds.
    fn fly(&mut self, step_s: f64) {
        let (dx, dh) = (self.goal.0 - self.at.0, self.goal.1 - self.at.1);
        let (left, way) = (dx.hypot(dh), self.speed_mps * step_s);
        self.at = if left <= way {
            self.goal
        } else {
            (self.at.0 + dx / left * way, self.at.1 + dh / left * way)
        };
    }
}

impl Flight {
    pub(super) fn new(spec: &FlightSpec) -> Self {
        let drones = spec.start.iter().zip(&spec.speed_mps);
        Self {
            drones: drones
                .map(|(&at, &speed_mps)| Drone {
                    at,
                    goal: at,
                    speed_mps,
                })
                .collect(),
            step: spec.step,
        }
    }

    /// The least distance between two drones, m: infinite for fewer than two.
    fn nearest_m(&self) -> f64 {
        let mut nearest = f64::INFINITY;
        for (at, one) in self.drones.iter().enumerate() {
            for other in self.drones.iter().skip(at + 1) {
                let apart = (one.at.0 - other.at.0).hypot(one.at.1 - other.at.1);
                nearest = nearest.min(apart);
            }
        }
        nearest
    }
}

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
                drone.goal = (f64::from(place.x_m), f64::from(place.altitude_m));
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
                member.relay.agreed().is_some_and(|place| {
                    let off_m = (f64::from(place.x_m) - drone.at.0)
                        .hypot(f64::from(place.altitude_m) - drone.at.1);
                    off_m < 1e-3
                })
            })
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a place in metres")]
fn placement((x_m, altitude_m): (f64, f64)) -> Placement {
    Placement::on_line(x_m as f32, altitude_m as f32)
}
