//! Drones with simulated autopilots, connected to their relays by MAVLink.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::{Autopilot, Kind};
use uav_relay::flight::axis::Axis;
use uav_relay::flight::mavlink::frame::{CHECKSUM, HEADER, MAGIC, checksum, find_known, id};
use uav_relay::{Duration, Geodetic, Instant, Placement, Sites};

use super::drones::{Body, Point, placement, point, sum};

/// Takeover of a drone by its pilot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Takeover {
    /// Number of the relay whose drone is taken over, from 1.
    pub relay: u16,
    /// Start of the takeover.
    pub from: Instant,
    /// End of the takeover; `None` if it is permanent.
    ///
    /// After the end the pilot hands the drone back to its relay, as soon as this drone hovers and no drone near it
    /// moves.
    pub until: Option<Instant>,
    /// Position to which the pilot flies the drone, m: x from Tx toward Rx, y to the right, and height.
    ///
    /// `None` to climb in place.
    pub to: Option<Point>,
}

/// Parameters of all drones with autopilots in a run.
#[derive(Clone, PartialEq, Debug)]
pub struct FleetSpec {
    /// Geographic line from Tx to Rx along which the drones fly.
    pub axis: Axis,
    /// Position at which each pilot first hands the drone to its relay: x, y to the right, and height, m.
    ///
    /// The drone takes off from the ground below.
    pub start: Vec<Point>,
    /// Takeovers of drones by their pilots.
    pub takeovers: Vec<Takeover>,
    /// Restarts of autopilots in flight: the relay's number, from 1, and the time.
    pub restarts: Vec<(u16, Instant)>,
    /// Standard deviation of the gusts that move the drones, m/s per axis.
    pub gust_mps: f64,
    /// Bound on each drone's constant position error per axis, m.
    pub bias_m: f64,
    /// Bound on the additional error of each position report per axis, m.
    pub noise_m: f64,
}

impl FleetSpec {
    /// Returns the autopilot of drone `index` (from 0): PX4 for even numbers, ArduCopter for odd ones.
    const fn kind(index: usize) -> Kind {
        if index.is_multiple_of(2) {
            Kind::Px4
        } else {
            Kind::ArduCopter
        }
    }
}

/// Returns a geographic line of `distance_m` metres at an arbitrary place. Used for a scenario without such a line.
///
/// The line leads eastward from 47.4 N, 8.54 E. `None` if no line can have this length.
pub fn somewhere(distance_m: f64) -> Option<Axis> {
    const TX: [f64; 2] = [47.4, 8.54];
    let tx = Geodetic::from_degrees(TX[0], TX[1], 420.0)?;
    let line = |east_deg: f64| {
        let rx = Geodetic::from_degrees(TX[0], TX[1] + east_deg, 420.0)?;
        Axis::try_new(tx, rx).ok()
    };
    // A degree of longitude is about 75 km there; two iterations reach the resolution of the coordinates.
    let mut east_deg = distance_m / 75_000.0;
    for _ in 0..3 {
        east_deg *= distance_m / line(east_deg)?.distance_m();
    }
    line(east_deg)
}

/// Random-number stream of the first drone; each further drone has the next stream.
const DRONES: u64 = 1_000;

/// Largest speed of a drone between positions, m/s.
const SPEED_MPS: f64 = 10.0;
/// Largest speed of a drone at take-off and landing, m/s.
const CLIMB_MPS: f64 = 2.0;
/// Largest acceleration of a drone, m/s².
const ACCELERATION_MPS2: f64 = 3.0;

/// Time without a position target after which a PX4 leaves OFFBOARD and hovers (`COM_OBL_RC_ACT` 5).
const LOST: Duration = Duration::from_millis(1_000);

/// Time with position targets after which a PX4 in its failsafe resumes OFFBOARD by itself.
const RESUMES: Duration = Duration::from_millis(1_200);

/// Time that the restart of an autopilot takes. The autopilot is silent meanwhile.
const AWAY: Duration = Duration::from_millis(3_000);

