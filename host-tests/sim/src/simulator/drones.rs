//! Drones that fly to where they are told as fast as they can, and know where they are only nearly.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::{Duration, Instant, Placement};

use uav_relay_scenario::number::narrow;

/// A place in the air: x, y and altitude, m.
pub type Point = [f64; 3];

/// A place as its point.
pub(super) fn point(place: Placement) -> Point {
    [place.x_m, place.y_m, place.altitude_m].map(f64::from)
}

/// A point as a place.
pub(super) fn placement(at: Point) -> Placement {
    let [x_m, y_m, altitude_m] = at.map(narrow);
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}

/// The stream of random numbers that errors of positions are drawn from.
const ERRORS: u64 = 2;

/// How drones fly.
#[derive(Clone, PartialEq, Debug)]
pub struct FlightSpec {
    /// Where each one hovers when it is switched on: x, y and altitude, m.
    pub start: Vec<Point>,
    /// How fast each one flies at most along each axis, m/s, above 0.
    pub speed_mps: Vec<f64>,
    /// How fast that changes at most, m/s^2, above 0; infinite for at once.
    pub acceleration_mps2: f64,
    /// A drone takes itself to be so far off where it is at most, along each axis and for the whole run, m.
    pub bias_m: f64,
    /// It says so far off where it takes itself to be at most, along each axis and each time anew, m.
    pub noise_m: f64,
    /// Between two steps of the flight.
    pub step: Duration,
    /// So many of them between two reports of where a drone is, at least 1.
    pub report_steps: u32,
}

impl FlightSpec {
    /// Drones that are at once as fast as they fly, and know where they are; they say so at each step.
    pub fn exact(start: Vec<Point>, speed_mps: Vec<f64>, step: Duration) -> Self {
        Self {
            start,
            speed_mps,
            acceleration_mps2: f64::INFINITY,
            bias_m: 0.0,
            noise_m: 0.0,
            step,
            report_steps: 1,
        }
    }

    /// Drones of 10 m/s and 3 m/s^2 that say five times a second where they are.
    pub fn multicopters(start: Vec<Point>, bias_m: f64, noise_m: f64) -> Self {
        Self {
            speed_mps: vec![10.0; start.len()],
            acceleration_mps2: 3.0,
            bias_m,
            noise_m,
            report_steps: 2,
            ..Self::exact(start, Vec::new(), Duration::from_millis(100))
        }
    }
}

/// What flies: each axis for itself, as fast as it may, so that it stops at its goal.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Where it is.
    pub at: Point,
    /// How fast, m/s.
    pub velocity_mps: Point,
}

impl Body {
    /// One that hovers.
    pub const fn hovering(at: Point) -> Self {
        Self {
            at,
            velocity_mps: [0.0; 3],
        }
    }

    /// Where it stops, if it brakes from now on.
    pub fn stops_at(&self, acceleration_mps2: f64) -> Point {
        let braked = self
            .velocity_mps
            .map(|speed| speed * speed.abs() / (2.0 * acceleration_mps2));
        sum(self.at, braked)
    }

    /// Flies toward `goal` for `step_s` seconds.
    pub fn fly(&mut self, goal: Point, speed_mps: f64, acceleration_mps2: f64, step_s: f64) {
        let axes = self.at.iter_mut().zip(&mut self.velocity_mps);
        for ((at, velocity), goal) in axes.zip(goal) {
            let way = goal - *at;
            // So fast it may be for this step, and stop in time after it.
            let most = if acceleration_mps2.is_finite() {
                let brakes = 2.0 * way.abs() / acceleration_mps2;
                acceleration_mps2 * ((step_s * step_s + brakes).sqrt() - step_s)
            } else {
                way.abs() / step_s
            };
            let wanted = most.min(speed_mps).copysign(way);
            let change = acceleration_mps2 * step_s;
            *velocity = wanted.clamp(*velocity - change, *velocity + change);
            *at += *velocity * step_s;
            if (goal - *at).abs() < 1e-6 && velocity.abs() <= change {
                (*at, *velocity) = (goal, 0.0);
            }
        }
    }
}

