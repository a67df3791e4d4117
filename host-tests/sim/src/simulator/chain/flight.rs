//! Drones that fly to their relays' setpoints, say where they are, and how near they come to each other.

use uav_relay::{Duration, Instant, Placement};

use super::super::queue::Happening;
use super::Chain;
use crate::command::narrow;

/// A place in the air: x, y and altitude, m.
type Point = [f64; 3];

/// How drones fly.
#[derive(Clone, PartialEq, Debug)]
pub struct FlightSpec {
    /// Where each one hovers when it is switched on: x, y and altitude, m.
    pub start: Vec<[f64; 3]>,
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
    at: Point,
    goal: Point,
    speed_mps: f64,
}

impl Drone {
    /// Flies straight to its goal for `step_s` seconds.
    fn fly(&mut self, step_s: f64) {
        let (left, way) = (apart(self.at, self.goal), self.speed_mps * step_s);
        if left <= way {
            self.at = self.goal;
            return;
        }
        for (at, goal) in self.at.iter_mut().zip(self.goal) {
            *at += (goal - *at) / left * way;
        }
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
                nearest = nearest.min(apart(one.at, other.at));
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

/// How far apart two places are, m.
fn apart(one: Point, other: Point) -> f64 {
    let [x, y, h] = one;
    let [other_x, other_y, other_h] = other;
    (x - other_x).hypot(y - other_y).hypot(h - other_h)
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