/// Maximum time after which a relay knows a new flight mode or state of its autopilot.
///
/// The autopilot reports both once a second.
const MODE_KNOWN_WITHIN: Duration = Duration::from_millis(1_500);

/// Height by which a drone climbs when its pilot takes it over without a destination, m. The climb takes the drone out
/// of the chain.
const ASIDE_M: f64 = 15.0;

/// Value of MAVLink's `MAV_LANDED_STATE` for a drone on the ground.
const ON_GROUND: u8 = 1;
/// Value of MAVLink's `MAV_LANDED_STATE` for a drone in flight.
const IN_AIR: u8 = 2;
/// Value of MAVLink's `MAV_LANDED_STATE` for a drone that takes off.
const TAKING_OFF: u8 = 3;
/// Value of MAVLink's `MAV_LANDED_STATE` for a drone that lands.
const LANDING: u8 = 4;

#[derive(Clone, Copy, Debug)]
struct Rate {
    id: u32,
    interval: Option<Duration>,
    due: Instant,
}

/// Simulated drone with its autopilot and pilot, and the MAVLink connection of its relay.
#[derive(Debug)]
pub(super) struct Vehicle {
    kind: Kind,
    spec: FleetSpec,
    pub(super) link: Autopilot,
    /// Geographic positions of Tx and Rx from an uploaded mission that the relay uses. `None` if the relay's mission
    /// has the original positions.
    pub(super) sites: Option<Sites>,
    pilot: Pilot,
    body: Body,
    gust: Point,
    bias: Point,
    armed: bool,
    landed: u8,
    mode: Mode,
    /// Position, m, to which the autopilot flies the drone. The drone hovers at this position.
    goal: Point,
    /// Height at which the pilot first hands the drone to its relay, m.
    climbs_to_m: f64,
    /// True while the pilot sees no drone that moves near this drone.
    pub(super) is_clear: bool,
    last_target_at: Option<Instant>,
    /// True while a PX4 is in its failsafe. The PX4 resumes OFFBOARD once it receives a stream of targets.
    is_failing: bool,
    streamed_since: Instant,
    began: Instant,
    away_until: Option<Instant>,
    rates: [Rate; 4],
    sequence: u8,
    /// End of a period in which position targets do not count as errors even if the autopilot rejects them.
    ///
    /// The period begins when the autopilot's mode or state changes, because the relay may not know the change yet.
    unknown_until: Instant,
    pub(super) strays: u64,
    rng: ChaCha8Rng,
}

impl Vehicle {
    /// Creates drone `index` (from 0) on the ground, with errors and gusts drawn from `seed`.
    pub(super) fn new(spec: &FleetSpec, index: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(DRONES + u64::try_from(index).unwrap_or(0));
        let start = spec.start.get(index).copied().unwrap_or_default();
        let at = [start[0], start[1], 0.0];
        let bias = [0; 3].map(|_| spec.bias_m * rng.random_range(-1.0..=1.0));
        Self {
            kind: FleetSpec::kind(index),
            link: Autopilot::new(spec.axis, Pace::default(), Instant::ZERO),
            sites: None,
            pilot: Pilot::new(index, &spec.takeovers),
            body: Body::hovering(at),
            gust: [0.0; 3],
            bias,
            armed: false,
            landed: ON_GROUND,
            mode: Mode::Manual,
            goal: at,
            climbs_to_m: start[2],
            is_clear: true,
            last_target_at: None,
            is_failing: false,
            streamed_since: Instant::ZERO,
            began: Instant::ZERO,
            away_until: None,
            rates: Self::rates(Instant::ZERO),
            sequence: 0,
            unknown_until: Instant::ZERO,
            strays: 0,
            rng,
            spec: spec.clone(),
        }
    }

