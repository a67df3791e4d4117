//! Models of a PX4 and an ArduCopter after the real ones, with bodies that follow targets like theirs.
//!
//! PX4: refuses OFFBOARD without a stream; enters its failsafe (`system_status` 5) a second after the last target or when GPS is
//! lost; resumes OFFBOARD on its own once a stream has lasted for 1.2 s; ends a failsafe only when a pilot chooses a mode.
//! ArduCopter: always accepts GUIDED, keeps a velocity for 3 s after the last target, silently ignores targets outside its
//! fence, returns at a fence breach, flies for 8 s without GPS and then lands. Both answer TIMESYNC and message requests.

use host_tests::make;
use uav_relay::flight::autopilot::Kind;
use uav_relay::flight::axis::Axis;
use uav_relay::flight::mavlink::frame::{checksum, find_known};
use uav_relay::{Duration, Geodetic, Instant, Placement};

pub(crate) type Point = [f64; 3];

/// Time step of the simulated airframe, s.
pub(crate) const STEP_S: f64 = 0.02;

/// Time without targets after which a PX4 leaves OFFBOARD.
const LOST: Duration = Duration::from_millis(1_000);
/// Time with targets after which a PX4 in failsafe resumes OFFBOARD.
const RESUMES: Duration = Duration::from_millis(1_200);

/// Longest time until the companion knows of a PX4's failsafe: heartbeat interval and link delay.
const KNOWN_WITHIN: Duration = Duration::from_millis(1_300);

/// Time for which an ArduCopter keeps its target velocity without new targets.
const VELOCITY: Duration = Duration::from_millis(3_000);
/// Time for which an ArduCopter continues to navigate after the loss of GPS.
const RECKONS: Duration = Duration::from_millis(8_000);

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mode {
    Sticks,
    Hold,
    Companion,
    Return,
    Land,
}

/// Air drag and controller gains of a vehicle.
///
/// The gains are PX4's MPC_XY_P, MPC_XY_VEL_P_ACC, MPC_XY_VEL_I_ACC and MPC_XY_VEL_D_ACC.
struct Gains {
    place: f64,
    speed: f64,
    sum: f64,
    rate: f64,
    lag_s: f64,
    drag: f64,
    most_m_s: f64,
    most_m_s2: f64,
}

const PX4: Gains = Gains {
    place: 0.95,
    speed: 1.8,
    sum: 0.4,
    rate: 0.2,
    lag_s: 0.15,
    drag: 0.3,
    most_m_s: 12.0,
    most_m_s2: 5.0,
};

/// Gains of the ArduCopter model, fitted to a recorded flight. The recorded drone followed a target with 5 m/s and 1
/// m/s²; it reached 6.2 m/s and overshot by 1.1 m.
const ARDUCOPTER: Gains = Gains {
    place: 1.0,
    speed: 0.7,
    sum: 0.1,
    rate: 0.0,
    lag_s: 0.1,
    drag: 0.0,
    most_m_s: 10.0,
    most_m_s2: 2.5,
};

#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Body {
    pub(crate) at: Point,
    pub(crate) velocity: Point,
    acceleration: Point,
    sum: Point,
}

impl Body {
    fn fly(&mut self, to: Point, velocity: Point, gains: &Gains) {
        let wanted: Point =
            core::array::from_fn(|i| velocity[i] + gains.place * (to[i] - self.at[i]));
        self.fly_at(wanted, gains);
    }

    pub(crate) fn follow_as_px4(&mut self, to: Point, velocity: Point) {
        self.fly(to, velocity, &PX4);
    }

    fn fly_at(&mut self, wanted: Point, gains: &Gains) {
        let speed = wanted.iter().map(|v| v * v).sum::<f64>().sqrt();
        let part = (gains.most_m_s / speed).min(1.0);
        for (i, wanted) in wanted.into_iter().enumerate() {
            let error = wanted * part - self.velocity[i];
            self.sum[i] = (self.sum[i] + gains.sum * error * STEP_S).clamp(-4.0, 4.0);
            let told = gains.speed * error + self.sum[i] - gains.rate * self.acceleration[i];
            let told = told.clamp(-gains.most_m_s2, gains.most_m_s2);
            let air = gains.drag * self.velocity[i];
            self.acceleration[i] += (told - air - self.acceleration[i]) / gains.lag_s * STEP_S;
            self.velocity[i] += self.acceleration[i] * STEP_S;
            self.at[i] += self.velocity[i] * STEP_S;
        }
    }
}

