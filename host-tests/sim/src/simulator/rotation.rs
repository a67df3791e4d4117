//! Fleet larger than its chain: batteries, pilots, chargers, and the record of a run.
//!
//! Pilots fly in tubes of their own. Take-offs are at one side of the line from Tx to Rx, returns at the other side; drones in the air at
//! the same side have altitudes of their own. A spare waits beside the line at 1.25 spacings of the pilots, and keeps its altitude, a
//! spacing from that of any other spare, until its relay has flown it into the line.

use std::collections::{BTreeMap, VecDeque};

use serde::Serialize;
use uav_relay::{Duration, Instant};

use super::drones::Point;

/// Parameters of a run in which drones with nearly empty batteries are replaced.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationSpec {
    /// Number of drones that should be in the chain at the same time, at most the mission's relays.
    pub flying: u16,
    /// Time for which a full battery of average capacity lasts in hover, s.
    pub endurance_s: f64,
    /// Largest relative difference of a battery's capacity from the average.
    pub spread: f64,
    /// Time on the ground until a drone has a full battery again, s.
    pub ground_s: f64,
    /// True if relays request to leave the chain before their drones fly home to recharge.
    ///
    /// If false, the drones fly home unannounced, and the chain loses their relays.
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

/// Remaining endurance that a drone must still have when it lands, s.
pub const RESERVE_S: f64 = 180.0;

/// Fraction of the best possible SIR below which the chain counts as degraded.
pub const GOOD: f64 = 0.99;

/// Energy consumption of a moving drone, as a multiple of the consumption in hover.
pub(super) const MOVING: f64 = 1.1;

/// Horizontal speed of the drones, m/s.
pub(super) const SPEED_MPS: f64 = 10.0;
/// Vertical speed at which pilots fly the drones, m/s.
pub(super) const CLIMB_MPS: f64 = 4.0;

/// Activity of a drone.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Duty {
    /// Drone on the ground. Its battery is full from this time on.
    Ground(Instant),
    /// Drone on the way from the ground to its waiting place beside the line.
    Rising { path: VecDeque<Point> },
    /// Drone that waits beside the line as a spare; its relay is outside of the chain.
    Standby,
    /// Drone flown by its relay.
    Serving,
    /// Drone on the way home, in the flight corridor with the number `tube`. Its relay is outside of the chain, or off.
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
    /// Time at which the relay requested to leave; `None` without a request.
    pub(super) requested: Option<Instant>,
    /// Flight corridor ("tube") for take-offs that the drone uses; `None` if it uses none.
    ///
    /// The drone uses it from take-off until it has come close to its agreed position in the chain (`is_settled`).
    pub(super) tube: Option<usize>,
    /// Time from which the spare has hovered at its waiting place.
    pub(super) hovers_since: Instant,
    /// True once the drone, after it joined, has been within 3 m of its agreed position. From then on the data must
    /// be routed over this drone.
    pub(super) is_settled: bool,
    /// True once the operators have reported that the drone has left the line on its way home.
    pub(super) is_reported: bool,
}

/// Result of a run with replacements.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Rotated {
    /// Time when the chain first had its full number of drones (`flying`), all of them in place.
    pub complete_at: Option<Instant>,
    /// Time since `complete_at` in which the worst hop's SIR was below [`GOOD`] of the optimum, s.
    pub below_s: f64,
    /// Time from `complete_at` to the end of the run, s.
    pub watched_s: f64,
    /// Smallest SIR of the worst hop since `complete_at`, as a fraction of the optimum, and its time.
    pub worst: Option<(f64, Instant)>,
    /// Number of relays that left since `complete_at`.
    pub replaced: u32,
    /// Number of relays, among `replaced`, that left without permission, at the end of their endurance.
    pub forced: u32,
    /// Total time, s, for which the batteries would have let the relays that left stay in the chain.
    ///
    /// A relay can stay until its battery holds only the reserve and the energy for the way home.
    pub possible_s: f64,
    /// Time of all relays in the chain since `complete_at`, s: of two relays for each second, two seconds.
    pub served_s: f64,
    /// Longest time from a relay's request to leave until it left, s.
    pub longest_wait_s: f64,
    /// Sum of the times from each relay's request to leave until it left, s.
    pub waits_s: f64,
    /// Smallest remaining endurance after the way home, s, computed for each drone when it left the chain.
    pub least_left_s: Option<f64>,
    /// Closest approach of two drones in the air since the start.
    pub nearest: Option<Encounter>,
    /// Times since `complete_at` in which the worst hop's SIR was below [`GOOD`] of the optimum.
    pub dips: Vec<Dip>,
}

/// Time in which the worst hop's SIR is below [`GOOD`] of the optimum.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Dip {
    /// Time at which it begins, s.
    pub at_s: f64,
    /// Duration, s.
    pub span_s: f64,
    /// Time at which it ends. Without a gap, the next step of the flight extends it.
    #[serde(skip)]
    pub until: Instant,
    /// Part of the duration for each cause, s.
    pub causes: BTreeMap<DipCause, f64>,
    /// Smallest SIR of the worst hop, as a fraction of the optimum.
    pub least: f64,
    /// State of the chain at the time of the smallest SIR.
    pub worst: DipState,
}

