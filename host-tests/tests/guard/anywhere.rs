//! Motion guards of drones along a Tx-Rx line that turns. Drones are engaged and given back anywhere in the air.
//!
//! Drones move as behind the autopilot link: at most 5 m/s, slower close to the setpoint, with a lagging controller's overshoot.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | relays, separation | 2 to 8; 4 m to 20 m |
//! | stated position error | 0.5 m to 1.5 m in x, y and altitude: two fifths of it a bias, three tenths noise, the rest for the autopilot's lag |
//! | start | up to 3 separations apart across the line, 0 m to 2 separations apart along it; in 30 % two are in the wrong order |
//! | medium | loses 0 to 40 %, delays up to 2 s |
//! | pilots | take a drone with 30 %, fly it to anywhere within 5 separations of the chain, and give it back |
//! | reboots | a relay with 20 % |
//! | uploads | the line turns by up to 85 degrees once in 50 % of the flights, received by each relay up to 5 s late |

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::guard::{Fence, Guard};
use uav_relay::{Geofence, GuardConfig};
use uav_relay::{Placement, Side};
use uav_relay_oracle::random::seed;
use uav_relay_sim::simulator::drones::Point;

use crate::drone::{instant, length, node, way};
use crate::medium::{Faults, Medium};
use crate::world::beside;

const STEP_S: f64 = 0.1;
const SPEED: f64 = 5.0;

/// Acceleration limit of the target that the simulated autopilot follows, m/s².
const TARGET_ACCELERATION: f64 = 1.0;
const ACCELERATION: f64 = 3.0;

/// Longest time that a drone at full speed takes until it hovers, overshoot included, s.
const BRAKES_S: f64 = 8.0;

/// Time of the last fault of a simulated flight, s. The flight ends when all drones have arrived.
const ROUGH_S: f64 = 120.0;
/// Time by which all drones must have arrived, s; otherwise the flight fails.
const LAST_S: f64 = 900.0;

/// Line from Tx to Rx: its number, and its direction as a vector on the ground. All lines start at the same Tx.
#[derive(Clone, Copy, Debug)]
struct Line {
    number: u32,
    angle: f64,
}

impl Line {
    fn along(self, [x, y, h]: Point) -> Point {
        let (sin, cos) = self.angle.sin_cos();
        [x * cos + y * sin, y * cos - x * sin, h]
    }

    fn over_ground(self, [x, y, h]: Point) -> Point {
        let (sin, cos) = self.angle.sin_cos();
        [x * cos - y * sin, y * cos + x * sin, h]
    }
}

fn placement([x, y, h]: Point) -> Placement {
    make::placement(x as f32, y as f32, h as f32)
}

fn point(place: Placement) -> Point {
    [place.x_m, place.y_m, place.altitude_m].map(f64::from)
}

fn plus(a: Point, b: Point, share: f64) -> Point {
    [0, 1, 2].map(|part| a[part] + share * b[part])
}

#[derive(Debug)]
struct Drone {
    at: Point,
    velocity: Point,
    bias: Point,
    /// Point that the autopilot is following, m. Its coordinates refer to the ground, not to a line from Tx to Rx.
    target: Point,
    /// Velocity of the point that the autopilot is following, m/s.
    target_velocity: Point,
    guard: Guard,
    line: Line,
    agreed: Option<(u32, Point)>,
    /// Position to which the pilot flies the drone; `None` while its guard controls it.
    pilot: Option<Point>,
    reminder_s: f64,
    messages: u64,
}

impl Drone {
    fn taken_at(&self) -> Point {
        plus(self.at, self.bias, 1.0)
    }

    fn setpoint(&self) -> Option<Point> {
        let setpoint = self.guard.setpoint()?;
        Some(self.line.over_ground(point(setpoint)))
    }

