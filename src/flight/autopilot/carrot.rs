//! Carrot: the target sent to the autopilot. It moves from the drone's position to the setpoint.
//!
//! The carrot starts at the drone's position and accelerates by a. At the distance s from the setpoint its speed is at
//! most k s near the setpoint. Farther away it is at most sqrt(2 a (s - a / 2 k^2)), where the carrot decelerates by a.
//! Near the end the deceleration falls, because a PX4 overshoots a target that stops with a constant deceleration.
//!
//! An autopilot that lags behind its target catches up. It flies faster than the target by its lag times its gain,
//! which is about 1 /s. While it accelerates, it flies even faster. The carrot is slower than the speed limit by this
//! difference, so that the drone stays within the limit.

use crate::flight::autopilot::state::Kind;
use crate::flight::axis::Axis;
use crate::geodetic::Geodetic;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// Maximum distance to the setpoint at which the moving target counts as arrived, m.
const ARRIVED_M: f32 = 0.01;

/// Ratio k of speed to remaining distance, 1/s, with which the moving target approaches the setpoint.
const END_PER_S: f32 = 0.5;

/// Minimum speed of the moving target near the setpoint, m/s.
const END_SPEED_M_S: f32 = 0.2;

/// Assumed gain of an autopilot's position control, 1/s. A drone that is d metres behind its target flies faster than
/// the target by 1.25 d m/s.
const CATCH_UP_PER_S: f32 = 1.25;

/// Maximum speed of the moving target, as a fraction of the drone's speed limit. A margin of 4 % is left, because a
/// drone at times flies faster than its target.
const CARROT_PART: f32 = 0.96;

/// Factor k of the moving target's acceleration near its maximum speed, 1/s. The acceleration is k times the difference
/// between the maximum speed and the present speed.
///
/// The moving target thus approaches its maximum speed smoothly, because a drone does not stop accelerating at once.
const TOP_PER_S: f32 = 0.5;

/// Lower bound of the moving target's maximum speed, as a fraction of the speed limit. The target flies at this speed
/// while the drone is far behind it.
const LEAST_PART: f32 = 0.1;

/// Factor on the acceleration limit, for velocity that does not lead toward a new setpoint.
///
/// When the setpoint changes, the moving target still has its old velocity. The part of this velocity toward the new
/// setpoint stays. The rest is reduced to 0 with twice the acceleration of [`Pace`], within [`Pace::stopping_time`]. An
/// instant turn of the target would make the drone overshoot it and come back.
const TURN_PART: f32 = 2.0;

/// Distance of the moving target to the setpoint that may remain after [`Pace::stopping_time`], m. The drone is behind
/// the target, and then moves no farther than 0.5 m.
const SETTLED_M: f32 = 0.25;

/// Assumed time from a new setpoint until the drone reacts, ms. This time includes 200 ms for the transmission to the
/// flight controller, and 1000 ms for the delay of the drone's motion.
const BEHIND_MS: u64 = 1_200;

/// Time in which the moving target's speed halves near the setpoint, ms: ln 2 / k, with k = 0.5 /s.
///
/// Near the setpoint the speed is k times the remaining distance.
const HALVES_MS: u64 = 1_387;

/// Maximum number of halvings of the speed that [`Pace::stopping_time`] counts. Eight halvings reduce a remaining
/// distance of 20 m to less than [`SETTLED_M`].
const MOST_HALVES: u32 = 8;

/// Maximum age of a drone's position from which its lag behind the moving target is computed. The position is compared
/// with the target's position at the same time.
const LONGEST_LAG: Duration = Duration::from_millis(1_000);

/// Maximum time step of the moving target. After a longer gap the target continues from its last position, without a
/// jump.
const LONGEST_STEP: Duration = Duration::from_millis(500);

/// Speed limit and acceleration of the moving target that is sent to an autopilot.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pace {
    /// Maximum speed, m/s: 0.1 to 20.
    pub speed_m_s: f32,
    /// Acceleration, m/s²: 0.1 to 5.
    pub acceleration_m_s2: f32,
}

impl Default for Pace {
    /// Returns the default speed limit and acceleration: 5 m/s and 1 m/s².
    fn default() -> Self {
        Self {
            speed_m_s: 5.0,
            acceleration_m_s2: 1.0,
        }
    }
}

