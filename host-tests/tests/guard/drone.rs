//! Simulated drone: its motion, its flight controller's setpoints and reports, and its guard.

use std::collections::VecDeque;

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::RngExt;
use uav_relay::GuardConfig;
use uav_relay::guard::Guard;
use uav_relay::{Instant, Placement, Side};
use uav_relay_sim::simulator::drones::{Body, Point};

pub(crate) fn instant(at_s: f64) -> Instant {
    Instant::from_micros((at_s * 1e6).round() as u64)
}

pub(crate) fn way(from: Point, to: Point) -> Point {
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

pub(crate) fn length([dx, dy, dh]: Point) -> f64 {
    dx.hypot(dy).hypot(dh)
}

/// Returns the point at the fraction `share` of the vector `way` from `at`: `at` + `share` * `way`.
pub(crate) fn along(at: Point, way: Point, share: f64) -> Point {
    [0, 1, 2].map(|part| at[part] + share * way[part])
}

#[derive(Debug)]
pub(crate) struct Drone {
    pub(crate) body: Body,
    /// Position of the drone one time step earlier.
    pub(crate) was: Point,
    /// Point to which the flight controller is flying the drone.
    goal: Point,
    /// Setpoints in transit to the flight controller: arrival time in s, and point.
    orders: VecDeque<(f64, Point)>,
    /// Position reports in transit to the guard: times of measurement and of arrival in s, and position.
    reports: VecDeque<(f64, f64, Point)>,
    pub(crate) speed: f64,
    /// Acceleration limit of the drone, m/s².
    pub(crate) acceleration: f64,
    /// Delay of setpoints to the flight controller, s. It is at most the guard's `lag`.
    pub(crate) latency_s: f64,
    /// Motion guard of the drone; `None` while the relay is switched off.
    pub(crate) guard: Option<Guard>,
    /// First setpoint that the guard gave after it had none; `None` while the guard has no setpoint.
    begun: Option<Placement>,
    /// Indices of the drones with which the relay has links, toward Tx and toward Rx. `None` stands for no link.
    pub(crate) links: [Option<usize>; 2],
    pub(crate) flies: bool,
    /// True while the radio of the drone works, so that it sends and receives.
    pub(crate) speaks: bool,
    /// True while the pilot flies the drone, so that the guard's setpoint is ignored.
    pub(crate) taken: bool,
    /// True for each side whose neighbour has been informed that the pilot flies this drone.
    pub(crate) told: [bool; 2],
    /// Range of x that both neighbours keep clear, because they know that the pilot flies this drone.
    pub(crate) clear: (f64, f64),
    taken_s: f64,
    /// Session numbers that this drone's guard last sent to the neighbours toward Tx and Rx. A reply is valid only if
    /// it repeats the number.
    pub(crate) said: [u16; 2],
    next_report_s: f64,
    next_reminder_s: f64,
    pub(crate) messages: u64,
}

/// Timing of the flight controller's position reports.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Board {
    /// Longest interval between two position reports of the drone, s.
    pub(crate) every_s: f64,
    /// Greatest age of a position report on its arrival, s.
    pub(crate) stale_s: f64,
}

impl Drone {
    pub(crate) fn hovering(at: Point, links: [Option<usize>; 2]) -> Self {
        Self {
            body: Body::hovering(at),
            was: at,
            goal: at,
            orders: VecDeque::new(),
            reports: VecDeque::new(),
            speed: 0.0,
            acceleration: f64::INFINITY,
            latency_s: f64::INFINITY,
            guard: None,
            begun: None,
            links,
            flies: true,
            speaks: true,
            taken: false,
            told: [false; 2],
            clear: (f64::NEG_INFINITY, f64::INFINITY),
            taken_s: 0.0,
            said: [0; 2],
            next_report_s: 0.0,
            next_reminder_s: 0.0,
            messages: 0,
        }
    }

    /// Creates the guard with the neighbours in `mission`, then sets the neighbours in `links`.
    pub(crate) fn boot(
        &mut self,
        config: GuardConfig,
        mission: [Option<usize>; 2],
        seed: u32,
        now_s: f64,
    ) {
        let mut guard = Guard::new(
            config,
            mission.map(|link| link.map(node)),
            seed,
            instant(now_s),
        );
        for (side, link) in [Side::Upstream, Side::Downstream]
            .into_iter()
            .zip(self.links)
        {
            guard.set_neighbour(side, link.map(node));
        }
        guard.control(instant(now_s), !self.taken);
        self.guard = Some(guard);
    }

    /// Gives control of the drone to its pilot. The drone brakes and hovers where it stops.
    pub(crate) fn pilot_takes_over(&mut self, now_s: f64) {
        self.taken = true;
        self.taken_s = now_s;
        self.clear = (f64::NEG_INFINITY, f64::INFINITY);
        self.told = self.links.map(|link| link.is_none());
        self.orders.clear();
        self.goal = self.body.stops_at(self.acceleration);
    }

    /// Records that the neighbour on `side` knows of the pilot's takeover by a message sent at `sent_s`.
    ///
    /// From then on the neighbour stays within `(low, high)` along x.
    pub(crate) fn is_known(&mut self, side: usize, sent_s: f64, (low, high): (f64, f64)) {
        if sent_s >= self.taken_s && !self.told[side] {
            self.told[side] = true;
            match side {
                0 => self.clear.0 = high,
                _ => self.clear.1 = low,
            }
        }
    }