/// State of the chain during a [`Dip`].
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct DipState {
    /// The two nodes of the worst hop: 0 is Tx, and the number of drones plus 1 is Rx.
    pub hop: [usize; 2],
    /// Drones with their relays on, except for those on their way home.
    pub drones: Vec<NearDrone>,
}

/// Cause of a low SIR: the first one of the list that applies.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DipCause {
    /// Fewer relays in the chain than are meant to fly, and no spare waits beside the line.
    NoSpare,
    /// Fewer relays in the chain than are meant to fly, and a spare waits beside the line.
    SpareWaits,
    /// The relays in the chain are not all in one view with a lease and agreed positions.
    Agreement,
    /// The guard of a relay keeps its drone off the agreed position.
    Guard,
    /// The drones fly to their agreed positions.
    Motion,
    /// The relays are all at their agreed positions.
    Positions,
}

impl DipCause {
    /// Returns the cause in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoSpare => "too few relays, no spare",
            Self::SpareWaits => "too few relays, a spare waits",
            Self::Agreement => "relays have not agreed",
            Self::Guard => "collision avoidance holds a drone back",
            Self::Motion => "drones fly to their positions",
            Self::Positions => "all drones at their agreed positions",
        }
    }
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

/// Drone of an [`Encounter`] or a [`Dip`].
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct NearDrone {
    /// Number of the drone's relay.
    pub relay: usize,
    /// Activity of the drone, departure state of its relay, and the guard's reasons to hold the drone back.
    pub state: String,
    /// True position: x, y and altitude, m.
    pub at_m: Point,
    /// Position to which the drone flies, by its own estimate, m.
    pub goal_m: Point,
}

/// State of the simulated drones and pilots, and the record of the run.
#[derive(Debug)]
pub(super) struct Rotation {
    pub(super) spec: RotationSpec,
    pub(super) drones: Vec<Battery>,
    /// Linear SIR of the worst hop if the full number of drones (`flying`) is at the best positions.
    pub(super) best: f64,
    /// Time of the last step of the flight. A queued step at a time before `next` is ignored.
    pub(super) at: Instant,
    pub(super) next: Instant,
    pub(super) pilots_at: Instant,
    pub(super) last_take_off: Instant,
    /// Time from a request to leave until the relay has left, s. A decaying maximum.
    pub(super) slot_s: f64,
    /// Distance that pilots keep between two drones, m.
    pub(super) spacing_m: f64,
    /// Time at which each drone joined the chain; `None` for a drone outside of the chain.
    pub(super) since: Vec<Option<Instant>>,
    pub(super) record: Rotated,
}

impl Rotation {
    /// Returns the lowest free flight corridor ("tube").
    ///
    /// If `home` is true, it is a corridor for flights home, otherwise for take-offs. The two kinds are separate.
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

    /// Returns the path from the ground through corridor `tube` to `x_m`, beside the line.
    ///
    /// Corridors with a higher number are higher above the line.
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

    /// Returns the path from the position `at` in the chain to the ground, through corridor `tube`.
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

    /// Returns the flight time, s, from the position `at` along all points of `path`.
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

    /// Returns the time, s, until drone `index` (from 0) at `at` has to fly home; negative after that time.
    pub(super) fn left_s(&self, index: usize, at: Point) -> f64 {
        let Some(drone) = self.drones.get(index) else {
            return 0.0;
        };
        let home_s = MOVING * Self::time_s(at, &self.way_home(at, 2));
        drone.capacity_s - drone.used_s - home_s - RESERVE_S
    }

    /// Records that the SIR was the fraction `share` of the optimum for the time `span` up to `now`.
    ///
    /// Does nothing before the chain was complete for the first time. `dip` is the cause of a low SIR and the state of the chain.
    pub(super) fn count(
        &mut self,
        now: Instant,
        span: Duration,
        share: f64,
        dip: Option<(DipCause, DipState)>,
    ) {
        let record = &mut self.record;
        if record.complete_at.is_none() {
            return;
        }
        let span_s = span.as_micros() as f64 / 1e6;
        record.watched_s += span_s;
        if record.worst.is_none_or(|(worst, _)| share < worst) {
            record.worst = Some((share, now));
        }
        let Some((cause, state)) = dip else {
            return;
        };
        record.below_s += span_s;
        let begun = now.since(Instant::ZERO + span);
        let continues = |dip: &Dip| dip.until.since(Instant::ZERO) >= begun;
        if !record.dips.last().is_some_and(continues) {
            record.dips.push(Dip {
                at_s: begun.as_micros() as f64 / 1e6,
                span_s: 0.0,
                until: now,
                causes: BTreeMap::new(),
                least: f64::INFINITY,
                worst: state.clone(),
            });
        }
        let Some(dip) = record.dips.last_mut() else {
            return;
        };
        dip.until = now;
        dip.span_s += span_s;
        *dip.causes.entry(cause).or_default() += span_s;
        if share < dip.least {
            dip.least = share;
            dip.worst = state;
        }
    }
}
