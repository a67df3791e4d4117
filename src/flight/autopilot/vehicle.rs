//! State of the autopilot, from received messages.
//!
//! The state includes the autopilot's kind, reports and clock, the delay of the link, the drone's position, and the
//! noise measured by a SiK radio.

use super::state::{FlightMode, Kind, Observed};
use crate::features::SENSING;
use crate::flight::axis::Axis;
use crate::flight::mavlink::frame::Address;
use crate::flight::mavlink::incoming::{Incoming, Received, noise_w};
use crate::flight::mavlink::outgoing::SET_MESSAGE_INTERVAL;
use crate::geodetic::Geodetic;
use crate::place::Placement;
use crate::sample::Sample;
use crate::time::{Duration, Instant};

/// Time without a heartbeat after which the autopilot counts as gone.
pub(super) const SILENT: Duration = Duration::from_millis(3_000);

/// Age at which a received position of the drone is too old to be used.
pub(super) const STALE: Duration = Duration::from_millis(1_000);

/// Time without a message of the autopilot after which a PX4 is possibly in its failsafe. Messages about the battery or
/// the home position do not count.
///
/// A PX4 enters its failsafe after a second without a target, and a target is sent every 0.2 s.
const GAP: Duration = Duration::from_millis(800);

/// Assumed maximum time from the measurement of a position to the transmission of its message.
const MEASURED: Duration = Duration::from_millis(300);

/// MAVLink component number of an autopilot.
pub(super) const AUTOPILOT: u8 = 1;

/// Flag of `MAV_MODE_FLAG`: the custom mode is valid.
const CUSTOM_MODE: u8 = 1;
/// Flag of `MAV_MODE_FLAG`: the vehicle is armed.
const ARMED: u8 = 128;

/// Value of `MAV_LANDED_STATE` for a vehicle on the ground.
const ON_GROUND: u8 = 1;
/// Value of `MAV_LANDED_STATE` for a vehicle in the air.
const IN_AIR: u8 = 2;
/// Value of `MAV_LANDED_STATE` for a landing vehicle.
const LANDING: u8 = 4;

/// Value of `MAV_STATE` for a PX4 outside of a failsafe.
const ACTIVE: u8 = 4;
/// Value of `MAV_STATE` for a PX4 in a failsafe.
const CRITICAL: u8 = 5;

/// Measured position and velocity of the drone, and the time of the measurement.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Position {
    /// Time of the autopilot's position measurement, on the relay's clock.
    pub at: Instant,
    /// Position of the drone in the mission's coordinates.
    pub place: Placement,
    /// Velocity of the drone toward north, east and down, m/s.
    pub velocity_m_s: [f32; 3],
}

/// New information in a received MAVLink message.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum VehicleUpdate {
    /// The message is not from the autopilot, or has no new information.
    Nothing,
    /// The message is the first one of an autopilot on this link.
    Found,
    /// The message shows that the autopilot has restarted.
    Restarted,
    /// The message has new information, which can change the control state.
    StateChanged,
    /// The message has a new position of the drone, in the mission's coordinates.
    Position(Position),
    /// The message has a position of the drone too far from the line Tx-Rx for the mission's coordinates.
    OffLine(Geodetic),
    /// Target that the autopilot reports: latitude and longitude, 1e-7 degrees.
    Target(i32, i32),
    /// Value of `MAV_RESULT` in the autopilot's answer to a request for a message.
    RequestResult(u8),
}

/// State of the autopilot and the drone, as known from received messages.
#[expect(
    clippy::struct_excessive_bools,
    reason = "observations that are independent of each other"
)]
#[derive(Clone, Debug, Default)]
pub(super) struct Vehicle {
    known: Option<(Address, Kind)>,
    heard_at: Option<Instant>,
    /// Time of the last message received from the autopilot; `None` before the first. Messages about the battery or the
    /// home position do not count.
    frame_at: Option<Instant>,
    mode: u32,
    /// True while the autopilot is in OFFBOARD or GUIDED, in which the relay sets the target.
    granted: bool,
    /// Value of `MAV_STATE` in the autopilot's last heartbeat.
    status: u8,
    /// True if the present mode OFFBOARD or GUIDED counts as the pilot's choice. In any other mode: true if the next
    /// change to OFFBOARD or GUIDED will count as the pilot's choice. See [`Self::review_choice`].
    chosen: bool,
    armed: bool,
    in_air: bool,
    /// Start of the time in which the autopilot reports "on the ground". `None` while the autopilot does not report
    /// this.
    grounded_at: Option<Instant>,
    /// True while the drone is outside of the autopilot's geofence.
    pub(super) is_breached: bool,
    clock: RemoteClock,
    pub(super) echo: Echo,
    /// Measurement time of the last position; `None` before the first. Positions too far from the line Tx to Rx count,
    /// too.
    measured_at: Option<Instant>,
    position: Option<Position>,
    /// Position to return to (HOME_POSITION); `None` if unknown.
    home: Option<Geodetic>,
    pub(super) battery: Battery,
}

