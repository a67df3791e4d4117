//! Fleet larger than its chain: batteries, pilots, chargers, and the record of a run.
//!
//! Pilots fly in tubes of their own. Take-offs are at one side of the line from Tx to Rx, returns at the other side; drones in the air at
//! the same side have altitudes of their own. A spare waits beside the line at 1.25 spacings of the pilots, and keeps its altitude, a
//! spacing from that of any other spare, until its relay has flown it into the line.

use std::collections::VecDeque;

use serde::Serialize;
use uav_relay::{Duration, Instant};

use super::drones::Point;

/// Parameters of a run in which drones with tired batteries are replaced.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationSpec {
    /// Number of drones that are meant to fly, at most the mission's relays.
    pub flying: u16,
    /// Time for which a full battery of average capacity lasts in hover, s.
    pub endurance_s: f64,
    /// Largest relative difference of a battery's capacity from the average.
    pub spread: f64,
    /// Time on the ground until a drone has a full battery again, s.
    pub ground_s: f64,
    /// True if tired drones announce that they leave; false if they just fly home, as an ordinary loss.
    pub announced: bool,
    /// Bound on each drone's constant position error per axis, m.
    pub bias_m: f64,
    /// Bound on the additional error of each position report per axis, m.
    pub noise_m: f64,
}

/// Converts a time from 0 to 1e7 s to whole milliseconds.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the options have ranges"
)]
pub fn duration(span_s: f64) -> Duration {
    Duration::from_millis((1e3 * span_s) as u64)
}

/// Remaining endurance at which a drone has to be at its landing place, s.
pub const RESERVE_S: f64 = 180.0;

/// Share of the optimum of the SIR below which the chain counts as degraded.
pub const GOOD: f64 = 0.99;

/// Consumption of a drone that moves, relative to hover.
pub(super) const MOVING: f64 = 1.1;

/// Horizontal speed of the drones, m/s.
pub(super) const SPEED_MPS: f64 = 10.0;
/// Vertical speed of pilots, m/s.
pub(super) const CLIMB_MPS: f64 = 4.0;

/// Activity of a drone.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Duty {
    /// Drone on the ground, with a full battery from this time on.
    Ground(Instant),
    /// Drone on the way to its place beside the line.
    Rising { path: VecDeque<Point> },
    /// Spare beside the line, with its relay outside of the chain.
    Standby,
    /// Drone flown by its relay.
    Serving,
    /// Drone on the way home, in this tube; the relay is outside of the chain, or off.
    Home { path: VecDeque<Point>, tube: usize },
}

/// Drone with its battery.
#[derive(Clone, Debug)]
pub(super) struct Battery {
    pub(super) duty: Duty,
    /// Time for which the full battery lasts in hover, s.
    pub(super) capacity_s: f64,
    /// Time in hover that corresponds to the energy consumed since take-off, s.
    pub(super) used_s: f64,
    /// Time of the request to leave; `None` before.
    pub(super) requested: Option<Instant>,
    /// Tube at the side of take-offs, from take-off until the drone is in the line.
    pub(super) tube: Option<usize>,
    /// Time since which a spare hovers at its place.
    pub(super) hovers_since: Instant,
    /// True once the drone, after it joined, has been within 3 m of its agreed position. From then on the data must
    /// be routed over this drone.
    pub(super) is_settled: bool,
}

/// Result of a run with replacements.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Rotated {
    /// Time when the chain of all drones that are meant to fly was first complete and in place.
    pub complete_at: Option<Instant>,
    /// Time since then in which the worst hop's SIR was below [`GOOD`] of the optimum, s.
    pub below_s: f64,
    /// Time since the chain was complete, s.
    pub watched_s: f64,
    /// Smallest share of the optimum since then, and when.
    pub worst: Option<(f64, Instant)>,
    /// Number of relays that left since the chain was complete.
    pub replaced: u32,
    /// Number of these that left without permission, because their reserve was spent.
    pub forced: u32,
    /// Sum of the times that these could have stayed in the chain by their batteries, s.
    pub possible_s: f64,
    /// Longest time from a relay's request to its permission to leave, s.
    pub longest_wait_s: f64,
    /// Sum of these times, s.
    pub waits_s: f64,
    /// Least remaining endurance of a drone of the chain beyond its way home, s.
    pub least_left_s: Option<f64>,
    /// Closest approach of two drones in the air since the start.
    pub nearest: Option<Encounter>,
}

/// Closest approach of two drones, and their states at that time.
#[derive(Clone, PartialEq, Debug)]
pub struct Encounter {
    /// True distance of the two drones, m.
    pub apart_m: f64,
    /// Time of the closest approach.
    pub at: Instant,
    /// The two drones, the lower number first.
    pub drones: [NearDrone; 2],
}