impl Pace {
    /// Returns the default acceleration with the speed limit `speed_m_s`, m/s. The speed limit is 0.1 to 20 m/s, or 0
    /// for the default.
    pub fn of_speed(speed_m_s: f32) -> Self {
        let mut pace = Self::default();
        if speed_m_s > 0.0 {
            pace.speed_m_s = speed_m_s;
        }
        pace
    }

    /// Returns the maximum speed of a moving target that must stop within `left_m` metres, m/s.
    fn speed_before_m_s(self, left_m: f32) -> f32 {
        let a = self.acceleration_m_s2;
        // The two parts meet at this distance, both with the speed a / k.
        let near_m = a / (END_PER_S * END_PER_S);
        if left_m > near_m {
            libm::sqrtf(2.0 * a * (left_m - near_m / 2.0))
        } else {
            (END_PER_S * left_m).max(END_SPEED_M_S)
        }
    }

    /// Returns the distance in which the moving target stops from the speed `speed_m_s`, m.
    fn stopping_m(self, speed_m_s: f32) -> f32 {
        let a = self.acceleration_m_s2;
        if speed_m_s > a / END_PER_S {
            speed_m_s * speed_m_s / (2.0 * a) + a / (END_PER_S * END_PER_S) / 2.0
        } else {
            speed_m_s / END_PER_S
        }
    }

    /// Returns the time from a changed setpoint until a drone that flew at maximum speed has stopped.
    ///
    /// It is 9.8 s by default, and the value for [`GuardConfig::lag`](crate::guard::config::GuardConfig::lag).
    ///
    /// The drone reacts after 1.2 s. Then the moving target slows down: first with the deceleration a to the speed a/k,
    /// then in proportion to the remaining distance. Here a is the acceleration of this pace, and k is 0.5 /s, the
    /// ratio of speed to distance near the setpoint. After the returned time the remaining distance is at most 0.25 m.
    /// Work: at most 8 steps.
    ///
    /// Asserted by `host-tests/tests/autopilot/motion.rs`: after this time a drone moves no farther than 0.5 m.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to 200 000 ms within the ranges; a cast saturates outside"
    )]
    pub fn stopping_time(self) -> Duration {
        let a = self.acceleration_m_s2;
        let near = (a / END_PER_S).min(self.speed_m_s);
        let mut time_ms = ((self.speed_m_s - near) / a * 1e3) as u64 + BEHIND_MS;
        let mut left_m = near / END_PER_S;
        for _ in 0..MOST_HALVES {
            if left_m <= SETTLED_M {
                break;
            }
            left_m /= 2.0;
            time_ms += HALVES_MS;
        }
        Duration::from_millis(time_ms)
    }

    /// Returns true if speed and acceleration are within their allowed ranges.
    pub fn is_valid(self) -> bool {
        (0.1..=20.0).contains(&self.speed_m_s) && (0.1..=5.0).contains(&self.acceleration_m_s2)
    }
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Carrot {
    pub(super) place: Placement,
    /// Velocity of the moving target along x, y and up, m/s.
    pub(super) velocity_m_s: [f32; 3],
    is_standing: bool,
    moved_at: Instant,
}

impl Carrot {
    /// Creates a moving target that stands at the drone's position `place`.
    pub(super) const fn at(place: Placement, now: Instant) -> Self {
        Self {
            place,
            velocity_m_s: [0.0; 3],
            is_standing: true,
            moved_at: now,
        }
    }

    pub(super) const fn is_standing(&self) -> bool {
        self.is_standing
    }

    /// Returns the position that the moving target had a time `ago` before its last step. The target's present velocity
    /// is assumed for the whole time `ago`.
    fn place_before(&self, ago: Duration) -> Placement {
        let t = seconds(ago.min(LONGEST_LAG));
        let [x, y, up] = self.velocity_m_s;
        Placement {
            x_m: self.place.x_m - x * t,
            y_m: self.place.y_m - y * t,
            altitude_m: self.place.altitude_m - up * t,
        }
    }