/// Two drones when they were nearest to each other.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Nearest {
    /// How far apart they were, m.
    pub apart_m: f64,
    /// Which ones, from 1.
    pub pair: [usize; 2],
    /// When.
    pub at: Instant,
}

impl Nearest {
    /// The two of `places` that are nearest to each other at `now`; none of fewer than two.
    pub(super) fn of(places: &[Point], now: Instant) -> Option<Self> {
        let mut nearest: Option<Self> = None;
        for (one, at) in places.iter().enumerate() {
            for (other, beside) in places.iter().enumerate().skip(one + 1) {
                let apart_m = apart(*at, *beside);
                if nearest.is_none_or(|least| apart_m < least.apart_m) {
                    nearest = Some(Self {
                        apart_m,
                        pair: [one + 1, other + 1],
                        at: now,
                    });
                }
            }
        }
        nearest
    }
}

/// The drones of a run.
#[derive(Debug)]
pub(super) struct Flight {
    pub(super) drones: Vec<Drone>,
    pub(super) step: Duration,
    report_steps: u32,
    steps: u32,
    rng: ChaCha8Rng,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Drone {
    body: Body,
    pub(super) goal: Point,
    speed_mps: f64,
    acceleration_mps2: f64,
    bias: Point,
    noise_m: f64,
}

impl Drone {
    /// Flies to its goal for `step_s` seconds: to where it takes that to be.
    pub(super) fn fly(&mut self, step_s: f64) {
        let goal = sum(self.goal, self.bias.map(|part| -part));
        self.body
            .fly(goal, self.speed_mps, self.acceleration_mps2, step_s);
    }

    /// Where it takes itself to be.
    pub(super) fn taken(&self) -> Point {
        sum(self.body.at, self.bias)
    }
}

impl Flight {
    pub(super) fn new(spec: &FlightSpec, seed: u64) -> Self {
        // Not the generator of the run: what is drawn there does not depend on how drones fly.
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(ERRORS);
        let drones = spec.start.iter().zip(&spec.speed_mps);
        let drones = drones
            .map(|(&at, &speed_mps)| {
                let bias = off(&mut rng, spec.bias_m);
                Drone {
                    body: Body::hovering(at),
                    goal: sum(at, bias),
                    speed_mps,
                    acceleration_mps2: spec.acceleration_mps2,
                    bias,
                    noise_m: spec.noise_m,
                }
            })
            .collect();
        Self {
            drones,
            step: spec.step,
            report_steps: spec.report_steps,
            steps: 0,
            rng,
        }
    }

    /// One more step; whether drones say where they are at its end.
    pub(super) fn go_on(&mut self) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "some milliseconds")]
        let step_s = self.step.as_micros() as f64 / 1e6;
        for drone in &mut self.drones {
            drone.fly(step_s);
        }
        self.steps = self.steps.wrapping_add(1);
        self.steps.is_multiple_of(self.report_steps.max(1))
    }

    /// Where drone `index` (from 0) says it is.
    pub(super) fn reported(&mut self, index: usize) -> Option<Point> {
        let drone = self.drones.get(index)?;
        let noise = off(&mut self.rng, drone.noise_m);
        Some(sum(drone.taken(), noise))
    }

    /// The two drones that are nearest to each other at `now`; none of fewer than two.
    pub(super) fn nearest(&self, now: Instant) -> Option<Nearest> {
        let places: Vec<Point> = self.drones.iter().map(|drone| drone.body.at).collect();
        Nearest::of(&places, now)
    }
}

/// At most `most_m` along each axis.
fn off(rng: &mut ChaCha8Rng, most_m: f64) -> Point {
    [0; 3].map(|_| most_m * rng.random_range(-1.0..=1.0))
}

pub(super) fn sum(one: Point, other: Point) -> Point {
    let [x, y, h] = one;
    let [more_x, more_y, more_h] = other;
    [x + more_x, y + more_y, h + more_h]
}

/// How far apart two places are, m.
pub fn apart(one: Point, other: Point) -> f64 {
    let [x, y, h] = one;
    let [other_x, other_y, other_h] = other;
    libm::hypot(libm::hypot(x - other_x, y - other_y), h - other_h)
}
