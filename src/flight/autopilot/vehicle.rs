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

/// An autopilot that has said nothing for so long is gone.
pub(super) const SILENT: Duration = Duration::from_millis(3_000);

/// A position older than this is none.
pub(super) const STALE: Duration = Duration::from_millis(1_000);

/// A PX4 that hears no target for a second is in its failsafe. A target is sent every 0.2 s, so a link that was interrupted for longer than
/// this may have been the cause of one.
const GAP: Duration = Duration::from_millis(800);

/// A position is said within this time after it was measured.
const MEASURED: Duration = Duration::from_millis(300);

/// The component that is the autopilot.
pub(super) const AUTOPILOT: u8 = 1;

/// `MAV_MODE_FLAG`.
const CUSTOM_MODE: u8 = 1;
const ARMED: u8 = 128;

/// `MAV_LANDED_STATE`.
const IN_AIR: u8 = 2;
const LANDING: u8 = 4;

/// `MAV_STATE`: what a PX4 says outside of a failsafe, and in one.
const ACTIVE: u8 = 4;
const CRITICAL: u8 = 5;

/// Where the drone was, and when.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Position {
    /// When it was there, on the relay's clock.
    pub at: Instant,
    /// Where, as the mission has it.
    pub place: Placement,
    /// Toward north, east and down, m/s.
    pub velocity_m_s: [f32; 3],
}

/// What became of a message.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum VehicleUpdate {
    /// Not from the autopilot, or of no use.
    Nothing,
    /// It is there, for the first time.
    Found,
    /// It was switched off and on.
    Restarted,
    /// Something is known that was not.
    News,
    /// Where the drone is.
    Position(Position),
    /// Where the drone is, too far from the line to have a place along it.
    OffLine(Geodetic),
    /// Where the drone flies to.
    Target(i32, i32),
    /// It has answered a request to send a message: with its `MAV_RESULT`.
    Answer(u8),
}

/// The autopilot, as far as it is known.
#[expect(
    clippy::struct_excessive_bools,
    reason = "observations that are independent of each other"
)]
#[derive(Clone, Debug, Default)]
pub(super) struct Vehicle {
    known: Option<(Address, Kind)>,
    heard_at: Option<Instant>,
    /// When its last message of any kind came.
    frame_at: Option<Instant>,
    mode: u32,
    /// True while the mode is OFFBOARD or GUIDED.
    granted: bool,
    /// `MAV_STATE`.
    status: u8,
    /// True once the mode may be granted: see [`Self::review_choice`].
    chosen: bool,
    armed: bool,
    in_air: bool,
    /// True while it is outside of its fence.
    pub(super) is_breached: bool,
    clock: RemoteClock,
    pub(super) echo: Echo,
    /// When the last position was measured, wherever it was.
    told_at: Option<Instant>,
    position: Option<Position>,
}

impl Vehicle {
    /// Takes a message. Whoever was the first to say that it is an autopilot is the one, for good: another vehicle may be heard through it.
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
        // A gap counts though nobody looked meanwhile.
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
                // A flight has ended, and a PX4 that landed by itself is in OFFBOARD again.
                self.chosen &= is_armed || !self.armed;
                self.armed = is_armed;
                if says_mode && !self.granted && !self.is_late(now) {
                    self.chosen |= match self.kind() {
                        Some(Kind::Px4) => status == ACTIVE,
                        _ => status < CRITICAL,
                    };
                }
                self.review_choice(now);
                // Whether it is in the air is said anew after each take-off.
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
                // It was said after the question of the last echo, and measured shortly before it was said.
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
                    // Before it has a fix it says 0, 0, which is near no line worth flying.
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
            // A question of its own has no time of its own in it.
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

    /// Forgets the pilot's choice of a mode where the autopilot may have changed the mode by itself since, or may do so.
    ///
    /// A PX4 in its failsafe resumes OFFBOARD by itself once it hears targets. In OFFBOARD it is in its failsafe after a second without one.
    /// So a PX4 is streamed targets only after it has shown a mode other than OFFBOARD outside of a failsafe, since the link began, since
    /// the last failsafe, and since the last time that the link was interrupted or late. An ArduCopter changes into no GUIDED by itself:
    /// it is enough that another mode was seen since the link began and since the last silence.
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

    /// Forgets the pilot's choice: targets were not sent when they should have been.
    pub(super) const fn unchoose(&mut self) {
        self.chosen = false;
    }

    /// Returns true if what the autopilot says may be older than it seems.
    pub(super) fn is_late(&self, now: Instant) -> bool {
        self.echo.is_late(now) || self.told_at.is_none_or(|at| now.since(at) >= STALE)
    }

    /// Returns true once a time stamp of the autopilot was heard.
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

    /// It was switched off and on: what it said before is void.
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

    /// Places are along another line.
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

    /// Where the drone is, if that is known by now.
    pub(super) fn position(&self, now: Instant) -> Option<Position> {
        self.position
            .filter(|position| now.since(position.at) < STALE && !self.echo.is_late(now))
    }

    /// What the state follows from.
    pub(super) fn observed(&self, now: Instant) -> Observed {
        Observed {
            there: self.heard_at.is_some_and(|at| now.since(at) < SILENT),
            flying: self.armed && self.in_air,
            granted: self.granted && self.chosen,
            located: self.position(now).is_some(),
        }
    }

    /// Where the drone is, if that is known by now and it is in the air.
    pub(super) fn place_in_air(&self, now: Instant) -> Option<Placement> {
        let position = self.position(now)?;
        (self.armed && self.in_air).then_some(position.place)
    }

    /// When what is known is too old, unless it is said again.
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

/// Whether this crate was built to make anything of it.
const SENSING: bool = cfg!(feature = "sensing");

/// The newest that nobody has taken.
#[derive(Clone, Debug)]
pub(super) struct RadioNoise(Option<(Placement, f32)>);

impl RadioNoise {
    pub(super) const NONE: Self = Self(None);

    /// Takes what was received, if it is of that.
    pub(super) fn hear(&mut self, now: Instant, received: &Received, vehicle: &Vehicle) {
        if SENSING && let Some(Incoming::RadioStatus { noise, .. }) = received.message {
            let heard = vehicle.place_in_air(now).zip(noise_w(noise));
            self.0 = heard.or(self.0);
        }
    }

    /// Hands it in.
    pub(super) fn take(&mut self) -> Option<Sample> {
        let (at, power_w) = self.0.take()?;
        Some(Sample::Heard { at, power_w })
    }
}