    /// Returns the position at which the moving target stops if it decelerates from now on. The position is on the way
    /// to `setpoint`, and never beyond `setpoint`.
    pub(super) fn stop(&self, setpoint: Placement, pace: Pace) -> Placement {
        let to = self.way_to(setpoint);
        let left = length(to);
        let speed = length(self.velocity_m_s);
        let needs = pace.stopping_m(speed);
        if self.is_standing || left <= ARRIVED_M || dot(self.velocity_m_s, to) <= 0.0 {
            return self.place;
        }
        let part = (needs / left).min(1.0);
        Placement {
            x_m: self.place.x_m + to[0] * part,
            y_m: self.place.y_m + to[1] * part,
            altitude_m: self.place.altitude_m + to[2] * part,
        }
    }

    fn way_to(&self, setpoint: Placement) -> [f32; 3] {
        way(self.place, setpoint)
    }

    /// Moves the target toward `setpoint`, for the time from its last step to `now`. `drone` is the drone's last
    /// position, with the age of this position; `None` if unknown.
    pub(super) fn advance(
        &mut self,
        now: Instant,
        setpoint: Placement,
        pace: Pace,
        drone: Option<(Placement, Duration)>,
    ) {
        let passed = now.since(self.moved_at).min(LONGEST_STEP);
        self.moved_at = now;
        let dt = seconds(passed);
        let to = self.way_to(setpoint);
        let left = length(to);
        let a = pace.acceleration_m_s2;
        let turn = TURN_PART * a * dt;
        // A new setpoint may lie sideways or behind. The velocity that does not lead toward it is reduced first.
        let ahead = to.map(|part| part / left.max(ARRIVED_M));
        let toward = dot(self.velocity_m_s, ahead);
        let [x, y, up] = self.velocity_m_s;
        let aside = [
            x - toward * ahead[0],
            y - toward * ahead[1],
            up - toward * ahead[2],
        ];
        let slip = length(aside);
        let keeps = if slip > turn { 1.0 - turn / slip } else { 0.0 };
        if left <= ARRIVED_M && keeps <= 0.0 {
            *self = Self::at(setpoint, now);
            return;
        }
        // A drone ahead of the carrot has no lag. With a negative lag the carrot would oscillate with the drone.
        let behind = |(place, ago)| dot(way(place, self.place_before(ago)), to) / left;
        let lag_m = drone.map_or(0.0, behind).max(0.0);
        let most = (CARROT_PART * pace.speed_m_s - CATCH_UP_PER_S * lag_m)
            .max(LEAST_PART * pace.speed_m_s);
        let speed = if toward < 0.0 {
            (toward + turn).min(0.0)
        } else {
            let gain = a.min((TOP_PER_S * (most - toward)).max(0.0));
            (toward + gain * dt)
                .min(most)
                .min(pace.speed_before_m_s(left))
        };
        if speed * dt >= left && keeps <= 0.0 {
            *self = Self::at(setpoint, now);
            return;
        }
        self.is_standing = false;
        let velocity = |ahead: f32, aside: f32| ahead * speed + aside * keeps;
        let [x, y, up] = [
            velocity(ahead[0], aside[0]),
            velocity(ahead[1], aside[1]),
            velocity(ahead[2], aside[2]),
        ];
        self.velocity_m_s = [x, y, up];
        self.place = Placement {
            x_m: self.place.x_m + x * dt,
            y_m: self.place.y_m + y * dt,
            altitude_m: self.place.altitude_m + up * dt,
        };
    }
}

#[expect(clippy::cast_precision_loss, reason = "a second at most")]
fn seconds(duration: Duration) -> f32 {
    duration.as_micros() as f32 * 1e-6
}