    fn fly(&mut self) {
        let goal = match self.pilot {
            Some(goal) => Some(plus(goal, self.bias, 1.0)),
            None => self.setpoint(),
        };
        let before = self.target;
        if let Some(goal) = goal {
            let to = way(self.target, goal);
            let left = length(to);
            // Only the speed component toward the goal counts, as in the autopilot link's target.
            let toward: f64 = to
                .iter()
                .zip(self.target_velocity)
                .map(|(to, v)| to * v)
                .sum();
            let speed = (toward / left.max(1e-9)).max(0.0) + TARGET_ACCELERATION * STEP_S;
            let most = speed
                .min(SPEED)
                .min((2.0 * TARGET_ACCELERATION * left).sqrt());
            let share = if left > 0.0 {
                (most * STEP_S / left).min(1.0)
            } else {
                0.0
            };
            // The target turns no faster than its acceleration allows: the guard assumes straight flight.
            let change = way(self.target_velocity, to.map(|part| part * share / STEP_S));
            let part = (1.5 * TARGET_ACCELERATION * STEP_S / length(change).max(1e-9)).min(1.0);
            let velocity = plus(self.target_velocity, change, part);
            self.target = plus(self.target, velocity, STEP_S);
        } else {
            let speed = length(self.target_velocity);
            let left = (1.0 - 1.5 * TARGET_ACCELERATION * STEP_S / speed.max(1e-9)).max(0.0);
            self.target = plus(self.target, self.target_velocity, left * STEP_S);
        }
        self.target_velocity = way(before, self.target).map(|part| part / STEP_S);
        let off = way(self.taken_at(), self.target);
        let wanted = plus(self.target_velocity, off, 1.0);
        let change = way(self.velocity, wanted);
        let most = ACCELERATION * STEP_S;
        let share = (most / length(change).max(1e-9)).min(1.0);
        self.velocity = plus(self.velocity, change, share);
        self.at = plus(self.at, self.velocity, STEP_S);
    }
}

#[expect(
    clippy::struct_excessive_bools,
    reason = "how a flight ended, each for itself"
)]
#[derive(Debug, Default)]
struct Report {
    /// Smallest margin in the flight so far, m. The margin is the distance of two drones minus the minimum distance required of them.
    margin_m: f64,
    /// Drones with the smallest margin: their indices, their distance in m, and the time in s.
    nearest: Option<(usize, usize, f64, f64)>,
    in_order: bool,
    arrived: bool,
    told: bool,
    turned: bool,
    given_back: u64,
    end: String,
}

struct World {
    config: GuardConfig,
    drones: Vec<Drone>,
    medium: Medium,
    faults: Faults,
    now_s: f64,
    noise_m: f64,
    /// Distance required of each pair of drones, m, as set by `begin`. It is at most the separation.
    least_m: Vec<f64>,
    /// Time since which each drone has hovered under its pilot's control, s; infinite for other drones.
    hovers_s: Vec<f64>,
    /// Time when a drone first received the position of a hovering neighbour, s; infinite before. The neighbour
    /// hovers under its pilot's control.
    known_s: Vec<f64>,
    /// Distance required of a drone and a neighbour that hovers under its pilot's control, m. It applies from
    /// `BRAKES_S` after the time in `known_s`, because the drone must brake first.
    hovering_m: Vec<f64>,
    /// Indices of drones whose pilots give control back as soon as no other drone is passing them.
    later: Vec<usize>,
    /// Drones whose pilots gave control back in motion, and the times at which their braking ends, s. The distances
    /// of these drones are checked from then on.
    brakes: Vec<(usize, f64)>,
    rng: ChaCha8Rng,
}

impl World {
    fn pair(&self, k: usize, other: usize) -> usize {
        k * self.drones.len() + other
    }

    /// Sets the required distance of drone `k` from each other drone to the distance at present.
    ///
    /// The required distance is at most the separation.
    fn begin(&mut self, k: usize) {
        for other in 0..self.drones.len() {
            let apart = length(way(self.drones[k].at, self.drones[other].at));
            let least = apart.min(f64::from(self.config.separation_m));
            for pair in [self.pair(k, other), self.pair(other, k)] {
                self.least_m[pair] = least;
            }
        }
    }

    /// Returns true if another drone is about to pass drone `k`.
    fn is_in_the_way(&self, k: usize) -> bool {
        let (apart, at) = (f64::from(self.config.separation_m), self.drones[k].at);
        let flown = |drone: &&Drone| drone.pilot.is_none();
        self.drones.iter().filter(flown).any(|drone| {
            let Some(goal) = drone.setpoint() else {
                return false;
            };
            let (to, off) = (way(drone.at, goal), way(drone.at, at));
            let left = length(to);
            let dot: f64 = to.iter().zip(off).map(|(to, off)| to * off).sum();
            let share = (dot / (left * left).max(1e-9)).clamp(0.0, 1.0);
            left > 1.0 && length(way(plus(drone.at, to, share), at)) < apart + 15.0
        })
    }