    /// Returns the rates at which an autopilot sends messages after its start: heartbeats only.
    fn rates(now: Instant) -> [Rate; 4] {
        let often = Some(Duration::from_millis(1_000));
        [
            (id::HEARTBEAT, often),
            (id::GLOBAL_POSITION_INT, None),
            (id::EXTENDED_SYS_STATE, None),
            (id::POSITION_TARGET_GLOBAL_INT, None),
        ]
        .map(|(id, interval)| Rate {
            id,
            interval,
            due: now,
        })
    }

    /// Returns the geographic line from Tx to Rx in the mission that the relay uses. An uploaded mission may have a
    /// line that differs from the original one.
    fn line(&self) -> Axis {
        let moved = self.sites.and_then(|sites| Axis::between(sites).ok());
        moved.unwrap_or(self.spec.axis)
    }

    /// Returns the drone's true position, m, relative to the line from Tx to Rx of its relay's mission.
    pub(super) fn along(&self) -> Point {
        if self.sites.is_none() {
            return self.body.at;
        }
        let on_earth = self.spec.axis.point(placement(self.body.at));
        let along = on_earth.and_then(|at| self.line().place(at));
        along.map_or([f64::NAN; 3], point)
    }

    /// Converts a position in the relay's mission, m, to the coordinates at the start of the run.
    ///
    /// Both are relative to a line from Tx to Rx, which an uploaded mission can move. `None` if the position is too far
    /// from the original line.
    pub(super) fn in_run_coordinates(&self, place: Placement) -> Option<Point> {
        let on_earth = self.line().point(place)?;
        self.spec.axis.place(on_earth).map(point)
    }

    pub(super) const fn at(&self) -> Point {
        self.body.at
    }

    /// Returns true while the drone moves at more than 0.5 m/s along any axis.
    pub(super) fn moves(&self) -> bool {
        self.body.velocity_mps.iter().any(|v| v.abs() > 0.5)
    }

    pub(super) const fn flies(&self) -> bool {
        self.landed != ON_GROUND
    }

    /// Returns true unless the pilot has taken the drone over.
    pub(super) fn is_not_taken_over(&self, now: Instant) -> bool {
        !self.pilot.has_control(now)
    }

    /// Returns true if the autopilot or the relay controls the drone in flight.
    ///
    /// False on the ground, during take-off and landing, and while the pilot controls it.
    pub(super) fn is_automatic(&self, now: Instant) -> bool {
        self.landed == IN_AIR && self.mode != Mode::Manual && self.is_not_taken_over(now)
    }

    /// Restarts the autopilot in flight. The autopilot is silent for the time [`AWAY`].
    pub(super) fn restart(&mut self, now: Instant) {
        self.away_until = Some(now + AWAY);
        self.mode = Mode::Hold;
        self.is_failing = false;
        // A climb continues: no pilot would hand over a drone that stopped on the way up.
        if self.landed == IN_AIR {
            self.goal = self.estimated_position();
        }
        self.last_target_at = None;
        self.pilot.schedule_hand_over_after_restart(now);
    }

    /// Restarts the relay's side of the MAVLink connection, as after a reboot of the relay. The state of the
    /// connection is lost.
    pub(super) fn boot(&mut self, now: Instant) {
        self.link = Autopilot::new(self.spec.axis, Pace::default(), now);
        self.sites = None;
        self.pilot.schedule_hand_over_after_restart(now);
    }

    pub(super) fn land(&mut self) {
        if self.landed == IN_AIR {
            self.landed = LANDING;
            self.mode = Mode::Manual;
            self.goal = self.estimated_position();
            self.goal[2] = self.bias[2];
        }
    }

    /// Moves the drone for `step_s` seconds, up to `now`, and sends due MAVLink messages to its relay.
    pub(super) fn go_on(&mut self, now: Instant, step_s: f64) {
        self.choose(now);
        self.fly(step_s);
        if self.away_until.is_some_and(|until| until > now) {
            return;
        }
        if self.away_until.take().is_some() {
            self.began = now;
            self.rates = Self::rates(now);
        }
        for which in 0..self.rates.len() {
            let Some(rate) = self.rates.get_mut(which) else {
                continue;
            };
            if let Some(interval) = rate.interval
                && rate.due <= now
            {
                rate.due = now + interval;
                let id = rate.id;
                if let Some(says) = self.message(now, id) {
                    self.sequence = self.sequence.wrapping_add(1);
                    self.link.handle_bytes(now, &says.frame(self.sequence));
                }
            }
        }
    }