fn way(from: Placement, to: Placement) -> [f32; 3] {
    [
        to.x_m - from.x_m,
        to.y_m - from.y_m,
        to.altitude_m - from.altitude_m,
    ]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(a: [f32; 3]) -> f32 {
    libm::sqrtf(dot(a, a))
}

/// Interval at which the position of a moving target is sent to the autopilot.
const MOVING: Duration = Duration::from_millis(100);
/// Interval at which a target that stands still is sent again to a PX4. A PX4 leaves OFFBOARD after a second without a
/// target.
const STANDING: Duration = Duration::from_millis(200);

/// Interval at which a standing target is sent again to an ArduCopter that has not reported it yet. More frequent
/// repetition makes an ArduCopter wobble.
const AGAIN: Duration = Duration::from_millis(1_000);

/// Number of consecutive reports of a different target after which the sent target counts as refused. A different
/// target is one other than the sent target. An ArduCopter reports its target twice a second.
const REFUSED_AFTER: u8 = 6;
/// Time without a report of a target other than the sent one, after which a refusal ends. Unit: 2^20 µs.
const UNKNOWN_AFTER_S: u32 = 10;
/// Minimum time for which targets must have been sent before the autopilot can count as refusing them.
const SENT_FOR: Duration = Duration::from_millis(3_000);

/// Maximum difference between a standing target and the target reported by an ArduCopter, 1e-7 degrees.
///
/// For a moving target the maximum is [`NEAR_M`] metres plus the distance that the target covers in [`NEAR_S`] seconds.
const ACCEPTED_WITHIN: u32 = 20;
const NEAR_M: f32 = 3.0;
const NEAR_S: f32 = 1.0;

/// Maximum number of transmissions of a standing target to an ArduCopter that never reports a target.
const UNCONFIRMED: u8 = 10;

/// Target that is sent to the autopilot, the schedule of its transmissions, and its confirmation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) carrot: Carrot,
    pub(super) due: Instant,
    /// Number of transmissions to an ArduCopter since the target stands still; 0 while the target moves.
    times_sent: u8,
    /// True once the autopilot has reported this target.
    is_accepted: bool,
    /// Start of the time in which targets have been sent without a break.
    since: Instant,
    /// Number of consecutive reports by the autopilot of a target other than the sent one.
    other_targets: u8,
    /// Time of the autopilot's last report of a target other than the sent one, in units of 2^20 µs.
    compared_s: u32,
    /// True once the autopilot has reported a target position in POSITION_TARGET_GLOBAL_INT.
    is_reported: bool,
}

impl Target {
    /// Creates a target that stands at `place` and has not been sent yet.
    pub(super) const fn at(place: Placement, now: Instant) -> Self {
        Self {
            carrot: Carrot::at(place, now),
            due: now,
            times_sent: 0,
            is_accepted: false,
            since: now,
            other_targets: 0,
            compared_s: 0,
            is_reported: false,
        }
    }

    /// Restarts the schedule of transmissions for a changed setpoint. The next target is sent at once.
    pub(super) const fn renew(&mut self, now: Instant) {
        self.due = now;
        self.times_sent = 0;
        self.is_accepted = false;
    }

