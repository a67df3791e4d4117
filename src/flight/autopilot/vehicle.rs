//! Reports of the autopilot: its state, the drone's position, and what a SiK radio hears there.

use super::clock::RemoteClock;
use super::echo::Echo;
use super::kind::Kind;
use super::mode::FlightMode;
use super::state::Observed;
use crate::flight::axis::Axis;
use crate::flight::mavlink::frame::Address;
use crate::flight::mavlink::incoming::{Incoming, Received, noise_w};
use crate::flight::mavlink::outgoing::SET_MESSAGE_INTERVAL;
use crate::geodetic::Geodetic;
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// Silence after which the autopilot counts as gone.
pub(super) const SILENT: Duration = Duration::from_millis(3_000);

/// Maximum age of a position that is used.
pub(super) const STALE: Duration = Duration::from_millis(1_000);

/// Silence of the link that may have caused a failsafe of a PX4. A PX4 enters its failsafe after a second without a target, and a
/// target is sent every 0.2 s.
const GAP: Duration = Duration::from_millis(800);

/// Maximum time between the measurement of a position and its message.
const MEASURED: Duration = Duration::from_millis(300);

/// Component number of the autopilot.
pub(super) const AUTOPILOT: u8 = 1;

/// Flags of `MAV_MODE_FLAG`.
const CUSTOM_MODE: u8 = 1;
const ARMED: u8 = 128;

/// Values of `MAV_LANDED_STATE`.
const IN_AIR: u8 = 2;
const LANDING: u8 = 4;

/// Values of `MAV_STATE`: a PX4 outside of a failsafe, and in one.
const ACTIVE: u8 = 4;
const CRITICAL: u8 = 5;

/// Measured position of the drone, and its time.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Position {
    /// Time of the measurement, on the relay's clock.
    pub at: Instant,
    /// Position in the mission's coordinates.
    pub place: Placement,
    /// Velocity toward north, east and down, m/s.
    pub velocity_m_s: [f32; 3],
}

/// Result of a received message.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum VehicleUpdate {
    /// Message of another sender, or without new information.
    Nothing,
    /// First message of an autopilot.
    Found,
    /// Restart of the autopilot.
    Restarted,
    /// New information that changes the state.
    News,
    /// Position of the drone.
    Position(Position),
    /// Position of the drone, too far from the line for a place along it.
    OffLine(Geodetic),
    /// Target that the autopilot reports.
    Target(i32, i32),
    /// Answer to a request for a message, with its `MAV_RESULT`.
    Answer(u8),
}

/// Known state of the autopilot.
#[expect(
    clippy::struct_excessive_bools,
    reason = "observations that are independent of each other"
)]
#[derive(Clone, Debug, Default)]
pub(super) struct Vehicle {
    known: Option<(Address, Kind)>,
    heard_at: Option<Instant>,
    /// Time of the last message of any kind.
    frame_at: Option<Instant>,
    mode: u32,
    /// True while the mode is OFFBOARD or GUIDED.
    granted: bool,
    /// Last `MAV_STATE`.
    status: u8,
    /// True once the mode may be granted: see [`Self::review_choice`].
    chosen: bool,
    armed: bool,
    in_air: bool,
    /// True while the drone is outside of the autopilot's fence.
    pub(super) is_breached: bool,
    clock: RemoteClock,
    pub(super) echo: Echo,
    /// Measurement time of the last position, near the line or not.
    told_at: Option<Instant>,
    position: Option<Position>,
}

