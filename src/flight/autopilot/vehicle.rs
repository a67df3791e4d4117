//! What the autopilot has said of itself.

use super::clock::RemoteClock;
use super::state::Observed;
use crate::flight::axis::Axis;
use crate::flight::mavlink::frame::Address;
use crate::flight::mavlink::incoming::Incoming;
use crate::flight::mavlink::parser::Received;
use crate::geodetic::Geodetic;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// An autopilot that has said nothing for so long is gone.
pub(super) const SILENT: Duration = Duration::from_millis(3_000);

/// A position older than this is none.
pub(super) const STALE: Duration = Duration::from_millis(1_000);

/// The component that is the autopilot.
pub(super) const AUTOPILOT: u8 = 1;

/// `MAV_MODE_FLAG`.
const CUSTOM_MODE: u8 = 1;
const ARMED: u8 = 128;

/// `MAV_LANDED_STATE`.
const IN_AIR: u8 = 2;
const LANDING: u8 = 4;

/// `MAV_TYPE` of what can hover and is flown by ArduCopter: with other vehicles the same number is another mode.
const COPTERS: [u8; 9] = [2, 3, 4, 13, 14, 15, 29, 35, 43];

/// Whose autopilot it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// PX4: OFFBOARD grants control, for as long as targets are streamed.
    Px4,
    /// ArduCopter: GUIDED grants control, and a target holds for good.
    ArduCopter,
}

impl Kind {
    /// By `MAV_AUTOPILOT` and `MAV_TYPE`.
    pub(super) fn of(autopilot: u8, vehicle: u8) -> Option<Self> {
        match autopilot {
            12 => Some(Self::Px4),
            3 if COPTERS.contains(&vehicle) => Some(Self::ArduCopter),
            _ => None,
        }
    }

    /// Whether that mode has the companion say where to fly.
    const fn is_granted(self, custom_mode: u32) -> bool {
        match self {
            Self::Px4 => custom_mode >> 16 & 0xFF == 6,
            Self::ArduCopter => custom_mode == 4,
        }
    }
}

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
    /// Where the drone flies to.
    Target(i32, i32),
}

/// The autopilot, as far as it is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Vehicle {
    known: Option<(Address, Kind)>,
    heard_at: Option<Instant>,
    mode: u32,
    granted: bool,
    armed: bool,
    in_air: bool,
    clock: RemoteClock,
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
        let heard = self.take(now, message, axis);
        if found { VehicleUpdate::Found } else { heard }
    }

    fn take(&mut self, now: Instant, message: Incoming, axis: &Axis) -> VehicleUpdate {
        match message {
            Incoming::Heartbeat {
                base_mode,
                custom_mode,
                ..
            } => {
                self.heard_at = Some(now);
                self.mode = custom_mode;
                let says_mode = base_mode & CUSTOM_MODE != 0;
                self.granted =
                    says_mode && self.kind().is_some_and(|kind| kind.is_granted(custom_mode));
                self.armed = base_mode & ARMED != 0;
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
                let point = Geodetic {
                    lat_e7,
                    lon_e7,
                    amsl_mm,
                };
                // Before it has a fix it says 0, 0, which is near no line worth flying.
                let Some(place) = axis.place(point) else {
                    return VehicleUpdate::Nothing;
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
            _ => VehicleUpdate::Nothing,
        }
    }

    /// It was switched off and on: what it said before is void.
    fn restart(&mut self) {
        self.heard_at = None;
        self.granted = false;
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
            .filter(|position| now.since(position.at) < STALE)
    }

    /// Whether a PX4 is flown with the sticks: its modes are by hand (1, 2, 3, 5, 7), by itself (4) or by a companion (6).
    pub(super) const fn is_by_hand(&self) -> bool {
        !matches!(self.mode >> 16 & 0xFF, 4 | 6)
    }

    /// What the state follows from.
    pub(super) fn observed(&self, now: Instant) -> Observed {
        Observed {
            there: self.heard_at.is_some_and(|at| now.since(at) < SILENT),
            flying: self.armed && self.in_air,
            granted: self.granted,
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
        let stale = self.position.map(|position| position.at + STALE);
        silent.into_iter().chain(stale).filter(|at| *at > now).min()
    }
}