    /// Compares the autopilot's reported target with the sent target. Returns true once for each refusal: targets have
    /// been sent for [`SENT_FOR`], and after that [`REFUSED_AFTER`] reports in a row contained a different target.
    ///
    /// A larger difference is allowed for a moving target, because the report shows where the target was some time ago.
    pub(super) fn compare(&mut self, now: Instant, axis: &Axis, lat_e7: i32, lon_e7: i32) -> bool {
        self.is_reported = true;
        let Some(point) = axis.point(self.carrot.place) else {
            return false;
        };
        let near = |a: i32, b: i32| a.abs_diff(b) <= ACCEPTED_WITHIN;
        let is_there = near(point.lat_e7, lat_e7) && near(point.lon_e7, lon_e7);
        if self.times_sent > 0 {
            self.is_accepted = is_there;
        }
        let amsl_mm = point.amsl_mm;
        let said = axis.place(Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        });
        let is_near = said.is_some_and(|said| {
            let [x, y, _] = self.carrot.velocity_m_s;
            let within = NEAR_M + NEAR_S * (x.abs() + y.abs());
            let off = |a: f32, b: f32| (a - b).abs() <= within;
            off(said.x_m, self.carrot.place.x_m) && off(said.y_m, self.carrot.place.y_m)
        });
        // A standing target is reported exactly, or not at all.
        if is_there || is_near && self.times_sent == 0 {
            self.other_targets = 0;
            return false;
        }
        if now.since(self.since) < SENT_FOR {
            return false;
        }
        let before = self.other_targets;
        self.other_targets = before.saturating_add(1);
        self.compared_s = whole_s(now);
        before < REFUSED_AFTER && self.is_refused(now)
    }

    /// Returns true while the autopilot refuses the sent target: it reports a different one. False once the last such
    /// report is [`UNKNOWN_AFTER_S`] old.
    pub(super) const fn is_refused(self, now: Instant) -> bool {
        self.other_targets >= REFUSED_AFTER
            && whole_s(now).wrapping_sub(self.compared_s) < UNKNOWN_AFTER_S
    }

    /// Schedules the next target after the drone's own position has been sent to a PX4 as the target. This is done in
    /// the state `Standby`, before the relay controls the drone.
    ///
    /// A PX4 accepts the mode OFFBOARD only while it receives targets.
    pub(super) fn on_own_place_sent(&mut self, now: Instant) {
        self.due = now + STANDING;
    }

    /// Returns true if the target must be sent at `now`, and schedules the next transmission.
    pub(super) fn should_send(&mut self, now: Instant, kind: Kind) -> bool {
        let is_standing = self.carrot.is_standing();
        self.due = now
            + match kind {
                _ if !is_standing => MOVING,
                Kind::Px4 => STANDING,
                Kind::ArduCopter => AGAIN,
            };
        let is_known = self.is_accepted || !self.is_reported && self.times_sent >= UNCONFIRMED;
        let is_sent = !is_standing || kind == Kind::Px4 || !is_known;
        if !is_standing {
            (self.times_sent, self.is_accepted) = (0, false);
        } else if is_sent && kind == Kind::ArduCopter {
            self.times_sent = self.times_sent.saturating_add(1);
        }
        is_sent
    }
}

/// Converts a time to units of 2^20 µs, about a second.
#[expect(clippy::cast_possible_truncation, reason = "wraps after a century")]
const fn whole_s(now: Instant) -> u32 {
    (now.as_micros() >> 20) as u32
}

#[cfg(test)]
mod tests {
    use heapless::Vec;

    use super::{Carrot, Kind, Pace, Target, length};
    use crate::flight::axis::Axis;
    use crate::geodetic::{Geodetic, Sites};
    use crate::guard::config::GuardConfig;
    use crate::mission::Mission;
    use crate::mission::tests::paper;
    use crate::place::Placement;
    use crate::time::{Duration, Instant};

    /// Simulates a flight. Returns the positions and speeds of the moving target every 100 ms until it stands.
    fn fly(from: Placement, to: Placement, pace: Pace) -> Vec<(Placement, f32), 512> {
        let mut carrot = Carrot::at(from, Instant::ZERO);
        let mut way = Vec::new();
        for i in 1..5_000 {
            carrot.advance(Instant::from_millis(100 * i), to, pace, None);
            way.push((carrot.place, length(carrot.velocity_m_s)))
                .expect("room");
            if carrot.is_standing() {
                break;
            }
        }
        way
    }

    #[test]
    fn a_carrot_keeps_its_speed_limit_and_stops_gently() {
        let pace = Pace::default();
        let to = Placement {
            y_m: 40.0,
            ..Placement::on_line(130.0, 30.0)
        };
        let way = fly(Placement::on_line(100.0, 20.0), to, pace);
        assert_eq!(way.last().map(|(place, _)| *place), Some(to));
        let mut before = 0.0;
        for (_, speed) in &way {
            assert!(*speed <= 5.0 * (1.0 + 1e-6));
            assert!(
                speed - before <= 0.1 + 1e-4,
                "1 m/s² gains 0.1 m/s in a step"
            );
            before = *speed;
        }
        let fastest = way.iter().map(|(_, speed)| *speed).fold(0.0, f32::max);
        assert!(fastest > 4.4, "51 m are enough to reach 5 m/s: {fastest}");
        // 51 m take 5 s of acceleration, 5 s at full speed, and 3 s of braking to 2 m/s. The rest takes 7 s.
        assert!((170..210).contains(&way.len()), "{}", way.len());
        let last_moving = way[way.len() - 2].1;
        assert!(last_moving < 0.25, "{last_moving}");
    }