/// Position and velocity target that the simulated autopilot has received.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SentTarget {
    pub(crate) to: Point,
    pub(crate) velocity: Point,
}

#[expect(
    clippy::struct_excessive_bools,
    reason = "faults that are independent of each other"
)]
pub(crate) struct Real {
    pub(crate) kind: Kind,
    axis: Axis,
    pub(crate) body: Body,
    pub(crate) armed: bool,
    pub(crate) in_air: bool,
    /// Flight mode that the pilot has chosen; `mode` is the flight mode in effect.
    pub(crate) chosen: Mode,
    pub(crate) mode: Mode,
    pub(crate) is_critical: bool,
    pub(crate) gps: bool,
    gps_lost_at: Instant,
    /// Position x of the fence, m. An ArduCopter ignores targets beyond this x.
    pub(crate) fence_x_m: f64,
    pub(crate) is_breached: bool,
    target: Option<SentTarget>,
    last_target_at: Option<Instant>,
    stream_since: Instant,
    /// Point at which the drone hovers in the flight modes without a companion.
    hold: Point,
    began: Instant,
    pub(crate) away_until: Option<Instant>,
    /// Fraction by which the autopilot's clock runs slow since `slow_since`.
    pub(crate) slow: f64,
    slow_since: Instant,
    /// Time that the autopilot's clock has lost all at once, µs; negative if the clock has gained time.
    pub(crate) lost_us: i64,
    pub(crate) echoes: bool,
    /// True while the autopilot sends no positions.
    pub(crate) is_mute_of_positions: bool,
    /// Additional age of the positions that their time stamps do not show, simulation steps.
    pub(crate) hidden_lag: usize,
    track: Vec<Point>,
    rates: Vec<(u32, Duration, Instant)>,
    sequence: u8,
    /// Time at which the autopilot's present failsafe began.
    fell_at: Instant,
    /// Time at which the companion sent the newest target.
    sent_at: Instant,
    /// Number of times that a PX4 resumed OFFBOARD because the companion sent targets in a failsafe.
    ///
    /// Only failsafes of which the companion already knew are counted.
    pub(crate) resumed: u32,
    /// Number of times that a PX4 resumed OFFBOARD before the companion knew of the failsafe.
    pub(crate) resumed_late: u32,
    pub(crate) requests: Vec<u32>,
}

impl Real {
    pub(crate) fn new(kind: Kind, axis: Axis, at: Point, now: Instant) -> Self {
        let body = Body {
            at,
            ..Body::default()
        };
        Self {
            kind,
            axis,
            body,
            armed: false,
            in_air: false,
            chosen: Mode::Sticks,
            mode: Mode::Sticks,
            is_critical: false,
            gps: true,
            gps_lost_at: now,
            fence_x_m: f64::INFINITY,
            is_breached: false,
            target: None,
            last_target_at: None,
            stream_since: now,
            hold: at,
            began: now,
            away_until: None,
            slow: 0.0,
            slow_since: now,
            lost_us: 0,
            echoes: true,
            is_mute_of_positions: false,
            hidden_lag: 0,
            track: Vec::new(),
            rates: Self::rates(now),
            sequence: 0,
            fell_at: now,
            sent_at: now,
            resumed: 0,
            resumed_late: 0,
            requests: Vec::new(),
        }
    }

    fn rates(now: Instant) -> Vec<(u32, Duration, Instant)> {
        vec![(0, Duration::from_millis(1_000), now)]
    }

    pub(crate) fn take_off(&mut self) {
        (self.armed, self.in_air) = (true, true);
    }