impl Vehicle {
    /// Processes a received message. After the first heartbeat of an autopilot, messages of all other senders are
    /// ignored, because the port can also receive other vehicles.
    pub(super) fn read(&mut self, now: Instant, received: &Received, axis: &Axis) -> VehicleUpdate {
        let from = received.from;
        let Some(message) = received.message else {
            return VehicleUpdate::Nothing;
        };
        let found = self.known.is_none();
        if found {
            let Incoming::Heartbeat {
                kind, autopilot, ..
            } = message
            else {
                return VehicleUpdate::Nothing;
            };
            let Some(kind) = Kind::of(autopilot, kind).filter(|_| from.component == AUTOPILOT)
            else {
                return VehicleUpdate::Nothing;
            };
            self.known = Some((from, kind));
        }
        if self.address() != Some(from) {
            return VehicleUpdate::Nothing;
        }
        // The battery's messages come at their own rate. Battery messages do not show that the link works.
        if self.read_battery(now, message) {
            return VehicleUpdate::StateChanged;
        }
        // A gap in the reception counts even if no timeout was handled in it.
        self.review_choice(now);
        self.frame_at = Some(now);
        let heard = self.take(now, message, axis);
        if found { VehicleUpdate::Found } else { heard }
    }

    fn take(&mut self, now: Instant, message: Incoming, axis: &Axis) -> VehicleUpdate {
        match message {
            Incoming::Heartbeat {
                base_mode,
                custom_mode,
                status,
                ..
            } => {
                self.heard_at = Some(now);
                self.mode = custom_mode;
                self.status = status;
                let says_mode = base_mode & CUSTOM_MODE != 0;
                self.granted = says_mode && self.mode() == Some(FlightMode::Companion);
                let is_armed = base_mode & ARMED != 0;
                // A flight has ended. A PX4 that has landed without the pilot is in OFFBOARD again.
                self.chosen &= is_armed || !self.armed;
                self.armed = is_armed;
                if says_mode && !self.granted && !self.is_late(now) {
                    self.chosen |= match self.kind() {
                        Some(Kind::Px4) => status == ACTIVE,
                        _ => status < CRITICAL,
                    };
                }
                self.review_choice(now);
                // The landed state has to be reported again after each take-off.
                self.in_air &= self.armed;
                VehicleUpdate::StateChanged
            }
            Incoming::ExtendedSysState { landed_state } => {
                let is_grounded = landed_state == ON_GROUND;
                self.grounded_at = is_grounded.then_some(self.grounded_at.unwrap_or(now));
                self.in_air = match landed_state {
                    IN_AIR => self.armed,
                    LANDING => self.in_air,
                    _ => false,
                };
                VehicleUpdate::StateChanged
            }
            Incoming::GlobalPosition {
                boot_ms,
                lat_e7,
                lon_e7,
                amsl_mm,
                velocity_cm_s,
            } => {
                let Some(at) = self.clock.creation_time(now, boot_ms) else {
                    self.restart();
                    return VehicleUpdate::Restarted;
                };
                // The message was sent after the last answered request, and its position was measured shortly before it
                // was sent.
                let floor = self.echo.floor().map(|at| {
                    Instant::from_micros(at.as_micros().saturating_sub(MEASURED.as_micros()))
                });
                let at = at.max(floor.unwrap_or(at)).min(now);
                self.measured_at = Some(at);
                if self.kind() == Some(Kind::Px4) {
                    self.chosen &= now.since(at) < STALE;
                }
                let point = Geodetic {
                    lat_e7,
                    lon_e7,
                    amsl_mm,
                };
                let Some(place) = axis.place(point) else {
                    // Without a fix the reported position is latitude 0, longitude 0, which is near no usable line.
                    return if (lat_e7, lon_e7) != (0, 0) && point.is_valid() {
                        VehicleUpdate::OffLine(point)
                    } else {
                        VehicleUpdate::Nothing
                    };
                };
                let position = Position {
                    at,
                    place,
                    velocity_m_s: velocity_cm_s.map(|v| f32::from(v) / 100.0),
                };
                self.position = Some(position);
                VehicleUpdate::Position(position)
            }
            Incoming::PositionTargetGlobal { lat_e7, lon_e7, .. } => {
                VehicleUpdate::Target(lat_e7, lon_e7)
            }
            Incoming::FenceStatus { is_breached } => {
                self.is_breached = is_breached;
                VehicleUpdate::StateChanged
            }
            // A TIMESYNC request of the autopilot contains no time stamp of this link.
            Incoming::TimeSync {
                answered: 1..,
                asked,
            } => {
                self.echo.handle_reply(now, asked);
                VehicleUpdate::StateChanged
            }
            Incoming::CommandAck {
                command: SET_MESSAGE_INTERVAL,
                result,
            } => VehicleUpdate::RequestResult(result),
            _ => VehicleUpdate::Nothing,
        }
    }