    fn boot(&mut self, k: usize) {
        let links = beside(k, self.drones.len()).map(|link| link.map(node));
        let seed = self.rng.random();
        let drone = &mut self.drones[k];
        drone.guard = Guard::new(self.config, links, seed, instant(self.now_s));
        drone
            .guard
            .control(instant(self.now_s), drone.pilot.is_none());
        if let Some((_, place)) = drone.agreed.filter(|(line, _)| *line == drone.line.number) {
            drone.guard.set_goal(placement(place));
        }
    }

    fn step(&mut self, report: &mut Report) {
        self.now_s += STEP_S;
        let now = instant(self.now_s);
        for k in 0..self.drones.len() {
            let drone = &mut self.drones[k];
            drone.fly();
            let noise = [0; 3].map(|_| self.noise_m * self.rng.random_range(-1.0..=1.0));
            let said = drone.line.along(plus(drone.taken_at(), noise, 1.0));
            drone.guard.position(now, placement(said));
        }
        for message in self.medium.arrived(self.now_s) {
            let pair = self.pair(message.from, message.to);
            let drone = &mut self.drones[message.to];
            if drone.line.number == message.line {
                let is_place = message.fence.flags & Fence::UNPLACED != 0;
                if is_place && message.sent_s >= self.hovers_s[message.from] {
                    self.known_s[pair] = self.known_s[pair].min(self.now_s);
                }
                drone
                    .guard
                    .handle_fence(message.side, node(message.from), &message.fence);
            }
        }
        for k in 0..self.drones.len() {
            let drone = &mut self.drones[k];
            if self.now_s >= drone.reminder_s {
                drone.reminder_s = self.now_s + 1.0;
                drone.guard.remind();
            }
            let before = drone.guard.setpoint();
            if drone.guard.steer(now).is_some() && before.is_none() {
                // The autopilot's target starts at the drone's estimated position.
                drone.target = drone.taken_at();
            }
            while let Some((side, to, fence)) = drone.guard.poll() {
                drone.messages += 1;
                let from = match side {
                    Side::Upstream => Side::Downstream,
                    Side::Downstream => Side::Upstream,
                };
                let line = drone.line.number;
                let way = (k, usize::from(to) - 1, from);
                self.medium
                    .send(&mut self.rng, self.faults, self.now_s, way, (fence, line));
            }
        }
        self.brakes.retain(|(_, until_s)| self.now_s < *until_s);
        for k in 0..self.drones.len() {
            let drone = &self.drones[k];
            let moves =
                length(drone.velocity) > 0.3 || length(way(drone.taken_at(), drone.target)) > 1.0;
            if moves && self.brakes.iter().any(|(other, _)| *other == k) {
                self.begin(k);
            }
        }
        self.watch_pilots();
        self.check(report);
        if std::env::var_os("STORY").is_some()
            && ((self.now_s * 10.0).round() as u64).is_multiple_of(5)
        {
            self.print_state();
        }
    }

    /// Updates which drones hover under a pilot's control, and what distance their neighbours must keep.
    fn watch_pilots(&mut self) {
        for k in 0..self.drones.len() {
            let drone = &self.drones[k];
            let stands = length(drone.velocity) < 0.2;
            let hovers = drone.pilot.is_some() && stands;
            let since_s = self.hovers_s[k].min(self.now_s);
            self.hovers_s[k] = if hovers { since_s } else { f64::INFINITY };
            for other in beside(k, self.drones.len()).into_iter().flatten() {
                let pair = self.pair(k, other);
                let is_flown = self.drones[other].pilot.is_none();
                if !hovers || !is_flown {
                    self.known_s[pair] = f64::INFINITY;
                }
                let counts = self.now_s > self.known_s[pair] + BRAKES_S;
                let apart = length(way(self.drones[k].at, self.drones[other].at));
                let most = apart.min(f64::from(self.config.separation_m));
                let before = self.hovering_m[pair];
                self.hovering_m[pair] = match (counts, before.is_finite()) {
                    (false, _) => f64::INFINITY,
                    (true, false) => most,
                    (true, true) => before,
                };
            }
        }
    }