    #[test]
    fn a_default_guard_counts_on_the_stopping_time() {
        let time = Pace::default().stopping_time();
        assert_eq!(time, Duration::from_millis(9_748));
        let mission = Mission::try_new(paper(3)).unwrap();
        let guard = GuardConfig::of(&mission, mission.config().common);
        assert!(time <= guard.lag);
        // 158 s from 20 m/s to 0.25 m/s, with 0.5 m left.
        let slow = Pace {
            speed_m_s: 20.0,
            acceleration_m_s2: 0.125,
        };
        let expected = Duration::from_millis(158_000 + 1_200 + 1_387);
        assert_eq!(slow.stopping_time(), expected);
    }

    #[test]
    fn a_carrot_whose_drone_lags_behind_waits_for_it() {
        let mut carrot = Carrot::at(Placement::on_line(0.0, 20.0), Instant::ZERO);
        let to = Placement::on_line(1000.0, 20.0);
        for (lag_m, expected) in [
            (-3.0, 4.8),
            (0.0, 4.8),
            (1.0, 3.55),
            (3.0, 1.05),
            (9.0, 0.5),
        ] {
            for i in 0..300 {
                let now = Instant::from_millis(100 * i);
                let drone = Placement {
                    x_m: carrot.place.x_m - lag_m,
                    ..carrot.place
                };
                carrot.moved_at = Instant::from_millis((100 * i).saturating_sub(100));
                carrot.advance(
                    now,
                    to,
                    Pace::default(),
                    Some((drone, Duration::from_micros(0))),
                );
            }
            let speed = length(carrot.velocity_m_s);
            assert!((speed - expected).abs() < 1e-2, "{lag_m} m: {speed}");
        }
    }

    /// Checks that the moving target stops without a jerk, at whatever time the setpoint is withdrawn. The target
    /// decelerates by less than 0.23 m/s in 0.1 s, and never moves beyond the position at which it must stop.
    #[test]
    fn a_withdrawn_carrot_stops_gently_anywhere() {
        let to = Placement::on_line(60.0, 20.0);
        let pace = Pace::default();
        for after in 1..200 {
            let mut carrot = Carrot::at(Placement::on_line(0.0, 20.0), Instant::ZERO);
            let at = |i: u64, carrot: &mut Carrot, to| {
                carrot.advance(Instant::from_millis(100 * i), to, pace, None);
            };
            for i in 1..=after {
                at(i, &mut carrot, to);
            }
            let stop = carrot.stop(to, pace);
            assert!(stop.x_m <= to.x_m && stop.x_m >= carrot.place.x_m);
            let mut before = length(carrot.velocity_m_s);
            for i in after + 1..after + 200 {
                at(i, &mut carrot, stop);
                let speed = length(carrot.velocity_m_s);
                assert!(before - speed < 0.23, "{after}: {before}, then {speed}");
                assert!(carrot.place.x_m <= stop.x_m);
                before = speed;
            }
            assert!(carrot.is_standing(), "{after}");
        }
    }

    /// Returns a line from Tx to Rx of 1 km toward north.
    fn axis() -> Axis {
        let site = |lat_e7| Geodetic {
            lat_e7,
            lon_e7: 85_400_000,
            amsl_mm: 420_000,
        };
        let sites = Sites {
            tx: site(474_000_000),
            rx: site(474_090_000),
        };
        Axis::between(sites).unwrap()
    }

    /// Returns the number of refusals that [`Target::compare`] reports for a moving target within 20 s.
    ///
    /// The autopilot reports its target twice a second. Each report contains the position that was sent `lag` times 100
    /// ms earlier, moved `aside_m` metres sideways.
    fn other_targets(lag: usize, aside_m: f32) -> usize {
        let axis = axis();
        let to = Placement::on_line(900.0, 20.0);
        let mut target = Target::at(Placement::on_line(100.0, 20.0), Instant::ZERO);
        let mut sent: Vec<Placement, 256> = Vec::new();
        let mut others = 0;
        for i in 0..200 {
            let now = Instant::from_millis(100 * i);
            target.carrot.advance(now, to, Pace::default(), None);
            _ = target.should_send(now, Kind::ArduCopter);
            _ = sent.push(target.carrot.place);
            if i % 5 == 0 {
                let old = sent[sent.len().saturating_sub(1 + lag)];
                let said = Placement {
                    y_m: old.y_m + aside_m,
                    ..old
                };
                let point = axis.point(said).unwrap();
                let differs = target.compare(now, &axis, point.lat_e7, point.lon_e7);
                others += usize::from(differs);
            }
        }
        assert!(!target.carrot.is_standing());
        others
    }