/// Drone of an [`Encounter`].
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct NearDrone {
    /// Number of the drone's relay.
    pub relay: usize,
    /// Activity of the drone, departure state of its relay, and what holds its setpoint on each side.
    pub state: String,
    /// True position: x, y and altitude, m.
    pub at_m: Point,
    /// Position to which the drone flies, by its own estimate, m.
    pub goal_m: Point,
}

/// State of the pilots, and the record.
#[derive(Debug)]
pub(super) struct Rotation {
    pub(super) spec: RotationSpec,
    pub(super) drones: Vec<Battery>,
    /// SIR of the worst hop of the drones that are meant to fly, at their best places.
    pub(super) best: f64,
    /// Time of the last step of the flight, and that of the next one. Other steps in the queue are ignored.
    pub(super) at: Instant,
    pub(super) next: Instant,
    pub(super) pilots_at: Instant,
    pub(super) last_take_off: Instant,
    /// Moving average of the time that a replacement takes, s.
    pub(super) slot_s: f64,
    /// Distance of drones that pilots keep, m.
    pub(super) spacing_m: f64,
    /// Time since which each drone is in the chain; `None` outside of it.
    pub(super) since: Vec<Option<Instant>>,
    pub(super) record: Rotated,
}

impl Rotation {
    /// Returns the lowest tube that no drone uses at the side of take-offs, or of returns.
    pub(super) fn free_tube(&self, home: bool) -> usize {
        let is_used = |tube: usize| {
            self.drones.iter().any(|drone| match &drone.duty {
                Duty::Home { tube: used, .. } => home && *used == tube,
                _ => !home && drone.tube == Some(tube),
            })
        };
        (0..=self.drones.len())
            .find(|tube| !is_used(*tube))
            .unwrap_or(0)
    }

    /// Returns the way from the ground to the place `x_m` beside the line, above all lower tubes.
    pub(super) fn way_out(&self, x_m: f64, altitude_m: f64, tube: usize) -> VecDeque<Point> {
        let spacing_m = self.spacing_m;
        let (pad_m, above_m) = self.tube(altitude_m, tube);
        let high_m = above_m - spacing_m;
        let [near_m, far_m] = [-1.25 * spacing_m, -2.5 * spacing_m];
        [
            [pad_m, far_m, 0.0],
            [pad_m, far_m, high_m],
            [x_m, far_m, high_m],
            [x_m, near_m, high_m],
        ]
        .into()
    }

    /// Returns the way from the place `at` in the chain to the ground.
    pub(super) fn way_home(&self, at: Point, tube: usize) -> VecDeque<Point> {
        let spacing_m = self.spacing_m;
        let [x_m, _, altitude_m] = at;
        let (pad_m, high_m) = self.tube(altitude_m, tube);
        let [near_m, far_m] = [1.25 * spacing_m, 2.5 * spacing_m];
        [
            [x_m, near_m, altitude_m],
            [x_m, near_m, high_m],
            [x_m, far_m, high_m],
            [pad_m, far_m, high_m],
            [pad_m, far_m, 0.0],
        ]
        .into()
    }

    #[expect(clippy::cast_precision_loss, reason = "some tubes")]
    fn tube(&self, altitude_m: f64, tube: usize) -> (f64, f64) {
        let step_m = self.spacing_m * (1 + tube) as f64;
        (-20.0 - step_m, altitude_m + step_m)
    }

    /// Returns the time that the rest of `path` takes from the position `at`, s.
    pub(super) fn time_s(mut at: Point, path: &VecDeque<Point>) -> f64 {
        let mut time_s = 0.0;
        for to in path {
            let [x, y, h] = [0, 1, 2].map(|axis: usize| {
                let part = |point: &Point| point.get(axis).copied().unwrap_or(0.0);
                (part(to) - part(&at)).abs()
            });
            // Each leg has a start and a stop at 3 m/s².
            time_s += (x.max(y) / SPEED_MPS).max(h / CLIMB_MPS) + 3.5;
            at = *to;
        }
        time_s
    }

    /// Returns the time until drone `index` (from 0), at `at`, has to leave for home, s.
    pub(super) fn left_s(&self, index: usize, at: Point) -> f64 {
        let Some(drone) = self.drones.get(index) else {
            return 0.0;
        };
        let home_s = MOVING * Self::time_s(at, &self.way_home(at, 2));
        drone.capacity_s - drone.used_s - home_s - RESERVE_S
    }

    /// Records the share of the optimum at `now`, which held since the last step.
    pub(super) fn count(&mut self, now: Instant, span: Duration, share: f64) {
        let record = &mut self.record;
        if record.complete_at.is_none() {
            return;
        }
        let span_s = span.as_micros() as f64 / 1e6;
        record.watched_s += span_s;
        if record.worst.is_none_or(|(worst, _)| share < worst) {
            record.worst = Some((share, now));
        }
        if share < GOOD {
            record.below_s += span_s;
        }
    }
}