    /// Prints the time, and each drone's position, setpoint and hold reason on each side, for debugging.
    fn print_state(&self) {
        let each = self.drones.iter().map(|drone| {
            let at = drone.line.along(drone.at);
            let goal = drone.setpoint().map(|goal| drone.line.along(goal));
            let holds =
                [Side::Upstream, Side::Downstream].map(|side| drone.guard.hold_reason(side));
            format!(
                "[{:.1?} to {:.1?} {}{:?}]",
                at,
                goal,
                if drone.pilot.is_some() { "pilot " } else { "" },
                holds
            )
        });
        println!("{:.1} {}", self.now_s, each.collect::<Vec<_>>().join(" "));
    }

    fn check(&self, report: &mut Report) {
        let off_m = 2.0 * f64::from(self.config.hover_m);
        for k in 0..self.drones.len() {
            for other in 0..k {
                let (one, two) = (&self.drones[k], &self.drones[other]);
                let apart = length(way(one.at, two.at));
                let least_m = match (one.pilot, two.pilot) {
                    (None, None) => self.least_m[self.pair(k, other)],
                    (Some(_), None) => self.hovering_m[self.pair(k, other)],
                    (None, Some(_)) => self.hovering_m[self.pair(other, k)],
                    (Some(_), Some(_)) => continue,
                };
                if !least_m.is_finite() {
                    continue;
                }
                let margin = apart - (least_m - off_m);
                if margin < report.margin_m {
                    report.margin_m = margin;
                    report.nearest = Some((other + 1, k + 1, apart, self.now_s));
                }
            }
        }
    }
}

/// Draws agreed positions in order along x. Neighbours keep the separation along x; y and altitude are within the
/// geofence.
fn agreed(rng: &mut ChaCha8Rng, config: &GuardConfig, relays: usize) -> Vec<Point> {
    let distance = f64::from(config.geofence.most_x_m);
    let step = f64::from(config.separation_m) * 1.001;
    let slack = distance - step * relays as f64;
    let mut spare: Vec<f64> = (0..relays).map(|_| rng.random_range(0.0..=slack)).collect();
    spare.sort_by(f64::total_cmp);
    let across = [
        (config.geofence.least_y_m, config.geofence.most_y_m),
        (
            config.geofence.least_altitude_m,
            config.geofence.most_altitude_m,
        ),
    ];
    (0..relays)
        .map(|k| {
            let [y, h] =
                across.map(|(least, most)| rng.random_range(f64::from(least)..=f64::from(most)));
            [spare[k] + step * k as f64, y, h]
        })
        .collect()
}

fn config(rng: &mut ChaCha8Rng, relays: usize) -> GuardConfig {
    let separation = rng.random_range(4.0..=20.0);
    let room = if rng.random_bool(0.5) { 0.0 } else { 30.0 };
    GuardConfig {
        geofence: Geofence {
            least_x_m: 0.0,
            most_x_m: (separation * relays as f64 * rng.random_range(1.3..=6.0)) as f32,
            least_y_m: -room,
            most_y_m: room,
            least_altitude_m: 30.0,
            most_altitude_m: 30.0 + room,
        },
        separation_m: separation as f32,
        relays: relays as u16,
        hover_m: rng.random_range(0.5..=1.5),
        lag: Pace::default().stopping_time(),
    }
}

/// Draws start positions of drones: close together along x, with y and altitude equal or random.
fn starts(rng: &mut ChaCha8Rng, config: &GuardConfig, relays: usize) -> Vec<Point> {
    let apart = f64::from(config.separation_m);
    let step = apart
        * match rng.random_range(0..3) {
            0 => 0.05,
            1 => 0.5,
            _ => 2.0,
        };
    let wide = match rng.random_range(0..3) {
        0 => [0.0, 0.0],
        1 => [0.0, 3.0 * apart],
        _ => [3.0 * apart; 2],
    };
    let mut x = rng.random_range(-20.0..=0.5 * f64::from(config.geofence.most_x_m));
    let mut places: Vec<Point> = (0..relays)
        .map(|_| {
            x += step * rng.random_range(0.0..=1.0);
            let [y, h] = wide.map(|most| most * rng.random_range(-1.0..=1.0));
            [x, y, (60.0 + h).max(5.0)]
        })
        .collect();
    if rng.random_bool(0.3) {
        let (one, other) = (rng.random_range(0..relays), rng.random_range(0..relays));
        places.swap(one, other);
    }
    places
}

#[derive(Clone, Copy, Debug)]
enum FlightEvent {
    PilotTakesOver(usize, Point),
    GuardLearnsOfPilot(usize),
    PilotHandsBack(usize),
    Reboot(usize),
    Agree(u32, usize, Point),
    Turn(usize, Line),
}