    /// Checks that an autopilot that reports a moving target late does not count as refusing it.
    #[test]
    fn a_moving_target_that_is_reported_late_is_no_other_target() {
        assert_eq!(other_targets(0, 0.0), 0);
        assert_eq!(other_targets(9, 0.0), 0);
        assert_eq!(other_targets(0, 20.0), 1, "reported once");
    }

    /// Checks that the autopilot counts as refusing the setpoint only while it reports its target.
    ///
    /// Without recent reports the refusal is unknown, and `is_refused` returns false.
    #[test]
    fn a_refusal_is_unknown_without_reports_of_the_target() {
        let axis = axis();
        let mut target = Target::at(Placement::on_line(100.0, 20.0), Instant::ZERO);
        let other = axis.point(Placement::on_line(200.0, 20.0)).unwrap();
        let at = |seconds: u64| Instant::from_millis(1_000 * seconds);
        for second in 3..9 {
            let differs = target.compare(at(second), &axis, other.lat_e7, other.lon_e7);
            assert_eq!(
                (differs, target.is_refused(at(second))),
                (second == 8, second == 8)
            );
        }
        // The autopilot refuses the second setpoint as well.
        target.renew(at(9));
        assert!(target.is_refused(at(17)));
        assert!(!target.is_refused(at(20)));
        assert!(!target.is_refused(at(2_000)));
        let differs = target.compare(at(2_001), &axis, other.lat_e7, other.lon_e7);
        assert_eq!((differs, target.is_refused(at(2_002))), (false, true));
    }

    #[test]
    fn a_gap_is_no_jump() {
        let mut carrot = Carrot::at(Placement::on_line(0.0, 20.0), Instant::ZERO);
        let to = Placement::on_line(1000.0, 20.0);
        carrot.advance(Instant::from_millis(60_000), to, Pace::default(), None);
        assert!(
            carrot.place.x_m <= 2.5,
            "half a second at the greatest speed"
        );
    }

    /// Checks that the moving target turns smoothly if a new setpoint is not in its direction of motion. The velocity
    /// in the old direction ends within 3 s.
    #[test]
    fn a_setpoint_elsewhere_turns_it_by_its_acceleration() {
        for (x_m, y_m) in [
            (-50.0, 0.0),
            (24.0, 60.0),
            (0.0, 60.0),
            (60.0, -5.0),
            (30.0, 0.5),
        ] {
            let mut carrot = Carrot::at(Placement::on_line(0.0, 20.0), Instant::ZERO);
            let to = Placement {
                y_m,
                ..Placement::on_line(x_m, 20.0)
            };
            let (mut farthest_m, mut turned) = (0.0_f32, None);
            for i in 1..500 {
                let now = Instant::from_millis(100 * i);
                let goal = if i < 60 {
                    Placement::on_line(1000.0, 20.0)
                } else {
                    to
                };
                let before = carrot.velocity_m_s;
                carrot.advance(now, goal, Pace::default(), None);
                let after = carrot.velocity_m_s;
                let change = length([after[0] - before[0], after[1] - before[1], 0.0]);
                assert!(
                    change < 0.35,
                    "({x_m}, {y_m}) {i}: {before:?}, then {after:?}"
                );
                farthest_m = farthest_m.max(carrot.place.x_m);
                if i > 60 && turned.is_none() && after[0] * (x_m - 24.0) >= 0.0 {
                    turned = Some(i);
                }
            }
            assert!(carrot.is_standing(), "({x_m}, {y_m}): {carrot:?}");
            assert_eq!(carrot.place, to);
            // The target stops from 4.8 m/s within 5.8 m.
            assert!(
                farthest_m < x_m.max(24.0) + 6.5,
                "({x_m}, {y_m}): {farthest_m}"
            );
            assert!(turned.is_some_and(|i| i < 90), "({x_m}, {y_m}): {turned:?}");
        }
    }
}
