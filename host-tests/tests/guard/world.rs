//! Drones, the medium between them, and the distance check at every step.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::GuardConfig;
use uav_relay::Side;
use uav_relay::guard::Fence;

use uav_relay_sim::simulator::drones::Point;

use crate::drone::{Board, Drone, along, length, node, way};
use crate::medium::{Faults, Medium};

pub(crate) const STEP_S: f64 = 0.1;

#[derive(Debug)]
pub(crate) struct World {
    pub(crate) seed: u64,
    pub(crate) rng: ChaCha8Rng,
    pub(crate) now_s: f64,
    pub(crate) config: GuardConfig,
    pub(crate) drones: Vec<Drone>,
    medium: Medium,
    pub(crate) faults: Faults,
    pub(crate) board: Board,
    /// Smallest margin so far, m: the distance of two drones minus the distance that they must keep.
    pub(crate) closest_m: f64,
    pub(crate) steps: u64,
}

impl World {
    pub(crate) fn new(seed: u64, config: GuardConfig, starts: &[Point]) -> Self {
        let links = |k| beside(k, starts.len());
        let mut world = Self {
            seed,
            rng: ChaCha8Rng::seed_from_u64(seed),
            now_s: 1.0,
            config,
            drones: (0..starts.len())
                .map(|k| Drone::hovering(starts[k], links(k)))
                .collect(),
            medium: Medium::default(),
            faults: Faults {
                loss: 0.0,
                twice: 0.0,
                delay_s: 0.1,
            },
            board: Board {
                every_s: 0.2,
                stale_s: 0.1,
            },
            closest_m: f64::INFINITY,
            steps: 0,
        };
        for k in 0..starts.len() {
            world.boot(k);
        }
        world
    }

    pub(crate) fn boot(&mut self, k: usize) {
        let seed = self.rng.random();
        let mission = beside(k, self.drones.len());
        self.drones[k].boot(self.config, mission, seed, self.now_s);
    }

    pub(crate) fn link(&mut self, k: usize, side: Side, neighbour: Option<usize>) {
        let drone = &mut self.drones[k];
        drone.links[usize::from(side == Side::Downstream)] = neighbour;
        if let Some(guard) = &mut drone.guard {
            guard.set_neighbour(side, neighbour.map(node));
        }
    }

    /// Returns the permitted shortfall of the separation, m: four position errors and f32 rounding.
    pub(crate) fn allowed_m(&self) -> f64 {
        let rounding = f64::from(self.config.geofence.most_x_m) * f64::from(f32::EPSILON);
        4.0 * f64::from(self.config.hover_m) + 8.0 * rounding
    }

    pub(crate) fn step(&mut self) {
        self.now_s += STEP_S;
        let now_s = self.now_s;
        for drone in self.drones.iter_mut().filter(|drone| drone.flies) {
            drone.fly(now_s, STEP_S);
            drone.report(
                &mut self.rng,
                self.board,
                f64::from(self.config.hover_m),
                now_s,
            );
        }
        let mut tell = Vec::new();
        for message in self.medium.arrived(now_s) {
            let drone = &mut self.drones[message.to];
            if let Some(guard) = drone.guard.as_mut().filter(|_| drone.speaks && drone.flies) {
                guard.handle_fence(message.side, node(message.from), &message.fence);
                let side = usize::from(message.side == Side::Downstream);
                // Only a message of the present association counts.
                let told = message.fence.flags & Fence::LEFT != 0
                    && message.fence.echo == drone.said[side];
                tell.extend(told.then_some((message, drone.possible_ranges()[0])));
                // The setpoint may be read at any time between two messages.
                if self.rng.random_bool(0.5) {
                    drone.steer(&mut self.rng, &self.config, now_s);
                }
            }
        }
        for (message, range) in tell {
            // A sender upstream of the receiver has the receiver on its downstream side.
            let side = usize::from(message.side == Side::Upstream);
            self.drones[message.from].is_known(side, message.sent_s, range);
        }
        for k in 0..self.drones.len() {
            let drone = &mut self.drones[k];
            if !drone.flies {
                continue;
            }
            drone.reminded(now_s);
            drone.steer(&mut self.rng, &self.config, now_s);
            self.exchange_messages(k);
        }
        self.check();
    }

    /// Sends all pending messages of the guard of drone `k`.
    fn exchange_messages(&mut self, k: usize) {
        let drone = &mut self.drones[k];
        let Some(guard) = &mut drone.guard else {
            return;
        };
        for round in 0.. {
            assert!(round < 5, "it never stops talking");
            let Some((side, to, fence)) = guard.poll() else {
                return;
            };
            assert!(fence.is_valid(), "{fence:?}");
            drone.messages += 1;
            if fence.flags & Fence::LEFT == 0 {
                drone.said[usize::from(side == Side::Downstream)] = fence.association;
            }
            let heard_from = match side {
                Side::Upstream => Side::Downstream,
                Side::Downstream => Side::Upstream,
            };
            let way = (k, usize::from(to) - 1, heard_from);
            if drone.speaks {
                self.medium
                    .send(&mut self.rng, self.faults, self.now_s, way, (fence, 0));
            }
        }
    }