    /// Sets the pilot's mode. Returns true if the autopilot accepts it.
    pub(crate) fn choose(&mut self, now: Instant, mode: Mode) -> bool {
        if self.away_until.is_some() || !self.in_air {
            return false;
        }
        let streamed = self.last_target_at.is_some_and(|at| now.since(at) <= LOST);
        if self.kind == Kind::Px4 && mode == Mode::Companion && !(streamed && self.gps) {
            return false;
        }
        if self.kind == Kind::ArduCopter && !self.gps && mode != Mode::Sticks {
            return false;
        }
        if self.mode != mode {
            self.target = None;
        }
        self.chosen = mode;
        self.body.sum = [0.0; 3];
        self.fall(mode, false);
        true
    }

    fn fail(&mut self, now: Instant, mode: Mode) {
        if !self.is_critical {
            self.fell_at = now;
        }
        self.fall(mode, true);
    }

    fn fall(&mut self, mode: Mode, is_critical: bool) {
        if self.mode != mode {
            self.hold = self.body.at;
        }
        (self.mode, self.is_critical) = (mode, is_critical);
    }

    pub(crate) fn lose_gps(&mut self, now: Instant) {
        if self.gps {
            (self.gps, self.gps_lost_at) = (false, now);
        }
    }

    pub(crate) fn restart(&mut self, until: Instant) {
        self.away_until = Some(until);
        self.chosen = Mode::Hold;
        self.fall(Mode::Hold, false);
        (self.target, self.last_target_at) = (None, None);
    }

    /// Advances the simulation by one time step. Returns the bytes that the autopilot sends.
    pub(crate) fn step(&mut self, now: Instant) -> Vec<u8> {
        if self.in_air {
            self.decide(now);
            self.fly(now);
        }
        self.track.push(self.body.at);
        if self.away_until.is_some_and(|until| until > now) {
            return Vec::new();
        }
        if self.away_until.take().is_some() {
            self.began = now;
            self.lost_us = 0;
            self.slow_since = now;
            self.rates = Self::rates(now);
        }
        let mut bytes = Vec::new();
        for i in 0..self.rates.len() {
            let (id, interval, due) = self.rates[i];
            if due <= now {
                self.rates[i].2 = now + interval;
                if let Some(payload) = self.payload(now, id) {
                    bytes.extend(self.frame(id, &payload));
                }
            }
        }
        bytes
    }

    fn decide(&mut self, now: Instant) {
        match self.kind {
            Kind::Px4 => {
                let streamed = self.last_target_at.is_some_and(|at| now.since(at) <= LOST);
                if !streamed {
                    self.stream_since = now;
                }
                if !self.gps {
                    self.fail(now, Mode::Land);
                } else if self.chosen == Mode::Companion {
                    if !streamed {
                        self.fail(now, Mode::Hold);
                    } else if self.is_critical && now.since(self.stream_since) >= RESUMES {
                        // The failsafe is reported within a second and received within 0.3 s.
                        let known_at = self.fell_at + KNOWN_WITHIN;
                        if self.sent_at > known_at {
                            self.resumed += 1;
                        } else {
                            self.resumed_late += 1;
                        }
                        self.fall(Mode::Companion, false);
                    }
                } else {
                    self.fall(self.chosen, false);
                }
            }
            Kind::ArduCopter => {
                if !self.gps && now.since(self.gps_lost_at) >= RECKONS {
                    self.chosen = Mode::Land;
                    self.fall(Mode::Land, true);
                }
                self.is_breached = self.body.at[0] > self.fence_x_m;
                if self.is_breached && self.mode == Mode::Companion {
                    self.chosen = Mode::Return;
                    self.fall(Mode::Return, false);
                }
                if self.gps && self.mode != Mode::Land {
                    self.is_critical = false;
                }
            }
        }
    }

