//! One drone: where it is, what its flight controller was told, and its guard.

use std::collections::VecDeque;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use uav_relay::GuardConfig;
use uav_relay::guard::Guard;
use uav_relay::{Instant, Placement, Side};
use uav_relay_sim::simulator::drones::{Body, Point};

pub(crate) fn instant(at_s: f64) -> Instant {
    Instant::from_micros((at_s * 1e6).round() as u64)
}

/// From one place to another, m.
pub(crate) fn way(from: Point, to: Point) -> Point {
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

/// How long that is, m.
pub(crate) fn length([dx, dy, dh]: Point) -> f64 {
    dx.hypot(dy).hypot(dh)
}

/// As far from `at` as `share` of `way` leads.
pub(crate) fn along(at: Point, way: Point, share: f64) -> Point {
    [0, 1, 2].map(|part| at[part] + share * way[part])
}

#[derive(Debug)]
pub(crate) struct Drone {
    pub(crate) body: Body,
    /// Where it was a step before.
    pub(crate) was: Point,
    /// What the flight controller flies to.
    goal: Point,
    /// Setpoints on their way there: when each gets there.
    orders: VecDeque<(f64, Point)>,
    /// Positions on their way to the guard: when each was measured, when each gets there.
    reports: VecDeque<(f64, f64, Point)>,
    pub(crate) speed: f64,
    /// How fast that changes, m/s^2.
    pub(crate) acceleration: f64,
    /// How long a setpoint is on its way, s: at most the guard's lag.
    pub(crate) latency_s: f64,
    /// `None` while it is switched off.
    pub(crate) guard: Option<Guard>,
    /// First setpoint since it had none.
    begun: Option<Placement>,
    /// Which nodes are its neighbours.
    pub(crate) links: [Option<usize>; 2],
    /// Whether it is in the air.
    pub(crate) flies: bool,
    /// Whether its radio works.
    pub(crate) speaks: bool,
    /// Whether its pilot has it: what the guard says is ignored.
    pub(crate) taken: bool,
    /// Whether the neighbours toward Tx and Rx have heard so.
    pub(crate) told: [bool; 2],
    /// Where those beyond may be since, along x.
    pub(crate) clear: (f64, f64),
    taken_s: f64,
    /// The numbers of the associations in which it has spoken last.
    pub(crate) said: [u16; 2],
    next_report_s: f64,
    next_reminder_s: f64,
    pub(crate) messages: u64,
}

/// How its flight controller is connected.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Board {
    /// Between two reports, at most, s.
    pub(crate) every_s: f64,
    /// How old one may be when it arrives, s.
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

    /// Switches the guard on: it begins with the neighbours of the mission and hears at once who is linked to it now.
    pub(crate) fn boot(
        &mut self,
        confines: GuardConfig,
        mission: [Option<usize>; 2],
        seed: u32,
        now_s: f64,
    ) {
        let mut guard = Guard::new(
            confines,
            mission.map(|link| link.map(node)),
            seed,
            instant(now_s),
        );
        for (side, link) in [Side::Upstream, Side::Downstream]
            .into_iter()
            .zip(self.links)
        {
            guard.link(side, link.map(node));
        }
        guard.control(instant(now_s), !self.taken);
        self.guard = Some(guard);
    }

    /// Its pilot takes it: it brakes, and hovers where it stops.
    pub(crate) fn take(&mut self, now_s: f64) {
        self.taken = true;
        self.taken_s = now_s;
        self.clear = (f64::NEG_INFINITY, f64::INFINITY);
        self.told = self.links.map(|link| link.is_none());
        self.orders.clear();
        self.goal = self.body.stops_at(self.acceleration);
    }

    /// The neighbour at that side has heard, by a message of that time, that it is not flown: from then on it goes no farther than
    /// `(low, high)`.
    pub(crate) fn is_known(&mut self, side: usize, sent_s: f64, (low, high): (f64, f64)) {
        if sent_s >= self.taken_s && !self.told[side] {
            self.told[side] = true;
            match side {
                0 => self.clear.0 = high,
                _ => self.clear.1 = low,
            }
        }
    }

    /// Where it hovers, or will.
    pub(crate) const fn stopped(&self) -> Point {
        self.goal
    }

    /// Its pilot moves it by `way_m` along the axis `part`.
    pub(crate) fn aside(&mut self, part: usize, way_m: f64) {
        self.goal[part] += way_m;
    }

    /// Its pilot gives it back: it hovers where it stops, and flies to its setpoints from then on.
    pub(crate) fn give(&mut self, now_s: f64) {
        if core::mem::take(&mut self.taken) {
            self.goal = self.body.stops_at(self.acceleration);
            self.is_flown(now_s);
        }
    }

    /// Its guard hears who flies it.
    pub(crate) fn is_flown(&mut self, now_s: f64) {
        if let Some(guard) = &mut self.guard {
            guard.control(instant(now_s), !self.taken);
            assert!(!self.taken || guard.setpoint().is_none());
        }
    }

    /// Flies on for a step.
    pub(crate) fn fly(&mut self, now_s: f64, step_s: f64) {
        while self.orders.front().is_some_and(|(due, _)| *due <= now_s) {
            self.goal = self.orders.pop_front().unwrap().1;
        }
        self.was = self.body.at;
        self.body
            .fly(self.goal, self.speed, self.acceleration, step_s);
    }

    /// Has the flight controller report, and hands the guard what has arrived.
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

    /// Has the guard move the setpoint, and the flight controller hear of it soon.
    pub(crate) fn steer(&mut self, rng: &mut ChaCha8Rng, confines: &GuardConfig, now_s: f64) {
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
        // It begins where it is, and comes into the box as soon as it may.
        let begun = *self.begun.get_or_insert(setpoint);
        let fence = confines.fence;
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
        let lag_s = self.latency_s.min(confines.lag.as_micros() as f64 / 1e6);
        // In the order in which they were given.
        let before_s = self.orders.back().map_or(0.0, |order| order.0);
        let due_s = (now_s + lag_s * rng.random_range(0.0..=0.99)).max(before_s);
        let point = [setpoint.x_m, setpoint.y_m, setpoint.altitude_m].map(f64::from);
        self.orders.push_back((due_s, point));
    }

    /// Whether it is time to tell everything again.
    pub(crate) fn reminded(&mut self, now_s: f64) {
        if now_s >= self.next_reminder_s {
            self.next_reminder_s = now_s + 1.0;
            if let Some(guard) = &mut self.guard {
                guard.remind();
            }
        }
    }

    /// From the lowest to the highest x, y and altitude where it may be from now on if nobody tells it anything any more.
    pub(crate) fn stretch(&self) -> [(f64, f64); 3] {
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

/// The node number of drone `k`.
pub(crate) fn node(k: usize) -> u16 {
    k as u16 + 1
}

pub(crate) fn place(at: Point) -> Placement {
    let [x_m, y_m, altitude_m] = at.map(|part| part as f32);
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}