    /// Updates the flight mode and the flight state, by decisions of the pilot and of the autopilot.
    ///
    /// For the time [`MODE_KNOWN_WITHIN`] after a change, rejected position targets of the relay do not count as
    /// errors, because the relay may not know the change yet.
    fn choose(&mut self, now: Instant) {
        let before = (self.landed, self.mode);
        self.decide(now);
        if before != (self.landed, self.mode) {
            self.unknown_until = now + MODE_KNOWN_WITHIN;
        }
    }

    /// Returns true if the relay may send position targets now.
    ///
    /// Only a drone in flight or landing accepts targets: a PX4 in any mode, an ArduCopter only while the relay
    /// controls it.
    fn accepts_targets(&self) -> bool {
        match self.landed {
            IN_AIR | LANDING => self.kind == Kind::Px4 || self.mode == Mode::Companion,
            _ => false,
        }
    }

    fn decide(&mut self, now: Instant) {
        if !self.armed && self.pilot.has_armed(now) {
            self.armed = true;
            self.landed = TAKING_OFF;
            self.goal = self.estimated_position();
            self.goal[2] = self.climbs_to_m;
        }
        if self.landed == TAKING_OFF
            && (self.estimated_position()[2] - self.climbs_to_m).abs() < 0.3
        {
            self.landed = IN_AIR;
            self.pilot.schedule_hand_over(now);
        }
        if self.landed == LANDING && self.body.at[2] < 0.2 {
            self.landed = ON_GROUND;
            self.body.velocity_mps = [0.0; 3];
        }
        if self.landed != IN_AIR {
            return;
        }
        let streamed = self.last_target_at.is_some_and(|at| now.since(at) <= LOST);
        let hovers = self.body.velocity_mps.iter().all(|v| v.abs() < 0.3);
        if let Some(mode) = self.pilot.selected_mode(now, hovers && self.is_clear)
            && (mode != self.mode || mode == Mode::Companion)
        {
            let refuses = self.kind == Kind::Px4 && (!streamed || self.is_failing);
            // A mode selected by the pilot ends the failsafe; OFFBOARD is tried again afterwards.
            self.is_failing = false;
            if mode == self.mode {
                // The mode was selected before the link started: change it once so that the link sees the pilot's choice.
                self.mode = Mode::Hold;
                self.goal = self.estimated_position();
                self.pilot.schedule_retry(now);
            } else if refuses && mode == Mode::Companion {
                self.pilot.schedule_retry(now);
            } else {
                self.mode = mode;
                self.goal = self.estimated_position();
                if mode == Mode::Manual {
                    self.goal[2] += ASIDE_M;
                    self.goal = self.pilot.flies_to(now).unwrap_or(self.goal);
                }
            }
        }
        if self.kind == Kind::Px4 && self.mode == Mode::Companion && !streamed {
            self.mode = Mode::Hold;
            self.is_failing = true;
            self.pilot.schedule_hand_over_after_restart(now);
            self.goal = self.estimated_position();
        }
        if !streamed {
            self.streamed_since = now;
        }
        if self.is_failing && now.since(self.streamed_since) >= RESUMES {
            self.mode = Mode::Companion;
            self.is_failing = false;
        }
    }

    fn fly(&mut self, step_s: f64) {
        if !self.flies() {
            return;
        }
        let speed = match self.landed {
            TAKING_OFF | LANDING => CLIMB_MPS,
            _ => SPEED_MPS,
        };
        let to = sum(self.goal, self.bias.map(|part| -part));
        self.body.fly(to, speed, ACCELERATION_MPS2, step_s);
        // Gusts have a correlation time of about 2 s.
        let keeps = (-step_s / 2.0).exp();
        let drawn = self.spec.gust_mps * (3.0 * (1.0 - keeps * keeps)).sqrt();
        for (gust, at) in self.gust.iter_mut().zip(&mut self.body.at) {
            *gust = *gust * keeps + drawn * self.rng.random_range(-1.0..=1.0);
            *at += *gust * step_s;
        }
    }