    fn fly(&mut self, now: Instant) {
        let gains = match self.kind {
            Kind::Px4 => &PX4,
            Kind::ArduCopter => &ARDUCOPTER,
        };
        match (self.mode, &mut self.target) {
            (Mode::Companion, Some(told)) => {
                if self.kind == Kind::ArduCopter {
                    if self
                        .last_target_at
                        .is_some_and(|at| now.since(at) > VELOCITY)
                    {
                        told.velocity = [0.0; 3];
                    }
                    // The target continues with its velocity.
                    for i in 0..3 {
                        told.to[i] += told.velocity[i] * STEP_S;
                    }
                }
                self.body.fly(told.to, told.velocity, gains);
            }
            (Mode::Return, _) => self.body.fly([0.0, 0.0, 30.0], [0.0; 3], gains),
            (Mode::Land, _) if !self.gps => {
                // The drone drifts in an unknown direction.
                self.body.fly_at([0.6, 0.3, 0.0], gains);
            }
            _ => self.body.fly(self.hold, [0.0; 3], gains),
        }
    }

    /// Flies the drone for one step at `velocity`, m/s, as if the pilot used the sticks.
    ///
    /// The drone has that velocity at once.
    pub(crate) fn shove(&mut self, velocity: Point) {
        self.body.fly_at(velocity, &PX4);
        self.hold = self.body.at;
    }

    /// Makes the autopilot's clock run slow by the fraction `slow` from `now` on.
    pub(crate) fn slow_clock(&mut self, now: Instant, slow: f64) {
        self.slow = slow;
        self.slow_since = now;
    }

    fn boot_ms(&self, now: Instant) -> u32 {
        let us = now.since(self.began).as_micros().cast_signed();
        let slow = now.since(self.slow_since).as_micros() as f64 * self.slow;
        ((us - slow as i64 - self.lost_us).max(0) / 1_000) as u32
    }

    fn payload(&self, now: Instant, id: u32) -> Option<Vec<u8>> {
        let mut payload = Vec::new();
        match id {
            0 => {
                let custom: u32 = match (self.kind, self.mode) {
                    (Kind::Px4, Mode::Sticks) => 3 << 16,
                    (Kind::Px4, Mode::Hold) => 4 << 16 | 3 << 24,
                    (Kind::Px4, Mode::Companion) => 6 << 16,
                    (Kind::Px4, Mode::Return) => 4 << 16 | 5 << 24,
                    (Kind::Px4, Mode::Land) => 4 << 16 | 6 << 24,
                    (Kind::ArduCopter, Mode::Sticks) => 16,
                    (Kind::ArduCopter, Mode::Hold) => 5,
                    (Kind::ArduCopter, Mode::Companion) => 4,
                    (Kind::ArduCopter, Mode::Return) => 6,
                    (Kind::ArduCopter, Mode::Land) => 9,
                };
                let autopilot = if self.kind == Kind::Px4 { 12 } else { 3 };
                let armed = if self.armed { 129 } else { 1 };
                let status = match (self.is_critical, self.armed) {
                    (true, _) => 5,
                    (false, true) => 4,
                    (false, false) => 3,
                };
                payload.extend(custom.to_le_bytes());
                payload.extend([2, autopilot, armed, status, 3]);
            }
            33 => {
                // Without GPS a PX4 sends no position; an ArduCopter uses dead reckoning.
                if self.is_mute_of_positions || !self.gps && self.kind == Kind::Px4 {
                    return None;
                }
                let was = self.track.len().saturating_sub(1 + self.hidden_lag);
                let at = self.point(self.track[was])?;
                payload.extend(self.boot_ms(now).to_le_bytes());
                for part in [at.lat_e7, at.lon_e7, at.amsl_mm, 0] {
                    payload.extend(part.to_le_bytes());
                }
                payload.extend([0; 8]);
            }
            245 => payload.extend([0, if self.in_air { 2 } else { 1 }]),
            87 if self.kind == Kind::ArduCopter && self.mode == Mode::Companion => {
                let at = self.point(self.target?.to)?;
                payload.extend(self.boot_ms(now).to_le_bytes());
                payload.extend(at.lat_e7.to_le_bytes());
                payload.extend(at.lon_e7.to_le_bytes());
                payload.extend([0; 36]);
                payload.extend([0xF8, 0x0D, 5]);
            }
            162 if self.kind == Kind::ArduCopter && self.fence_x_m.is_finite() => {
                payload.extend([0; 6]);
                payload.extend([u8::from(self.is_breached), 0]);
            }
            _ => return None,
        }
        Some(payload)
    }