fn agenda(rng: &mut ChaCha8Rng, config: &GuardConfig, relays: usize) -> Vec<(f64, FlightEvent)> {
    let mut plan = Vec::new();
    let mut agree = |rng: &mut ChaCha8Rng, line, at_s: f64| {
        for (k, place) in agreed(rng, config, relays).into_iter().enumerate() {
            let at_s = at_s + rng.random_range(0.0..=2.0);
            plan.push((at_s, FlightEvent::Agree(line, k, place)));
        }
    };
    agree(rng, 0, 0.0);
    if rng.random_bool(0.5) {
        let at_s = rng.random_range(5.0..100.0);
        agree(rng, 0, at_s);
    }
    let turns_s = rng.random_bool(0.5).then(|| rng.random_range(10.0..110.0));
    if let Some(turns_s) = turns_s {
        agree(rng, 1, turns_s + 5.0);
    }
    if let Some(turns_s) = turns_s {
        let most = f64::to_radians(85.0);
        let angle = rng.random_range(-most..=most);
        for k in 0..relays {
            let at_s = turns_s + rng.random_range(0.0..=5.0);
            plan.push((at_s, FlightEvent::Turn(k, Line { number: 1, angle })));
        }
    }
    let apart = f64::from(config.separation_m);
    for k in 0..relays {
        if rng.random_bool(0.3) {
            let at_s = rng.random_range(1.0..80.0);
            let to = [
                rng.random_range(-20.0..=f64::from(config.geofence.most_x_m)),
                rng.random_range(-5.0..=5.0) * apart,
                (40.0 + rng.random_range(-1.0..=5.0) * apart).max(5.0),
            ];
            plan.push((at_s, FlightEvent::PilotTakesOver(k, to)));
            plan.push((
                at_s + rng.random_range(0.0..=1.5),
                FlightEvent::GuardLearnsOfPilot(k),
            ));
            plan.push((
                at_s + rng.random_range(5.0..=60.0),
                FlightEvent::PilotHandsBack(k),
            ));
        }
        if rng.random_bool(0.2) {
            plan.push((rng.random_range(1.0..ROUGH_S), FlightEvent::Reboot(k)));
        }
    }
    plan.sort_by(|a, b| a.0.total_cmp(&b.0));
    plan
}

fn apply(world: &mut World, what: FlightEvent, report: &mut Report) {
    let now = instant(world.now_s);
    if std::env::var_os("STORY").is_some() {
        println!("{:.1} {what:?}", world.now_s);
    }
    match what {
        FlightEvent::PilotTakesOver(k, to) => {
            let drone = &mut world.drones[k];
            (drone.pilot, drone.target) = (Some(to), drone.taken_at());
        }
        FlightEvent::GuardLearnsOfPilot(k) => {
            let drone = &mut world.drones[k];
            drone.guard.control(now, drone.pilot.is_none());
        }
        FlightEvent::PilotHandsBack(k) => {
            if world.is_in_the_way(k) {
                world.later.push(k);
                return;
            }
            let drone = &mut world.drones[k];
            drone.pilot = None;
            drone.target = drone.taken_at();
            drone.guard.control(now, true);
            world.brakes.push((k, world.now_s + BRAKES_S));
            world.begin(k);
            report.given_back += 1;
        }
        FlightEvent::Reboot(k) => world.boot(k),
        FlightEvent::Agree(line, k, place) => {
            let drone = &mut world.drones[k];
            if line < drone.line.number {
                return;
            }
            drone.agreed = Some((line, place));
            if drone.line.number == line {
                drone.guard.set_goal(placement(place));
            }
        }
        FlightEvent::Turn(k, line) => {
            let drone = &mut world.drones[k];
            drone.line = line;
            drone.guard.leave_line(Some(now));
            if let Some((number, place)) = drone.agreed
                && number == line.number
            {
                drone.guard.set_goal(placement(place));
            }
            report.turned = true;
        }
    }
}