    /// Returns the position that the drone believes to have, m: the true position plus a constant bias.
    fn estimated_position(&self) -> Point {
        sum(self.body.at, self.bias)
    }

    #[expect(clippy::cast_possible_truncation, reason = "wraps after 49 days")]
    fn message(&mut self, now: Instant, id: u32) -> Option<AutopilotMessage> {
        match id {
            id::HEARTBEAT => Some(AutopilotMessage::Heartbeat {
                autopilot: match self.kind {
                    Kind::Px4 => 12,
                    Kind::ArduCopter => 3,
                },
                armed: self.armed,
                custom_mode: match (self.kind, self.mode) {
                    (Kind::Px4, Mode::Manual) => 3 << 16,
                    (Kind::Px4, Mode::Hold) => 4 << 16 | 3 << 24,
                    (Kind::Px4, Mode::Companion) => 6 << 16,
                    (Kind::ArduCopter, Mode::Manual) => 16,
                    (Kind::ArduCopter, Mode::Hold) => 5,
                    (Kind::ArduCopter, Mode::Companion) => 4,
                },
                is_critical: self.is_failing,
            }),
            id::EXTENDED_SYS_STATE => Some(AutopilotMessage::State {
                landed: self.landed,
            }),
            id::GLOBAL_POSITION_INT => {
                let taken = self.estimated_position();
                let noise = self.spec.noise_m;
                let said = taken.map(|part| part + noise * self.rng.random_range(-1.0..=1.0));
                Some(AutopilotMessage::Position {
                    boot_ms: (now.since(self.began).as_micros() / 1_000) as u32,
                    at: self.spec.axis.point(placement(said))?,
                })
            }
            _ if self.kind == Kind::ArduCopter && self.mode == Mode::Companion => {
                Some(AutopilotMessage::Target {
                    at: self.spec.axis.point(placement(self.goal))?,
                })
            }
            _ => None,
        }
    }

    /// Handles a MAVLink frame from the relay: a requested message rate, a position target or TIMESYNC.
    pub(super) fn handle_frame(&mut self, now: Instant, frame: &[u8]) {
        if self.away_until.is_some() {
            return;
        }
        match parse_frame(frame) {
            Some(RelayMessage::Interval { id, interval_us }) => {
                for rate in self.rates.iter_mut().filter(|rate| rate.id == id) {
                    rate.interval = Some(Duration::from_micros(interval_us));
                    rate.due = now;
                }
            }
            Some(RelayMessage::Target(at)) => {
                let is_stray = !self.accepts_targets() && now > self.unknown_until;
                self.strays += u64::from(is_stray);
                self.last_target_at = Some(now);
                if self.mode == Mode::Companion
                    && let Some(place) = self.spec.axis.place(at)
                {
                    self.goal = point(place);
                }
            }
            Some(RelayMessage::Sync(asked)) => {
                self.sequence = self.sequence.wrapping_add(1);
                let answer = AutopilotMessage::Sync { asked }.frame(self.sequence);
                self.link.handle_bytes(now, &answer);
            }
            None => {}
        }
    }
}

/// Time when the first drone takes off, s.
const FIRST_S: u64 = 5;
/// Time between the take-offs of two successive drones, ms.
const NEXT_MS: u64 = 500;

/// Delay, s, before a pilot hands the drone to its relay: after the climb, or after a failed attempt.
const LOOKS_S: u64 = 2;
/// Delay, s, before a pilot hands the drone to its relay after a failsafe or a restart. The restart may be one of the
/// autopilot or of the relay.
const RECOVERS_S: u64 = 10;

