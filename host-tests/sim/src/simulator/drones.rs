//! Simple drones with speed and acceleration limits and position errors.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{Duration, Instant, Placement};

use uav_relay_scenario::number::narrow;

/// Position [x, y, height], m. x is from Tx toward Rx, y to the right as seen from Tx.
pub type Point = [f64; 3];

/// Converts a relay's placement to a position in f64.
pub fn point(place: Placement) -> Point {
    [place.x_m, place.y_m, place.altitude_m].map(f64::from)
}

pub(crate) fn placement(at: Point) -> Placement {
    let [x_m, y_m, altitude_m] = at.map(narrow);
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}

/// Number of the random-number stream from which the drones' position errors are drawn.
const ERRORS: u64 = 2;

/// Bound on the constant error of a drone's reported position, m.
pub const BIAS_M: f64 = 0.5;
/// Bound on the random error of a drone's reported position, m.
pub const NOISE_M: f64 = 0.3;
/// Standard deviation of the gusts, m/s per axis.
pub const GUST_MPS: f64 = 0.3;

/// Largest distance of a hovering drone's reported position from its setpoint, m.
///
/// It allows for the errors of the position and for gusts.
pub const HOVER_M: f32 = 1.5;

/// Parameters of simple drones, which fly to their setpoints without an autopilot.
#[derive(Clone, PartialEq, Debug)]
pub struct FlightSpec {
    /// Initial hover position of each drone: x, y and altitude, m; relay 1 first.
    pub start: Vec<Point>,
    /// Maximum speed of each drone per axis, m/s, above 0; relay 1 first.
    pub speed_mps: Vec<f64>,
    /// Largest acceleration of each drone per axis, m/s^2, above 0. Infinite for instant changes of speed.
    pub acceleration_mps2: f64,
    /// Bound on each drone's constant position error per axis, m.
    pub bias_m: f64,
    /// Bound on the additional error of each position report per axis, m.
    pub noise_m: f64,
    /// Time step of the flight simulation.
    pub step: Duration,
    /// Number of time steps between two position reports, at least 1.
    pub report_steps: u32,
}

impl FlightSpec {
    /// Creates the parameters of drones with unlimited acceleration and exact positions.
    ///
    /// They report their positions at each time step.
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

    /// Creates the parameters of drones with a speed of 10 m/s and an acceleration of 3 m/s^2.
    ///
    /// They report their positions five times a second.
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

/// Point mass that flies to a goal and stops there, with limited speed and acceleration per axis.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// True position of the simulated drone, m.
    pub at: Point,
    /// True velocity of the simulated drone, m/s.
    pub velocity_mps: Point,
}

impl Body {
    /// Creates a body at rest at the position `at`.
    pub const fn hovering(at: Point) -> Self {
        Self {
            at,
            velocity_mps: [0.0; 3],
        }
    }

    /// Returns the position where the body comes to rest if it brakes from now on.
    pub fn stops_at(&self, acceleration_mps2: f64) -> Point {
        let braked = self
            .velocity_mps
            .map(|speed| speed * speed.abs() / (2.0 * acceleration_mps2));
        sum(self.at, braked)
    }

    /// Moves the body toward `goal` for `step_s` seconds. `speed_mps` and `acceleration_mps2` are the limits per axis.
    pub fn fly(&mut self, goal: Point, speed_mps: f64, acceleration_mps2: f64, step_s: f64) {
        let axes = self.at.iter_mut().zip(&mut self.velocity_mps);
        for ((at, velocity), goal) in axes.zip(goal) {
            let way = goal - *at;
            // Largest speed in this time step that still allows stopping at the goal.
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

/// Closest approach of two drones: the drones, their distance, and the time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Nearest {
    /// Smallest distance of the two drones, m.
    pub apart_m: f64,
    /// Indices of the two drones, from 1.
    pub pair: [usize; 2],
    /// Time of the closest approach of the two drones.
    pub at: Instant,
}

impl Nearest {
    /// Finds the two closest of `places`, the drones' positions at `now`; `None` for fewer than two.
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
    /// Moves the drone toward `goal` for `step_s` seconds. The drone navigates by its own position estimate.
    pub(super) fn fly(&mut self, step_s: f64) {
        let goal = sum(self.goal, self.bias.map(|part| -part));
        self.body
            .fly(goal, self.speed_mps, self.acceleration_mps2, step_s);
    }

    /// Returns the true position of the drone, m.
    pub(super) const fn at(&self) -> Point {
        self.body.at
    }

    /// Returns true while the drone moves.
    pub(super) fn moves(&self) -> bool {
        self.body.velocity_mps.iter().any(|v| v.abs() > 0.01)
    }

    /// Sets the largest speed of the drone per axis, m/s.
    pub(super) const fn set_speed(&mut self, speed_mps: f64) {
        self.speed_mps = speed_mps;
    }

    /// Puts the drone on the ground at the position `at`.
    pub(super) fn put(&mut self, at: Point) {
        self.body = Body::hovering(at);
    }

    /// Returns the drone's own position estimate: the true position plus the drone's constant error.
    pub(super) fn estimated_position(&self) -> Point {
        sum(self.body.at, self.bias)
    }
}

impl Flight {
    pub(super) fn new(spec: &FlightSpec, seed: u64) -> Self {
        // Separate generator, so that the run's other draws do not depend on the flight.
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(ERRORS);
        let drones = spec.start.iter().zip(&spec.speed_mps);
        let drones = drones
            .map(|(&at, &speed_mps)| {
                let bias = random_error(&mut rng, spec.bias_m);
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

    /// Moves all drones for one time step. Returns true if a position report of the drones is due after this step.
    pub(super) fn go_on(&mut self) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "some milliseconds")]
        let step_s = self.step.as_micros() as f64 / 1e6;
        for drone in &mut self.drones {
            drone.fly(step_s);
        }
        self.steps = self.steps.wrapping_add(1);
        self.steps.is_multiple_of(self.report_steps.max(1))
    }

    /// Returns the position that drone `index` (from 0) reports, m. It is the true position plus a constant and a
    /// random error.
    ///
    /// `None` if there is no such drone.
    pub(super) fn reported(&mut self, index: usize) -> Option<Point> {
        let drone = self.drones.get(index)?;
        let noise = random_error(&mut self.rng, drone.noise_m);
        Some(sum(drone.estimated_position(), noise))
    }

    /// Returns the true position of drone `index` (from 0); `None` if there is no such drone.
    pub(super) fn true_position(&self, index: usize) -> Option<Point> {
        Some(self.drones.get(index)?.body.at)
    }

    pub(super) fn nearest(&self, now: Instant) -> Option<Nearest> {
        let places: Vec<Point> = self.drones.iter().map(|drone| drone.body.at).collect();
        Nearest::of(&places, now)
    }
}

/// Draws a random position error of at most `most_m` metres per axis.
fn random_error(rng: &mut ChaCha8Rng, most_m: f64) -> Point {
    [0; 3].map(|_| most_m * rng.random_range(-1.0..=1.0))
}

pub(super) fn sum(one: Point, other: Point) -> Point {
    let [x, y, h] = one;
    let [more_x, more_y, more_h] = other;
    [x + more_x, y + more_y, h + more_h]
}

/// Returns the distance between two points, m.
pub fn apart(one: Point, other: Point) -> f64 {
    let [x, y, h] = one;
    let [other_x, other_y, other_h] = other;
    libm::hypot(libm::hypot(x - other_x, y - other_y), h - other_h)
}
