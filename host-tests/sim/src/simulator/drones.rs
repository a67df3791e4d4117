//! Drones that fly straight to where they are told.

use uav_relay::Duration;

/// A place in the air: x, y and altitude, m.
pub type Point = [f64; 3];

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
    pub(super) drones: Vec<Drone>,
    pub(super) step: Duration,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Drone {
    pub(super) at: Point,
    pub(super) goal: Point,
    speed_mps: f64,
}

impl Drone {
    /// Flies straight to its goal for `step_s` seconds.
    pub(super) fn fly(&mut self, step_s: f64) {
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
    pub(super) fn nearest_m(&self) -> f64 {
        let mut nearest = f64::INFINITY;
        for (at, one) in self.drones.iter().enumerate() {
            for other in self.drones.iter().skip(at + 1) {
                nearest = nearest.min(apart(one.at, other.at));
            }
        }
        nearest
    }
}

/// How far apart two places are, m.
pub(super) fn apart(one: Point, other: Point) -> f64 {
    let [x, y, h] = one;
    let [other_x, other_y, other_h] = other;
    (x - other_x).hypot(y - other_y).hypot(h - other_h)
}