    /// Withdraws the right to control the drone if the mode has possibly changed without the pilot.
    ///
    /// A PX4 in its failsafe resumes OFFBOARD once it receives targets. In OFFBOARD a PX4 enters its failsafe after a
    /// second without a target. So a PX4 is sent targets only after it has reported a mode other than OFFBOARD outside
    /// of a failsafe. The report must be newer than the start of the link, the last failsafe, and the last time at
    /// which the link was interrupted or late.
    ///
    /// An ArduCopter does not change to GUIDED without the pilot. It only needs to have reported another mode once
    /// since the start of the link and since its last silence.
    pub(super) fn review_choice(&mut self, now: Instant) {
        let before = |at: Option<Instant>, limit| at.is_some_and(|at| now.since(at) < limit);
        self.chosen &= match self.kind() {
            Some(Kind::Px4) => {
                before(self.heard_at, SILENT)
                    && before(self.frame_at, GAP)
                    && !self.echo.is_late(now)
                    && !self.is_critical()
            }
            Some(Kind::ArduCopter) => before(self.heard_at, SILENT),
            None => false,
        };
    }

    /// Withdraws the right to control the drone: the pilot has to choose OFFBOARD or GUIDED again. Needed if a target
    /// to a PX4 is overdue, or the relay's readiness has changed.
    pub(super) const fn unchoose(&mut self) {
        self.chosen = false;
    }

    /// Returns true if the autopilot's messages are possibly delayed, so that they show an earlier state.
    pub(super) fn is_late(&self, now: Instant) -> bool {
        self.echo.is_late(now) || self.measured_at.is_none_or(|at| now.since(at) >= STALE)
    }

    /// Returns true once a time stamp of the autopilot was received.
    pub(super) const fn has_time_stamp(&self) -> bool {
        self.measured_at.is_some()
    }

    /// Returns true while the autopilot is in a failsafe.
    pub(super) const fn is_critical(&self) -> bool {
        self.status >= CRITICAL
    }

    pub(super) const fn is_granted(&self) -> bool {
        self.granted
    }

    pub(super) const fn is_chosen(&self) -> bool {
        self.chosen
    }

    pub(super) fn mode(&self) -> Option<FlightMode> {
        Some(FlightMode::of(self.kind()?, self.mode))
    }

    /// Discards the state that was received from an autopilot before it restarted.
    fn restart(&mut self) {
        self.heard_at = None;
        self.granted = false;
        self.chosen = false;
        self.is_breached = false;
        self.echo.restart();
        self.measured_at = None;
        self.armed = false;
        self.in_air = false;
        self.grounded_at = None;
        self.position = None;
        self.home = None;
    }

    /// Converts the stored position to the coordinates of a new line from Tx to Rx. The function `moved` converts a
    /// position. If `moved` returns `None`, the stored position is dropped.
    pub(super) fn move_places(&mut self, moved: impl Fn(Placement) -> Option<Placement>) {
        self.position = self.position.and_then(|position| {
            let place = moved(position.place)?;
            Some(Position { place, ..position })
        });
    }

    /// Records a message about the battery or the home position. Returns false, and records nothing, for any other
    /// message.
    fn read_battery(&mut self, now: Instant, message: Incoming) -> bool {
        match message {
            // On the ground a PX4 computes the remaining time from an assumed current.
            Incoming::Battery {
                battery,
                percent,
                remaining_s,
            } => {
                if self.battery.is_first(now, battery) {
                    let is_flying = self.armed && self.in_air;
                    self.battery.newest =
                        is_flying.then(|| self.battery.left_s(percent, remaining_s));
                }
            }
            Incoming::Home(at) => self.home = Some(at).filter(|at| at.is_valid()).or(self.home),
            _ => return false,
        }
        true
    }

    /// Returns true if the drone is disarmed, or has reported for [`LANDED`] that it is on the ground.
    pub(super) fn is_landed(&self, now: Instant) -> bool {
        let is_grounded = self.grounded_at.is_some_and(|at| now.since(at) >= LANDED);
        self.heard_at.is_some() && (!self.armed || is_grounded)
    }