/// Flight mode of a drone: control by the pilot, the autopilot or the relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Mode {
    /// The pilot controls the drone.
    Manual,
    /// The autopilot alone controls the drone: it hovers.
    Hold,
    /// The relay controls the drone by its setpoints.
    Companion,
}

#[derive(Clone, Debug)]
struct Pilot {
    arms_at: Instant,
    /// Time when the pilot next hands the drone over to the relay; `None` if no handover is planned.
    hands_over_at: Option<Instant>,
    takeovers: Vec<Takeover>,
}

impl Pilot {
    fn new(index: usize, all: &[Takeover]) -> Self {
        let later = u64::try_from(index).unwrap_or(0) * NEXT_MS;
        let own = |takeover: &&Takeover| usize::from(takeover.relay) == index + 1;
        Self {
            arms_at: Instant::from_millis(1_000 * FIRST_S + later),
            hands_over_at: None,
            takeovers: all.iter().filter(own).copied().collect(),
        }
    }

    fn has_armed(&self, now: Instant) -> bool {
        now >= self.arms_at
    }

    /// Handles the end of the drone's first climb: the pilot plans to hand the drone over to the relay.
    fn schedule_hand_over(&mut self, now: Instant) {
        // Keep a later hand-over time: the autopilot may have restarted during the climb.
        let looked = now + Duration::from_millis(1_000 * LOOKS_S);
        self.hands_over_at = self.hands_over_at.max(Some(looked));
    }

    /// Plans a new hand-over to the relay, after a restart of the autopilot or the relay, or a failsafe.
    fn schedule_hand_over_after_restart(&mut self, now: Instant) {
        self.hands_over_at = Some(now + Duration::from_millis(1_000 * RECOVERS_S));
    }

    /// Returns the flight mode that the pilot selects now; `None` to keep the present mode.
    ///
    /// `may_hand_over` is false while this drone moves, or a drone near it moves.
    fn selected_mode(&mut self, now: Instant, may_hand_over: bool) -> Option<Mode> {
        if self.has_control(now) {
            // Schedule a hand-over after the takeover.
            self.hands_over_at = Some(now);
            return Some(Mode::Manual);
        }
        if may_hand_over && self.hands_over_at.is_some_and(|at| at <= now) {
            self.hands_over_at = None;
            return Some(Mode::Companion);
        }
        None
    }

    /// Returns the position to which the pilot flies the drone, m. `None` if there is no takeover now, or if the pilot
    /// climbs in place.
    fn flies_to(&self, now: Instant) -> Option<Point> {
        let during = |it: &&Takeover| now >= it.from && it.until.is_none_or(|until| now < until);
        self.takeovers.iter().find(during)?.to
    }

    /// Plans a new attempt to hand the drone over to the relay, after the previous attempt has failed.
    fn schedule_retry(&mut self, now: Instant) {
        self.hands_over_at = Some(now + Duration::from_millis(1_000 * LOOKS_S));
    }

    fn has_control(&self, now: Instant) -> bool {
        let during = |it: &Takeover| now >= it.from && it.until.is_none_or(|until| now < until);
        self.takeovers.iter().any(during)
    }
}

/// MAVLink system ID of the simulated autopilots.
const SYSTEM: u8 = 1;

/// MAVLink message that the simulated autopilot sends.
#[derive(Clone, Copy, Debug)]
enum AutopilotMessage {
    Heartbeat {
        autopilot: u8,
        armed: bool,
        custom_mode: u32,
        /// True if the autopilot reports `MAV_STATE` 5 (critical), which it does in its failsafe.
        is_critical: bool,
    },
    /// Reply to a TIMESYNC request of the relay.
    Sync {
        asked: u64,
    },
    State {
        landed: u8,
    },
    Position {
        boot_ms: u32,
        at: Geodetic,
    },
    Target {
        at: Geodetic,
    },
}