    fn point(&self, at: Point) -> Option<Geodetic> {
        self.axis.point(placement(at))
    }

    fn frame(&mut self, id: u32, payload: &[u8]) -> Vec<u8> {
        let [a, b, c, _] = id.to_le_bytes();
        let length = payload.len() as u8;
        let mut frame = vec![0xFD, length, 0, 0, self.sequence, 1, 1, a, b, c];
        self.sequence = self.sequence.wrapping_add(1);
        frame.extend(payload);
        let known = find_known(id).unwrap();
        let sum = checksum(&frame[1..], known);
        frame.extend(sum.to_le_bytes());
        frame
    }

    /// Receives a frame that was sent at `sent_at`. Returns the bytes of its answer.
    pub(crate) fn handle_frame(&mut self, now: Instant, sent_at: Instant, frame: &[u8]) -> Vec<u8> {
        if self.away_until.is_some() {
            return Vec::new();
        }
        let mut payload = frame[10..frame.len() - 2].to_vec();
        payload.resize(64, 0);
        let long = |at: usize| i32::from_le_bytes(payload[at..at + 4].try_into().unwrap());
        let float = |at: usize| f32::from_le_bytes(payload[at..at + 4].try_into().unwrap());
        match u32::from_le_bytes([frame[7], frame[8], frame[9], 0]) {
            76 => {
                let id = float(0) as u32;
                self.requests.push(id);
                let has = [33, 245].contains(&id)
                    || self.kind == Kind::ArduCopter && [87, 162].contains(&id);
                if has {
                    self.rates.retain(|(of, ..)| *of != id);
                    let interval = Duration::from_micros(float(4) as u64);
                    self.rates.push((id, interval, now));
                }
                let result = if has { 0 } else { 2 };
                self.frame(77, &[255, 1, result, 0, 0, 0, 0, 0, 0, 0])
            }
            86 => {
                self.sent_at = sent_at;
                self.handle_target(now, &payload, long, float);
                Vec::new()
            }
            111 if self.echoes => {
                let mut answer = (now.as_micros() * 1_000).to_le_bytes().to_vec();
                answer.extend(&payload[8..16]);
                self.frame(111, &answer)
            }
            _ => Vec::new(),
        }
    }

    fn handle_target(
        &mut self,
        now: Instant,
        payload: &[u8],
        long: impl Fn(usize) -> i32,
        float: impl Fn(usize) -> f32,
    ) {
        let at = make::geodetic(long(4), long(8), (f64::from(float(12)) * 1e3) as i32);
        let mask = u16::from_le_bytes([payload[48], payload[49]]);
        let place = self.axis.place(at).unwrap();
        let to = [place.x_m, place.y_m, place.altitude_m].map(f64::from);
        let mut velocity = [0.0; 3];
        if mask & 0b11_1000 == 0 {
            // Conversion from north, east and down to the axis.
            let unit = |way| self.axis.to_ned(place.x_m, way).map(f64::from);
            let [x, y] = [unit([1.0, 0.0, 0.0]), unit([0.0, 1.0, 0.0])];
            let ned = [16, 20, 24].map(|at| f64::from(float(at)));
            velocity = [
                ned[0] * x[0] + ned[1] * x[1],
                ned[0] * y[0] + ned[1] * y[1],
                -ned[2],
            ];
        }
        if self.last_target_at.is_none_or(|at| now.since(at) > LOST) {
            self.stream_since = now;
        }
        if self.mode == Mode::Companion && to[0] <= self.fence_x_m {
            self.target = Some(SentTarget { to, velocity });
            self.last_target_at = Some(now);
        } else if self.kind == Kind::Px4 {
            // A PX4 in its failsafe flies to the target once it resumes.
            self.target = Some(SentTarget { to, velocity });
            self.last_target_at = Some(now);
        }
    }
}

pub(crate) fn placement(at: Point) -> Placement {
    make::placement(at[0] as f32, at[1] as f32, at[2] as f32)
}