    /// Returns the newest remaining time of flight and the time of the flight home, s.
    ///
    /// `None` without a new remaining time since the last call, or if the home position is unknown. NaN stands for a
    /// time that is unknown. The time of the flight home is NaN without a recent position, or if the home position is
    /// too far from the line Tx to Rx.
    pub(super) fn take_endurance(&mut self, now: Instant, axis: &Axis) -> Option<[f32; 2]> {
        let remaining_s = self.battery.newest.take()?;
        let home = axis.place(self.home?);
        let [_, return_m_s, descent_m_s] = self.battery.setup.unwrap_or(Battery::UNSET);
        let recent = |position: &Position| now.since(position.at) < OLD;
        let way = home.zip(self.position.filter(recent));
        let home_s = way.map_or(f32::NAN, |(to, Position { place: from, .. })| {
            let level_m = libm::hypotf(from.x_m - to.x_m, from.y_m - to.y_m);
            let height_m = (from.altitude_m - to.altitude_m).abs();
            level_m / return_m_s + height_m / descent_m_s
        });
        Some([remaining_s, home_s])
    }

    pub(super) fn address(&self) -> Option<Address> {
        self.known.map(|(address, _)| address)
    }

    pub(super) fn kind(&self) -> Option<Kind> {
        self.known.map(|(_, kind)| kind)
    }

    /// Returns the drone's last position; `None` if it is unknown or too old.
    pub(super) fn position(&self, now: Instant) -> Option<Position> {
        self.position
            .filter(|position| now.since(position.at) < STALE && !self.echo.is_late(now))
    }

    /// Returns the observations that determine the control state at `now`.
    pub(super) fn observed(&self, now: Instant) -> Observed {
        Observed {
            is_received: self.heard_at.is_some_and(|at| now.since(at) < SILENT),
            flying: self.armed && self.in_air,
            granted: self.granted && self.chosen,
            located: self.position(now).is_some(),
        }
    }

    /// Returns the drone's position if it is recent and the drone is in the air; otherwise `None`.
    pub(super) fn place_in_air(&self, now: Instant) -> Option<Placement> {
        let position = self.position(now)?;
        (self.armed && self.in_air).then_some(position.place)
    }

    /// Returns the next time at which this state changes without a new message; `None` if there is none.
    ///
    /// At that time a received value becomes too old to be used, or a TIMESYNC request is due.
    pub(super) fn next_timeout(&self, now: Instant) -> Option<Instant> {
        let silent = self.heard_at.map(|at| at + SILENT);
        let gap = self.frame_at.map(|at| at + GAP);
        let stale = self.position.map(|position| position.at + STALE);
        let position_stale = self.measured_at.map(|at| at + STALE);
        let all = [silent, gap, stale, position_stale].into_iter().flatten();
        all.chain(self.echo.next_timeout(now))
            .filter(|at| *at > now)
            .min()
    }
}

/// Time for which an armed drone must report to be on the ground before it counts as landed.
///
/// A single wrong report in flight then has no effect.
const LANDED: Duration = Duration::from_millis(2_000);
/// Age at which a BATTERY_STATUS or a position is no longer used to compute the endurance.
///
/// SYS_STATUS is used instead of an old BATTERY_STATUS. With an old position the time of the flight home is unknown.
const OLD: Duration = Duration::from_millis(10_000);
/// Factor on the remaining time of flight that the autopilot reports. The factor leaves a reserve of 10 %.
const CERTAIN: f32 = 0.9;

/// Remaining time of flight according to the battery's messages.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Battery {
    /// Arguments of `Autopilot::set_endurance`; `None` before its first call. While it is `None`, the values
    /// [`UNSET`](Self::UNSET) are used, and no battery messages are requested.
    pub(super) setup: Option<[f32; 3]>,
    detailed_at: Option<Instant>,
    /// New remaining time of flight, s; NaN if the battery's message contains no valid value. `None` on the ground, and
    /// from a read of the value until the next battery message.
    newest: Option<f32>,
}

impl Battery {
    const UNSET: [f32; 3] = [f32::NAN, 5.0, 1.5];

    /// Returns true if a message about the battery with the number `battery` is used. BATTERY_STATUS is used for
    /// battery 0. SYS_STATUS (`battery` is `None`) is used only if no BATTERY_STATUS of battery 0 came for 10 s.
    fn is_first(&mut self, now: Instant, battery: Option<u8>) -> bool {
        if battery == Some(0) {
            self.detailed_at = Some(now);
        }
        let is_only = self.detailed_at.is_none_or(|at| now.since(at) >= OLD);
        battery.map_or(is_only, |id| id == 0)
    }