impl AutopilotMessage {
    fn frame(self, sequence: u8) -> Vec<u8> {
        let mut payload = Vec::new();
        let id = match self {
            Self::Heartbeat {
                autopilot,
                armed,
                custom_mode,
                is_critical,
            } => {
                payload.extend(custom_mode.to_le_bytes());
                // Quadrotor; custom mode; active or critical.
                let status = if is_critical { 5 } else { 4 };
                payload.extend([2, autopilot, 1 | if armed { 128 } else { 0 }, status, 3]);
                id::HEARTBEAT
            }
            Self::Sync { asked } => {
                payload.extend(1_u64.to_le_bytes());
                payload.extend(asked.to_le_bytes());
                id::TIMESYNC
            }
            Self::State { landed } => {
                payload.extend([0, landed]);
                id::EXTENDED_SYS_STATE
            }
            Self::Position { boot_ms, at } => {
                payload.extend(boot_ms.to_le_bytes());
                for part in [at.lat_e7, at.lon_e7, at.amsl_mm, 0] {
                    payload.extend(part.to_le_bytes());
                }
                payload.extend([0; 8]);
                id::GLOBAL_POSITION_INT
            }
            Self::Target { at } => {
                payload.extend([0; 4]);
                payload.extend(at.lat_e7.to_le_bytes());
                payload.extend(at.lon_e7.to_le_bytes());
                #[expect(clippy::cast_precision_loss, reason = "the wire has an f32")]
                payload.extend((at.amsl_mm as f32 / 1e3).to_le_bytes());
                payload.extend([0; 32]);
                payload.extend([0xF8, 0x0D, 5]);
                id::POSITION_TARGET_GLOBAL_INT
            }
        };
        framed(id, &payload, sequence)
    }
}

fn framed(id: u32, payload: &[u8], sequence: u8) -> Vec<u8> {
    let [a, b, c, _] = id.to_le_bytes();
    let length = u8::try_from(payload.len()).unwrap_or(u8::MAX);
    let mut frame = vec![MAGIC, length, 0, 0, sequence, SYSTEM, 1, a, b, c];
    frame.extend(payload);
    if let (Some(known), Some(covered)) = (find_known(id), frame.get(1..)) {
        frame.extend(checksum(covered, known).to_le_bytes());
    }
    frame
}

/// MAVLink message that the simulated autopilot receives from the relay.
#[derive(Clone, Copy, PartialEq, Debug)]
enum RelayMessage {
    /// Request to send the message with this `id` every `interval_us` microseconds.
    Interval { id: u32, interval_us: u64 },
    /// Position to which the autopilot is to fly.
    Target(Geodetic),
    /// TIMESYNC request, with the time stamp that the reply repeats.
    Sync(u64),
}

/// Decodes a MAVLink frame from the relay; `None` for messages that the simulated autopilot ignores.
fn parse_frame(frame: &[u8]) -> Option<RelayMessage> {
    let end = frame.len().checked_sub(CHECKSUM)?;
    let header = frame.first_chunk::<HEADER>()?;
    let [.., a, b, c] = *header;
    let payload = frame.get(HEADER..end)?;
    let bytes = |at: usize| [0, 1, 2, 3].map(|i| payload.get(at + i).copied().unwrap_or(0));
    let float = |at| f64::from(f32::from_le_bytes(bytes(at)));
    match u32::from_le_bytes([a, b, c, 0]) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "numbers of messages and microseconds"
        )]
        id::COMMAND_LONG => Some(RelayMessage::Interval {
            id: float(0) as u32,
            interval_us: float(4) as u64,
        }),
        #[expect(clippy::cast_possible_truncation, reason = "millimetres")]
        id::SET_POSITION_TARGET_GLOBAL_INT => Some(RelayMessage::Target(Geodetic {
            lat_e7: i32::from_le_bytes(bytes(4)),
            lon_e7: i32::from_le_bytes(bytes(8)),
            amsl_mm: (float(12) * 1e3).round() as i32,
        })),
        id::TIMESYNC => {
            let [low, high] = [8, 12].map(|at| u64::from(u32::from_le_bytes(bytes(at))));
            Some(RelayMessage::Sync(high << 32 | low))
        }
        _ => None,
    }
}