impl Vehicle {
    /// Processes a message. The first sender that identifies itself as an autopilot is kept for good, since other vehicles may be
    /// received through it.
    pub(super) fn hear(&mut self, now: Instant, received: &Received, axis: &Axis) -> VehicleUpdate {
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
        // A gap counts even if no timeout was handled meanwhile.
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
                // A flight has ended. A PX4 that landed by itself is in OFFBOARD again.
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
                VehicleUpdate::News
            }
            Incoming::ExtendedSysState { landed_state } => {
                self.in_air = match landed_state {
                    IN_AIR => self.armed,
                    LANDING => self.in_air,
                    _ => false,
                };
                VehicleUpdate::News
            }
            Incoming::GlobalPosition {
                boot_ms,
                lat_e7,
                lon_e7,
                amsl_mm,
                velocity_cm_s,
            } => {
                let Some(at) = self.clock.hear(now, boot_ms) else {
                    self.restart();
                    return VehicleUpdate::Restarted;
                };
                // The message was sent after the question of the last echo, and the position was measured shortly before that.
                let floor = self.echo.floor().map(|at| {
                    Instant::from_micros(at.as_micros().saturating_sub(MEASURED.as_micros()))
                });
                let at = at.max(floor.unwrap_or(at)).min(now);
                self.told_at = Some(at);
                if self.kind() == Some(Kind::Px4) {
                    self.chosen &= now.since(at) < STALE;
                }
                let point = Geodetic {
                    lat_e7,
                    lon_e7,
                    amsl_mm,
                };
                let Some(place) = axis.place(point) else {
                    // Without a fix the position is 0, 0, which is near no line worth flying.
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
                VehicleUpdate::News
            }
            // A question of the autopilot contains no time of this link.
            Incoming::TimeSync {
                answered: 1..,
                asked,
            } => {
                self.echo.hear(now, asked);
                VehicleUpdate::News
            }
            Incoming::CommandAck {
                command: SET_MESSAGE_INTERVAL,
                result,
            } => VehicleUpdate::Answer(result),
            _ => VehicleUpdate::Nothing,
        }
    }

    /// Clears the pilot's choice of a mode if the autopilot may change the mode by itself. It may also have done so before.
    ///
    /// A PX4 in its failsafe resumes OFFBOARD by itself once it receives targets, and in OFFBOARD it enters its failsafe after a
    /// second without one. A PX4 is therefore sent targets only after it has reported a mode other than OFFBOARD outside of a
    /// failsafe: since the link started, since the last failsafe, and since the link was last interrupted or late. An ArduCopter
    /// does not change to GUIDED by itself. There another mode since the start of the link and since the last silence is enough.
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

    /// Clears the pilot's choice, because targets were not sent in time.
    pub(super) const fn unchoose(&mut self) {
        self.chosen = false;
    }

    /// Returns true if messages of the autopilot may be older than they seem.
    pub(super) fn is_late(&self, now: Instant) -> bool {
        self.echo.is_late(now) || self.told_at.is_none_or(|at| now.since(at) >= STALE)
    }

    /// Returns true once a time stamp of the autopilot was received.
    pub(super) const fn is_told(&self) -> bool {
        self.told_at.is_some()
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

    /// Discards all reports of an autopilot that has restarted.
    fn restart(&mut self) {
        self.heard_at = None;
        self.granted = false;
        self.chosen = false;
        self.is_breached = false;
        self.echo.restart();
        self.told_at = None;
        self.armed = false;
        self.in_air = false;
        self.position = None;
    }

    /// Converts the positions to another line.
    pub(super) fn move_places(&mut self, moved: impl Fn(Placement) -> Option<Placement>) {
        self.position = self.position.and_then(|position| {
            let place = moved(position.place)?;
            Some(Position { place, ..position })
        });
    }

    pub(super) fn address(&self) -> Option<Address> {
        self.known.map(|(address, _)| address)
    }

    pub(super) fn kind(&self) -> Option<Kind> {
        self.known.map(|(_, kind)| kind)
    }

    /// Returns the drone's position if it is known and recent.
    pub(super) fn position(&self, now: Instant) -> Option<Position> {
        self.position
            .filter(|position| now.since(position.at) < STALE && !self.echo.is_late(now))
    }

    /// Returns the observations that determine the state.
    pub(super) fn observed(&self, now: Instant) -> Observed {
        Observed {
            there: self.heard_at.is_some_and(|at| now.since(at) < SILENT),
            flying: self.armed && self.in_air,
            granted: self.granted && self.chosen,
            located: self.position(now).is_some(),
        }
    }

    /// Returns the drone's position if it is known, recent, and in the air.
    pub(super) fn place_in_air(&self, now: Instant) -> Option<Placement> {
        let position = self.position(now)?;
        (self.armed && self.in_air).then_some(position.place)
    }

    /// Returns the time at which the known values expire without new messages.
    pub(super) fn next_timeout(&self, now: Instant) -> Option<Instant> {
        let silent = self.heard_at.map(|at| at + SILENT);
        let gap = self.frame_at.map(|at| at + GAP);
        let stale = self.position.map(|position| position.at + STALE);
        let told = self.told_at.map(|at| at + STALE);
        let all = [silent, gap, stale, told].into_iter().flatten();
        all.chain(self.echo.next_timeout(now))
            .filter(|at| *at > now)
            .min()
    }
}

/// True if this crate was built with the feature `sensing`.
const SENSING: bool = cfg!(feature = "sensing");

/// Newest noise measurement that was not taken yet.
#[derive(Clone, Debug)]
pub(super) struct RadioNoise(Option<(Placement, f32)>);

impl RadioNoise {
    pub(super) const NONE: Self = Self(None);

    /// Records the noise of a RADIO_STATUS message.
    pub(super) fn hear(&mut self, now: Instant, received: &Received, vehicle: &Vehicle) {
        if SENSING && let Some(Incoming::RadioStatus { noise, .. }) = received.message {
            let heard = vehicle.place_in_air(now).zip(noise_w(noise));
            self.0 = heard.or(self.0);
        }
    }

    /// Removes the measurement, for the relay.
    pub(super) fn take(&mut self) -> Option<Sample> {
        let (at, power_w) = self.0.take()?;
        Some(Sample::Heard { at, power_w })
    }
}