    /// Returns the remaining time of flight, s: the reported time, or one computed from the percentage.
    ///
    /// NaN if the percentage is not valid. A PX4 then has no estimate of the time either.
    #[expect(clippy::cast_precision_loss, reason = "some hours at most")]
    fn left_s(&self, percent: i8, remaining_s: i32) -> f32 {
        if !(0..=100).contains(&percent) {
            f32::NAN
        } else if remaining_s > 0 {
            CERTAIN * remaining_s as f32
        } else {
            f32::from(percent) / 100.0 * self.setup.unwrap_or(Self::UNSET)[0]
        }
    }
}

/// Newest noise measurement of a SiK radio: the drone's position, and the noise power in W. `None` once the measurement
/// has been read.
#[derive(Clone, Debug)]
pub(super) struct RadioNoise(Option<(Placement, f32)>);

impl RadioNoise {
    pub(super) const NONE: Self = Self(None);

    /// Records the noise of a RADIO_STATUS message if the drone is in the air at a known position.
    pub(super) fn record(&mut self, now: Instant, received: &Received, vehicle: &Vehicle) {
        if SENSING && let Some(Incoming::RadioStatus { noise, .. }) = received.message {
            let heard = vehicle.place_in_air(now).zip(noise_w(noise));
            self.0 = heard.or(self.0);
        }
    }

    /// Removes and returns the noise measurement; `None` if there is no new one.
    pub(super) fn take(&mut self) -> Option<Sample> {
        let (at, power_w) = self.0.take()?;
        Some(Sample::Heard { at, power_w })
    }
}

const PERIOD: Duration = Duration::from_millis(500);

/// Age of the newest answered TIMESYNC request at which the link counts as late.
const LATE: Duration = Duration::from_millis(1_500);

const SUPPORT_TIMEOUT: Duration = Duration::from_millis(10_000);

/// Maximum age of a TIMESYNC request whose reply is still accepted.
const OLDEST: Duration = Duration::from_millis(60_000);

/// Number of low bits of a TIMESYNC time stamp that contain the link's tag, which marks its requests. The higher bits
/// contain the link's time in µs, enough for 200 days. The autopilot returns all bits unchanged.
const SHIFT: u32 = 20;
/// Tag in the TIMESYNC requests of a link whose seed was not set.
const TAG: u32 = 0xA_52A5;

/// Delay of the link to the autopilot, measured by echoes (TIMESYNC). It gives an upper bound of the age of received
/// messages.
///
/// A cable, a radio or a router can buffer bytes for seconds. A heartbeat has no time stamp, and the autopilot's clock
/// can run slow. So the link sends its time twice a second, and the autopilot returns it. Bytes stay in order: a
/// message received after a reply was sent after the request, so it is not older than the request.
///
/// A request has a tag, drawn at each start of the companion. So a reply buffered since before a restart does not
/// count.
///
/// An autopilot that has not replied within [`SUPPORT_TIMEOUT`] of the first request does not support echoes. Then only
/// the time stamps of its positions show their ages. Until then a link that has just started counts as late. An
/// autopilot that has replied once counts as late whenever it does not reply.
#[derive(Clone, Copy, Debug)]
pub(super) struct Echo {
    /// Tag in the low bits of every request. The tag shows which replies belong to this link.
    tag: u32,
    due: Option<Instant>,
    /// Time of the first TIMESYNC request; `None` before it.
    begun_at: Option<Instant>,
    /// Time of the newest answered TIMESYNC request; `None` without a reply.
    answered_at: Option<Instant>,
}

impl Default for Echo {
    fn default() -> Self {
        Self {
            tag: TAG,
            due: None,
            begun_at: None,
            answered_at: None,
        }
    }
}

impl Echo {
    /// Sets the tag of this link's TIMESYNC requests, derived from `seed`.
    ///
    /// The tag shows which replies belong to this link.
    pub(super) const fn seed(&mut self, seed: u32) {
        self.tag = (seed ^ seed >> 12 ^ TAG) & ((1 << SHIFT) - 1);
    }

    /// Forgets all TIMESYNC requests and replies.
    pub(super) fn restart(&mut self) {
        *self = Self {
            tag: self.tag,
            ..Self::default()
        };
    }

    /// Returns the time stamp of the TIMESYNC request to send at `now`; `None` if none is due.
    pub(super) fn take(&mut self, now: Instant) -> Option<u64> {
        if self.due.is_some_and(|due| due > now) {
            return None;
        }
        self.due = Some(now + PERIOD);
        self.begun_at = self.begun_at.or(Some(now));
        Some(now.as_micros() << SHIFT | u64::from(self.tag))
    }

    /// Processes the reply to a TIMESYNC request. `question` is the request's time stamp.
    pub(super) fn handle_reply(&mut self, now: Instant, question: u64) {
        let asked_at = Instant::from_micros(question >> SHIFT);
        let is_own = question & ((1 << SHIFT) - 1) == u64::from(self.tag) && asked_at <= now;
        if is_own && now.since(asked_at) < OLDEST {
            self.answered_at = self.answered_at.max(Some(asked_at));
        }
    }