fn fly(seed: u64) -> Report {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let relays = rng.random_range(2..=8);
    let config = config(&mut rng, relays);
    let starts = starts(&mut rng, &config, relays);
    let plan = agenda(&mut rng, &config, relays);
    let error_m = f64::from(config.hover_m);
    let line = Line {
        number: 0,
        angle: 0.0,
    };
    let drones = starts.iter().map(|at| {
        let bias = [0; 3].map(|_| 0.4 * error_m * rng.random_range(-1.0..=1.0));
        let taken_at = plus(*at, bias, 1.0);
        Drone {
            at: *at,
            velocity: [0.0; 3],
            bias,
            target: taken_at,
            target_velocity: [0.0; 3],
            guard: Guard::new(config, [None; 2], 1, instant(0.0)),
            line,
            agreed: None,
            pilot: None,
            reminder_s: 0.0,
            messages: 0,
        }
    });
    let drones: Vec<Drone> = drones.collect();
    let faults = Faults {
        loss: rng.random_range(0.0..=0.4),
        twice: 0.05,
        delay_s: 20.0_f64.powf(rng.random_range(0.0..=1.0)) / 10.0,
    };
    let mut world = World {
        config,
        least_m: vec![0.0; relays * relays],
        drones,
        medium: Medium::default(),
        faults,
        now_s: 0.1,
        noise_m: 0.3 * error_m,
        hovers_s: vec![f64::INFINITY; relays],
        known_s: vec![f64::INFINITY; relays * relays],
        hovering_m: vec![f64::INFINITY; relays * relays],
        later: Vec::new(),
        brakes: Vec::new(),
        rng,
    };
    if std::env::var_os("STORY").is_some() {
        println!("{config:?} {faults:?}");
    }
    for k in 0..relays {
        world.boot(k);
        world.begin(k);
    }
    let mut report = Report {
        margin_m: f64::INFINITY,
        ..Report::default()
    };
    let mut plan = plan.into_iter().peekable();
    loop {
        while let Some((_, what)) = plan.next_if(|(at_s, _)| *at_s <= world.now_s) {
            apply(&mut world, what, &mut report);
        }
        for k in std::mem::take(&mut world.later) {
            apply(&mut world, FlightEvent::PilotHandsBack(k), &mut report);
        }
        world.step(&mut report);
        let all = world.drones.iter();
        report.arrived = plan.peek().is_none()
            && world.later.is_empty()
            && all.clone().all(|drone| drone.guard.has_arrived());
        if report.arrived || world.now_s > LAST_S {
            break;
        }
    }
    let sides = [Side::Upstream, Side::Downstream];
    let reasons = world
        .drones
        .iter()
        .map(|drone| sides.map(|side| drone.guard.hold_reason(side)));
    let reasons: Vec<_> = reasons.collect();
    report.told = reasons.iter().flatten().any(Option::is_some);
    let along = |drone: &Drone| drone.line.along(drone.at)[0];
    let off_m = 4.0 * error_m;
    report.in_order = world
        .drones
        .windows(2)
        .all(|pair| along(&pair[1]) - along(&pair[0]) > off_m);
    report.end = format!(
        "{reasons:?} {:?}",
        world
            .drones
            .iter()
            .map(|drone| drone.line.along(drone.at))
            .collect::<Vec<_>>()
    );
    report
}

#[test]
fn drones_that_begin_anywhere_keep_their_separation() {
    let first = seed(1);
    let count = crate::count();
    let all: Vec<(u64, Report)> = (first..first + count)
        .into_par_iter()
        .map(|seed| (seed, fly(seed)))
        .collect();
    let least = all
        .iter()
        .map(|(_, report)| report.margin_m)
        .fold(f64::INFINITY, f64::min);
    let share = |of: fn(&Report) -> bool| all.iter().filter(|(_, report)| of(report)).count();
    println!(
        "{count} flights: nearest {least:.2} m above the bound; {} arrived, {} with a line that turned, {} drones given back",
        share(|report| report.arrived),
        share(|report| report.turned),
        all.iter().map(|(_, report)| report.given_back).sum::<u64>(),
    );
    let near: Vec<_> = all
        .iter()
        .filter(|(_, report)| report.margin_m < -1e-3)
        .collect();
    let stuck: Vec<_> = all
        .iter()
        .filter(|(_, report)| !report.arrived && (report.in_order || !report.told))
        .collect();
    println!(
        "{} too near, {} stuck in order or without a reason",
        near.len(),
        stuck.len()
    );
    for (seed, report) in near.iter().take(5) {
        println!("near {seed}: {:?} {}", report.nearest, report.margin_m);
    }
    for (seed, report) in stuck.iter().take(5) {
        println!("stuck {seed}: {report:?}");
    }
    assert!(near.is_empty() && stuck.is_empty());
}