    /// Returns the point where the drone hovers or will stop.
    pub(crate) const fn stopped(&self) -> Point {
        self.goal
    }

    /// Moves the hovering point by `way_m` along axis `part`, as the pilot does. The axis is 0 for x, 1 for y or 2
    /// for altitude.
    pub(crate) fn aside(&mut self, part: usize, way_m: f64) {
        self.goal[part] += way_m;
    }

    /// Ends the pilot's control. The drone hovers where it stops, and follows its setpoints from then on.
    pub(crate) fn pilot_hands_back(&mut self, now_s: f64) {
        if core::mem::take(&mut self.taken) {
            self.goal = self.body.stops_at(self.acceleration);
            self.is_flown(now_s);
        }
    }

    /// Informs the guard whether the drone follows setpoints or its pilot flies it.
    pub(crate) fn is_flown(&mut self, now_s: f64) {
        if let Some(guard) = &mut self.guard {
            guard.control(instant(now_s), !self.taken);
            assert!(!self.taken || guard.setpoint().is_none());
        }
    }

    pub(crate) fn fly(&mut self, now_s: f64, step_s: f64) {
        while self.orders.front().is_some_and(|(due, _)| *due <= now_s) {
            self.goal = self.orders.pop_front().unwrap().1;
        }
        self.was = self.body.at;
        self.body
            .fly(self.goal, self.speed, self.acceleration, step_s);
    }

    /// Measures the drone's position if a report is due, and delivers the arrived reports to the guard.
    pub(crate) fn report(&mut self, rng: &mut ChaCha8Rng, board: Board, hover_m: f64, now_s: f64) {
        if now_s >= self.next_report_s {
            self.next_report_s = now_s + rng.random_range(0.02..=1.0) * board.every_s;
            let off = hover_m * rng.random_range(-1.0..=1.0);
            let arrives_s = now_s + rng.random_range(0.0..=1.0) * board.stale_s;
            let [x, y, h] = self.body.at;
            self.reports.push_back((now_s, arrives_s, [x + off, y, h]));
        }
        while self.reports.front().is_some_and(|report| report.1 <= now_s) {
            let (at_s, _, at) = self.reports.pop_front().unwrap();
            if let Some(guard) = &mut self.guard {
                guard.position(instant(at_s), place(at));
            }
        }
    }

    /// Gets the setpoint from the guard, and sends it, if changed, to the flight controller with a delay.
    pub(crate) fn steer(&mut self, rng: &mut ChaCha8Rng, config: &GuardConfig, now_s: f64) {
        let Some(guard) = &mut self.guard else {
            return;
        };
        let before = guard.setpoint();
        if before.is_none() {
            self.begun = None;
        }
        let after = guard.steer(instant(now_s));
        assert_eq!(after, guard.setpoint());
        let Some(setpoint) = after.filter(|_| after != before && !self.taken) else {
            return;
        };
        // The setpoint starts at the drone's position and enters the permitted box as soon as it may.
        let begun = *self.begun.get_or_insert(setpoint);
        let fence = config.geofence;
        for (is, begun, least, most) in [
            (setpoint.x_m, begun.x_m, fence.least_x_m, fence.most_x_m),
            (setpoint.y_m, begun.y_m, fence.least_y_m, fence.most_y_m),
            (
                setpoint.altitude_m,
                begun.altitude_m,
                fence.least_altitude_m,
                fence.most_altitude_m,
            ),
        ] {
            assert!(
                (least.min(begun)..=most.max(begun)).contains(&is),
                "{setpoint:?}"
            );
        }
        let lag_s = self.latency_s.min(config.lag.as_micros() as f64 / 1e6);
        // Setpoints arrive in the order in which they were sent.
        let before_s = self.orders.back().map_or(0.0, |order| order.0);
        let due_s = (now_s + lag_s * rng.random_range(0.0..=0.99)).max(before_s);
        let point = [setpoint.x_m, setpoint.y_m, setpoint.altitude_m].map(f64::from);
        self.orders.push_back((due_s, point));
    }

    /// Makes the guard repeat its messages once per second, because messages may be lost.
    pub(crate) fn reminded(&mut self, now_s: f64) {
        if now_s >= self.next_reminder_s {
            self.next_reminder_s = now_s + 1.0;
            if let Some(guard) = &mut self.guard {
                guard.remind();
            }
        }
    }

    /// Returns the ranges of x, y and altitude in which the drone may be before new setpoints arrive.
    pub(crate) fn possible_ranges(&self) -> [(f64, f64); 3] {
        let stop = self.body.stops_at(self.acceleration);
        [0, 1, 2].map(|part| {
            let orders = self.orders.iter().map(|(_, order)| order[part]);
            let at = [self.body.at, stop, self.goal].map(|point| point[part]);
            at.into_iter()
                .chain(orders)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                    (low.min(at), high.max(at))
                })
        })
    }
}

pub(crate) fn node(k: usize) -> u16 {
    k as u16 + 1
}

pub(crate) fn place(at: Point) -> Placement {
    let [x_m, y_m, altitude_m] = at.map(|part| part as f32);
    make::placement(x_m, y_m, altitude_m)
}