    /// Returns the earliest time at which a message received now can have been sent; `None` if unknown.
    ///
    /// This is the time of the last answered TIMESYNC request, because messages arrive in order.
    pub(super) const fn floor(&self) -> Option<Instant> {
        self.answered_at
    }

    /// Returns true while the autopilot's messages are possibly older than [`LATE`].
    pub(super) fn is_late(&self, now: Instant) -> bool {
        match (self.answered_at, self.begun_at) {
            (Some(at), _) => now.since(at) >= LATE,
            (None, Some(at)) => now.since(at) < SUPPORT_TIMEOUT,
            (None, None) => true,
        }
    }

    /// Returns the time of the next TIMESYNC request or the next change of [`is_late`](Self::is_late). `None` if
    /// neither is pending.
    pub(super) fn next_timeout(&self, now: Instant) -> Option<Instant> {
        let late = self.answered_at.map(|at| at + LATE).filter(|at| *at > now);
        let all = [self.due, late, self.begun_at.map(|at| at + SUPPORT_TIMEOUT)];
        all.into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// Minimum backward step of the autopilot's clock that counts as a restart, µs.
const RESTARTED_US: i64 = 2_000_000;

/// Half of the time window in which the minimum delay is determined. Every 4 s a new half replaces the older half, so
/// that the minimum covers the last 4 to 8 s.
const HALF: Duration = Duration::from_millis(4_000);

/// Minimum number of messages in a half of the time window (see [`HALF`]) before the next half begins.
///
/// With fewer messages, a half could contain only the late messages after a pause of the link. The delay of these late
/// messages would then count as normal.
const LEAST: u8 = 8;

/// Exponent of the assumed maximum drift between the clocks of relay and autopilot: 2^-10 of the time.
///
/// With a faster drift, messages seem late: the drift during the time window counts as delay.
const DRIFT: u32 = 10;

/// Conversion from the autopilot's clock to the relay's clock.
///
/// The conversion uses the minimum difference between the two clocks, which belongs to the message with the least
/// delay. A message can be late because the link is slow. It can also seem late because the autopilot's clock has lost
/// time. Then every later message would count as late if the minimum were never renewed. So the minimum is renewed
/// within 4 s to 8 s of messages. After a lasting change of the link's delay or of the clock, messages count as late
/// only for that long.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RemoteClock {
    known: Option<Anchor>,
}

#[derive(Clone, Copy, Debug)]
struct Anchor {
    /// Minimum difference between the two clocks, µs: the relay's clock minus the autopilot's clock. The first number
    /// is for the previous half of the time window, the second for the present half.
    least: [i64; 2],
    since: Instant,
    messages: u8,
    /// Last message: its arrival on the relay's clock, and its creation on the autopilot's clock, µs.
    last: (Instant, i64),
}

impl RemoteClock {
    /// Returns the time on the relay's clock at which the autopilot created a message. The message arrived at `now`,
    /// and was created `boot_ms` after the autopilot's start. `None` if the autopilot has restarted.
    pub(super) fn creation_time(&mut self, now: Instant, boot_ms: u32) -> Option<Instant> {
        let boot_us = i64::from(boot_ms) * 1_000;
        let difference = now.as_micros().cast_signed().saturating_sub(boot_us);
        let known = self.known.get_or_insert(Anchor {
            least: [difference; 2],
            since: now,
            messages: 0,
            last: (now, boot_us),
        });
        let (before, boot_us_before) = core::mem::replace(&mut known.last, (now, boot_us));
        let back = boot_us_before.saturating_sub(boot_us);
        if back > RESTARTED_US {
            self.known = None;
            self.creation_time(now, boot_ms);
            return None;
        }
        // Messages arrive in order. So if the autopilot's clock goes back, the clock has lost time; the link is not
        // slower.
        let lost = back.max(0);
        let drifted = (now.since(before).as_micros() >> DRIFT).cast_signed();
        if now.since(known.since) >= HALF && known.messages >= LEAST {
            let [_, this] = known.least;
            known.least = [this, difference];
            known.since = now;
            known.messages = 0;
        }
        known.messages = known.messages.saturating_add(1);
        known.least = known.least.map(|least| least + lost + drifted);
        let [_, this] = &mut known.least;
        *this = difference.min(*this);
        let [earlier, this] = known.least;
        let late = difference.saturating_sub(earlier.min(this)).max(0);
        let now = now.as_micros();
        Some(Instant::from_micros(
            now.saturating_sub(late.cast_unsigned()),
        ))
    }
}

/// Converts `micros`, µs, to milliseconds, which wrap after 49 days like the autopilot's milliseconds.
///
/// It uses 32-bit divisions only, because a 64-bit division takes a kilobyte of flash.
#[expect(clippy::cast_possible_truncation, reason = "eight years are 48 bits")]
pub(super) const fn millis(micros: u64) -> u32 {
    let high = (micros >> 16) as u32;
    let low = ((high % 1_000) << 16) | (micros & 0xFFFF) as u32;
    ((high / 1_000) << 16).wrapping_add(low / 1_000)
}

/// Minimum time between two reports that the drone is too far from the line Tx to Rx.
const AGAIN: Duration = Duration::from_millis(10_000);

/// Age at which a position too far from the line Tx to Rx is no longer used.
const STALE_OFF_LINE: Duration = Duration::from_millis(3_000);

/// Position of a drone too far from the line Tx to Rx for the mission's coordinates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OffLine {
    /// Position of the drone as reported by the autopilot.
    pub at: Geodetic,
    /// Distance of the drone along the ground from the nearest point of the line Tx to Rx, m.
    pub away_m: u32,
}