    /// Moves drone `k` up to `most_m` along axis `part`, if that is away from all nearby drones.
    ///
    /// `part` is 1 for y or 2 for altitude; `up` selects the direction.
    pub(crate) fn aside(&mut self, k: usize, (part, up, most_m): (usize, bool, f64)) {
        let (low, high) = self.drones[k].possible_ranges()[part];
        let near = k.saturating_sub(3)..(k + 4).min(self.drones.len());
        let is_away = near
            .filter(|other| *other != k && self.drones[*other].flies)
            .all(|other| {
                let (least, most) = self.drones[other].possible_ranges()[part];
                if up { low >= most } else { high <= least }
            });
        if is_away {
            self.drones[k].aside(part, if up { most_m } else { -most_m });
        }
    }

    /// Moves drone `k` along the line, clear of its neighbours, as its pilot does. `share` is the fraction of the
    /// permitted range of x, counted from Tx. Returns false if no range is left, or if a neighbour does not know yet
    /// that the pilot flies this drone.
    pub(crate) fn along(&mut self, k: usize, share: f64) -> bool {
        if !self.drones[k].taken || self.drones[k].told != [true; 2] {
            return false;
        }
        let apart_m = f64::from(self.config.separation_m) + self.allowed_m();
        let flying = |part: &[Drone]| -> Vec<(f64, f64)> {
            let flying = part.iter().filter(|drone| drone.flies);
            flying.map(|drone| drone.possible_ranges()[0]).collect()
        };
        let below = flying(&self.drones[..k]);
        let above = flying(&self.drones[k + 1..]);
        let (before, after) = self.drones[k].clear;
        let least = below.iter().map(|(_, high)| *high).fold(before, f64::max);
        let least = (least + apart_m).max(0.0);
        let most = above.iter().map(|(low, _)| *low).fold(after, f64::min);
        let most = (most - apart_m).min(f64::from(self.config.geofence.most_x_m));
        let to = least + share * (most - least);
        if least < most {
            let [stop, ..] = self.drones[k].stopped();
            self.drones[k].aside(0, to - stop);
        }
        least < most
    }

    /// Checks that no two drones are, or soon can be, closer than permitted.
    ///
    /// The check covers the drones' paths in this step, and each position where a drone may be before new setpoints
    /// arrive.
    fn check(&mut self) {
        let separation = f64::from(self.config.separation_m);
        let floor = separation - self.allowed_m();
        let flying: Vec<&Drone> = self.drones.iter().filter(|drone| drone.flies).collect();
        self.steps += flying.len() as u64;
        for (k, one) in flying.iter().enumerate() {
            for other in &flying[..k] {
                let margin = between(one.possible_ranges(), other.possible_ranges()) - floor;
                self.closest_m = self.closest_m.min(margin);
                assert!(
                    margin >= 0.0,
                    "SEED={}: at {:.1} s they may come within {:.6} m of {separation}: {:#?} and {:#?}",
                    self.seed,
                    self.now_s,
                    margin + floor,
                    other,
                    one,
                );
                let apart = nearest((one.was, one.body.at), (other.was, other.body.at));
                assert!(
                    apart >= floor,
                    "SEED={}: {apart} m at {:.1} s",
                    self.seed,
                    self.now_s
                );
            }
        }
    }
}

/// Returns the indices of drone `k`'s neighbours toward Tx and Rx among `relays` drones. The first and the last drone
/// have only one.
pub(crate) fn beside(k: usize, relays: usize) -> [Option<usize>; 2] {
    [k.checked_sub(1), (k + 1 < relays).then_some(k + 1)]
}

/// Returns the distance between two boxes, m. A box is given by its ranges of x, y and altitude.
fn between(one: [(f64, f64); 3], other: [(f64, f64); 3]) -> f64 {
    length([0, 1, 2].map(|part| {
        let ((low, high), (least, most)) = (one[part], other[part]);
        (low - most).max(least - high).max(0.0)
    }))
}

/// Returns the smallest distance between two moving drones, m. Each of `one` and `other` is the start and the end of a drone's straight
/// flight.
fn nearest(one: (Point, Point), other: (Point, Point)) -> f64 {
    let (from, to) = (way(other.0, one.0), way(other.1, one.1));
    let change = way(from, to);
    let product = |a: Point, b: Point| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let squared = product(change, change);
    let share = if squared > 0.0 {
        (-product(from, change) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    length(along(from, change, share))
}