impl OffLine {
    /// Returns the position `at` and its distance from the line `axis`. `None` if the latitude or longitude of `at` is
    /// invalid. Constant work.
    pub fn new(at: Geodetic, axis: &Axis) -> Option<Self> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "no distance on earth is longer"
        )]
        let away_m = axis.away_m(at)? as u32;
        Some(Self { at, away_m })
    }
}

/// Detection of a drone that is too far from the line Tx to Rx for the mission's coordinates.
///
/// It detects Tx and Rx positions with latitude and longitude swapped. Such positions are valid, and no other check
/// finds the mistake.
///
/// | position | effect |
/// | --- | --- |
/// | near the line | re-arms the report on the ground |
/// | off the line, on the ground | reported once |
/// | off the line, in the air | reported at most once in 10 s |
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OffLineDetector {
    newest: Option<(Instant, Geodetic)>,
    reported_at: Option<Instant>,
    /// True once a drone on the ground was reported as off the line; false once it is near the line.
    reported_on_ground: bool,
}

impl OffLineDetector {
    /// Records a position too far from the line Tx to Rx. Returns true if a report is due.
    ///
    /// In the air a report is due at most once in 10 s. On the ground only the first position is reported, until the
    /// drone has been near the line again.
    pub(super) fn record(&mut self, now: Instant, at: Geodetic, is_in_air: bool) -> bool {
        self.newest = Some((now, at));
        let is_wanted = is_in_air || !self.reported_on_ground;
        let is_due = self.reported_at.is_none_or(|at| now.since(at) >= AGAIN);
        if !is_wanted || !is_due {
            return false;
        }
        self.reported_at = Some(now);
        self.reported_on_ground |= !is_in_air;
        true
    }

    /// Records that the drone is near the line Tx to Rx. After that, the next position on the ground that is far from
    /// the line is reported again.
    pub(super) const fn returned(&mut self) {
        self.newest = None;
        self.reported_on_ground = false;
    }

    /// Returns the newest position if it is far from the line and less than 3 s old; otherwise `None`.
    pub(super) fn newest(&self, now: Instant) -> Option<Geodetic> {
        let fresh = self
            .newest
            .filter(|(at, _)| now.since(*at) < STALE_OFF_LINE);
        fresh.map(|(_, at)| at)
    }
}

#[cfg(test)]
mod tests {
    use super::Echo;
    use crate::time::{Duration, Instant};

    #[test]
    fn a_reply_to_a_request_of_another_start_is_ignored() {
        let at = |ms| Instant::from_millis(ms);
        let mut before = Echo::default();
        before.seed(1);
        let asked = before.take(at(5_000)).expect("the first question");
        let mut after = Echo::default();
        after.seed(2);
        after.restart();
        let own = after.take(at(5_100)).expect("the first question");
        after.handle_reply(at(5_200), asked);
        assert_eq!(after.floor(), None);
        after.handle_reply(at(5_200), own);
        assert_eq!(after.floor(), Some(at(5_100)));
        assert!(
            !after.is_late(at(5_200)) && after.is_late(at(5_100) + Duration::from_millis(1_500))
        );
    }

    /// Checks that the link counts as late until a TIMESYNC request has been sent.
    #[test]
    fn the_delay_is_unknown_before_the_first_request() {
        assert!(Echo::default().is_late(Instant::ZERO));
    }
}

#[cfg(test)]
mod clock_tests {
    use super::{RemoteClock, millis};
    use crate::time::Instant;

    const fn at(ms: u64) -> Instant {
        Instant::from_millis(ms)
    }

    /// Simulates messages over a link with delays. Returns the age of each message that [`RemoteClock`] computes, ms.
    ///
    /// The autopilot sends a message every 200 ms for 80 s. `clock_ms` and `delay` return the autopilot's clock and the
    /// link's delay at a time; all are in ms.
    fn ages(clock_ms: impl Fn(u64) -> u64, delay: impl Fn(u64) -> u64) -> heapless::Vec<u64, 512> {
        let mut clock = RemoteClock::default();
        let mut all = heapless::Vec::new();
        for made in (0..80_000).step_by(200) {
            let came = at(made + delay(made));
            let boot_ms = u32::try_from(clock_ms(made)).expect("short");
            let true_at = clock.creation_time(came, boot_ms).expect("no restart");
            all.push(came.since(true_at).as_micros() / 1_000)
                .expect("room");
        }
        all
    }

    #[test]
    fn a_late_message_has_an_earlier_creation_time() {
        let mut clock = RemoteClock::default();
        assert_eq!(clock.creation_time(at(10_000), 500), Some(at(10_000)));
        assert_eq!(clock.creation_time(at(10_200), 700), Some(at(10_200)));
        let late = clock.creation_time(at(10_480), 900).expect("no restart");
        assert_eq!(at(10_480).since(late).as_micros() / 1_000, 79, "80 ms late");
        // A faster message shows that all earlier messages were late.
        assert_eq!(clock.creation_time(at(10_550), 1_100), Some(at(10_550)));
        let late = clock.creation_time(at(10_800), 1_300).expect("no restart");
        assert_eq!(at(10_800).since(late).as_micros() / 1_000, 49, "50 ms late");
    }

    #[test]
    fn a_clock_that_drifts_is_followed() {
        let mut clock = RemoteClock::default();
        // The relay's clock is faster than the autopilot's by 500 in a million: it gains half a second.
        for i in 0..5_000_u32 {
            let now = Instant::from_micros(u64::from(i) * 200_100);
            let true_at = clock.creation_time(now, i * 200).expect("the same start");
            assert!(now.since(true_at).as_micros() <= 100, "{i}");
        }
    }

    /// Checks that messages count as recent even if the autopilot's clock runs 1 % slow. The clock of a simulator on a
    /// loaded machine can run as slowly.
    #[test]
    fn a_clock_that_runs_one_percent_slow_is_never_blind() {
        let ages = ages(|ms| ms - ms / 100, |_| 5);
        let most = ages.iter().max();
        assert!(most.is_some_and(|most| *most < 120), "{most:?} ms");
    }

    #[test]
    fn a_clock_that_stops_briefly_is_followed_within_8_s() {
        let ages = ages(
            |ms| if ms < 20_000 { ms } else { ms - 1_500 },
            |ms| if (20_000..20_001).contains(&ms) { 5 } else { 6 },
        );
        assert!(ages.iter().skip(145).all(|age| *age < 20), "{ages:?}");
    }

    /// Checks a link whose delay jumps from 5 ms to 1.5 s. In the 3 s after the jump, messages count as more than 1 s
    /// old. From 9 s after the jump, the new delay counts as normal.
    #[test]
    fn a_delay_that_grows_is_late_at_first() {
        let ages = ages(|ms| ms, |ms| if ms < 20_000 { 5 } else { 1_500 });
        assert!(ages.iter().skip(101).take(15).all(|age| *age > 1_000));
        assert!(ages.iter().skip(145).all(|age| *age < 20));
    }

    /// Checks messages that a cable delivers all at once after 7 s. The first message counts as 7 s old. Messages that
    /// were created later count as less old.
    #[test]
    fn a_burst_after_a_gap_is_old() {
        let held = 20_000..27_000;
        let ages = ages(
            |ms| ms,
            |ms| if held.contains(&ms) { 27_000 - ms } else { 5 },
        );
        for (i, age) in ages.iter().enumerate().skip(100).take(35) {
            let expected = 27_000 - 200 * u64::try_from(i).expect("small");
            assert!(age.abs_diff(expected) < 40, "{i}: {age}, {expected}");
        }
        assert!(ages.iter().skip(136).all(|age| *age < 40));
    }

    #[test]
    fn a_restart_of_the_clock_is_reported_once() {
        let mut clock = RemoteClock::default();
        assert!(clock.creation_time(at(100_000), 90_000).is_some());
        assert_eq!(clock.creation_time(at(101_000), 50), None);
        assert_eq!(clock.creation_time(at(101_200), 250), Some(at(101_200)));
    }

    #[test]
    fn milliseconds_are_those_of_a_division() {
        let mut micros = 0_u64;
        for step in 0..40_000_u64 {
            let wrapped = u32::try_from(micros / 1_000 % (1 << 32));
            assert_eq!(Ok(millis(micros)), wrapped, "{micros}");
            micros = (micros * 3 + step) % (1 << 48);
        }
    }
}
