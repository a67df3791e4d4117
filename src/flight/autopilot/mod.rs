//! A PX4 or ArduCopter over a serial port: it is told where to fly, and tells where it is. Sans-IO.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`state`] | who flies: the table of states |
//! | `vehicle` | what the autopilot has said of itself |
//! | `clock` | the autopilot's clock, on the relay's |
//! | `streams` | the messages that it is asked for |
//! | [`carrot`] | the target on its way to the setpoint |
//! | `report` | what the operator reads |
//! | [`trust`] | whom it believes: signatures |
//!
//! It never arms, takes off, lands or changes the mode. What it sends as a target is finite and near the mission's line.

pub mod carrot;
mod clock;
mod report;
pub mod state;
mod streams;
pub mod trust;
mod vehicle;

use super::axis::Axis;
use super::geodetic::Geodetic;
use super::mavlink::frame::Address;
use super::mavlink::outgoing::{FrameBytes, Outgoing, severity};
use super::mavlink::parser::{Counters, Parser};
use crate::event::Event;
use crate::place::Placement;
use crate::pointing::Bearing;
use crate::time::{Duration, Instant};
use carrot::{Carrot, Pace};
use report::Report;
use state::State;
use streams::Streams;
use trust::{Mistrust, Trust};
use vehicle::{Heard, Vehicle};

pub use vehicle::{Kind, Position};

/// An onboard computer, `MAV_COMP_ID_ONBOARD_COMPUTER`.
const COMPONENT: u8 = 191;

/// The system to send as before the autopilot has said its own: the one that autopilots have unless told otherwise.
const SYSTEM: u8 = 1;

const HEARTBEAT: Duration = Duration::from_millis(1_000);

/// From one target to the next while it moves, and while it stands. A PX4 leaves its mode when it hears none for a second.
const MOVING: Duration = Duration::from_millis(100);
const STANDING: Duration = Duration::from_millis(200);

/// An ArduCopter is told a place again until it has said that it flies there: repetition makes it wobble.
const AGAIN: Duration = Duration::from_millis(1_000);

/// So often it is told before that is an event.
const REFUSED_AFTER: u8 = 5;

/// How far what an ArduCopter says it flies to may be from what it was told, 1e-7 degrees.
const TAKEN_WITHIN: u32 = 20;

/// What the firmware is told.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AutopilotEvent {
    /// An autopilot has been heard for the first time.
    Found(Kind),
    /// It was switched off and on.
    Restarted,
    /// Somebody else flies, or the relay again: see [`State`].
    State(State),
    /// It was told five times where to fly and flies elsewhere: the place is outside its own fence, or another companion talks to it.
    Refused,
    /// The two do not believe each other's signatures.
    Mistrusted(Mistrust),
}

/// The link to one autopilot.
///
/// # Contract
/// - *Inputs* take anything, never fail and do a bounded amount of work.
/// - *Time* is an argument and should not run backward.
/// - After every input call [`poll_transmit`](Self::poll_transmit), [`poll_position`](Self::poll_position) and
///   [`poll_event`](Self::poll_event) until each gives `None`, and hand the relay what [`is_flown`](Self::is_flown) says; then sleep
///   until [`poll_timeout`](Self::poll_timeout) or the next byte.
#[derive(Clone, Debug)]
pub struct Autopilot {
    axis: Axis,
    pace: Pace,
    began: Instant,
    parser: Parser,
    trust: Trust,
    vehicle: Vehicle,
    streams: Streams,
    state: State,
    setpoint: Option<Placement>,
    look: Option<Bearing>,
    target: Option<Target>,
    /// Whether it was engaged when it fell silent: a PX4 may be in its failsafe, which a stream of targets ends.
    fell: bool,
    report: Report,
    position: Option<Position>,
    events: Events,
    sequence: u8,
    heartbeat_at: Instant,
}

/// What the autopilot is given to fly to.
#[derive(Clone, Copy, Debug)]
struct Target {
    carrot: Carrot,
    due: Instant,
    /// How often it has been told the place where it ends, and whether it has said that it flies there.
    told: u8,
    is_taken: bool,
}

/// Events that have not been taken.
#[derive(Clone, Copy, Debug, Default)]
struct Events {
    found: Option<Kind>,
    restarted: bool,
    state: Option<State>,
    refused: bool,
}

impl Autopilot {
    /// The link to the autopilot of a drone that flies along `axis`, at most as fast as `pace` says.
    pub fn new(axis: Axis, pace: Pace, now: Instant) -> Self {
        Self {
            axis,
            pace,
            began: now,
            parser: Parser::new(),
            trust: Trust::default(),
            vehicle: Vehicle::default(),
            streams: Streams::new(now),
            state: State::Silent,
            setpoint: None,
            look: None,
            target: None,
            fell: false,
            report: Report::default(),
            position: None,
            events: Events::default(),
            sequence: 0,
            heartbeat_at: now,
        }
    }

    /// Bytes from the autopilot, any number of them.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for byte in bytes {
            self.parser.push(*byte);
            while let Some(received) = self.next_received(now) {
                let heard = self.vehicle.hear(now, &received, &self.axis);
                if heard != Heard::Nothing {
                    self.streams.hear(received.id);
                }
                self.take(now, heard);
            }
        }
    }

    fn take(&mut self, now: Instant, heard: Heard) {
        match heard {
            Heard::Nothing | Heard::News => {}
            Heard::Found => {
                self.events.found = self.vehicle.kind();
                self.streams = Streams::new(now);
            }
            Heard::Restarted => {
                self.events.restarted = true;
                self.streams = Streams::new(now);
            }
            Heard::Position(position) => self.position = Some(position),
            Heard::Target(lat_e7, lon_e7) => self.compare(lat_e7, lon_e7),
        }
        self.review(now);
    }

    /// Where to fly: what `Relay::setpoint` says; `None` to hold the place, and so is one that is not finite or not near the line.
    pub fn handle_setpoint(&mut self, now: Instant, setpoint: Option<Placement>) {
        let setpoint = setpoint.filter(|place| self.axis.is_around(*place));
        if self.setpoint != setpoint {
            self.setpoint = setpoint;
            if let Some(target) = &mut self.target {
                target.due = now;
                target.told = 0;
                target.is_taken = false;
            }
        }
    }

    /// Which way to look, as a directional antenna needs it; `None` leaves that to the autopilot, and so does an azimuth that is none.
    pub fn handle_bearing(&mut self, look: Option<Bearing>) {
        self.look = look.filter(|look| look.azimuth_rad.abs() <= core::f32::consts::PI);
    }

    /// The numbers that an operator may plot once a second: the SIR of the hop to this relay in decibels, and its place in the chain.
    pub fn handle_values(&mut self, now: Instant, sir_db: Option<f32>, place: Option<Placement>) {
        self.report.values(now, sir_db, place);
    }

    /// A line for the operator to read, of at most 50 bytes; whether there was room for it, which there is for three.
    pub fn say(&mut self, text: &str) -> bool {
        self.report.say(severity::INFO, text)
    }

    /// An event of the relay: the operator reads of those that matter in flight.
    pub fn handle_event(&mut self, event: Event) {
        if let Some(text) = report::line_of(event) {
            self.report.say(severity::INFO, text);
        }
    }

    /// Does what is due at `now`. Constant work.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.streams.handle_timeout(now);
        self.review(now);
    }

    /// Who flies, by what is known at `now`.
    fn review(&mut self, now: Instant) {
        let before = self.state;
        let observed = self.vehicle.observed(now);
        self.state = before.next(observed);
        match self.state {
            State::Engaged | State::Blind => {}
            State::Standby => self.fell &= !self.vehicle.is_by_hand(),
            State::Grounded => self.fell &= observed.flying,
            State::Silent => self.fell |= matches!(before, State::Engaged | State::Blind),
        }
        if self.state == before {
            return;
        }
        self.events.state = Some(self.state);
        let begins = matches!(before, State::Silent | State::Grounded | State::Standby);
        self.target = match self.state {
            // It begins where the drone is.
            State::Engaged if begins => self.at_own_place(now),
            State::Engaged | State::Blind => self.target,
            State::Silent | State::Grounded | State::Standby => None,
        };
        let line = match (before, self.state) {
            (State::Blind, State::Engaged) => Some((severity::INFO, "relay: position is back")),
            (_, State::Engaged) => Some((severity::INFO, "relay: flies to its place")),
            (_, State::Blind) => Some((
                severity::WARNING,
                "relay: no position, keeps its last target",
            )),
            (State::Engaged | State::Blind, State::Standby) => {
                Some((severity::INFO, "relay: released"))
            }
            _ => None,
        };
        if let Some((severity, text)) = line {
            self.report.say(severity, text);
        }
    }

    fn at_own_place(&self, now: Instant) -> Option<Target> {
        let position = self.vehicle.position(now)?;
        Some(Target {
            carrot: Carrot::at(position.place, now),
            due: now,
            told: 0,
            is_taken: false,
        })
    }

    /// The autopilot says that it flies there. While the target moves that says nothing: it still has to be told to stop.
    fn compare(&mut self, lat_e7: i32, lon_e7: i32) {
        if let Some(target) = &mut self.target
            && target.told > 0
            && let Some(point) = self.axis.point(target.carrot.place)
        {
            let near = |a: i32, b: i32| a.abs_diff(b) <= TAKEN_WITHIN;
            target.is_taken = near(point.lat_e7, lat_e7) && near(point.lon_e7, lon_e7);
        }
    }

    /// The next frame to send, as it is without a signature.
    fn next_frame(&mut self, now: Instant) -> Option<FrameBytes> {
        if self.heartbeat_at <= now {
            self.heartbeat_at = now + HEARTBEAT;
            return Some(self.frame(Outgoing::Heartbeat));
        }
        if self.state != State::Silent
            && let Some((id, interval_us)) = self.streams.take()
        {
            return Some(self.frame(Outgoing::SetMessageInterval { id, interval_us }));
        }
        if let Some(frame) = self.next_target(now) {
            return Some(frame);
        }
        if self.state == State::Silent {
            return None;
        }
        let boot_ms = self.boot_ms(now);
        let (from, to, sequence) = (self.own(), self.peer(), self.sequence);
        let frame = self
            .report
            .take(now, boot_ms, |message| message.encode(from, to, sequence))?;
        self.sequence = sequence.wrapping_add(1);
        Some(frame)
    }

    /// The target that is due.
    fn next_target(&mut self, now: Instant) -> Option<FrameBytes> {
        let kind = self.vehicle.kind()?;
        if self.state == State::Standby && kind == Kind::Px4 && !self.fell {
            // The present place, so that the mode can be taken.
            let due = self.target.map_or(now, |target| target.due);
            if due > now {
                return None;
            }
            self.target = self.at_own_place(now);
            let target = self.target.as_mut()?;
            target.due = now + STANDING;
            let carrot = target.carrot;
            return self.told(now, &carrot);
        }
        let mut target = self.target.filter(|target| target.due <= now)?;
        match (self.state, self.setpoint) {
            (State::Engaged, Some(setpoint)) => target.carrot.advance(now, setpoint, self.pace),
            (State::Engaged, None) | (State::Blind, _) => {
                target.carrot = Carrot::at(target.carrot.place, now);
            }
            _ => return None,
        }
        let stands = target.carrot.stands();
        target.due = now
            + match kind {
                _ if !stands => MOVING,
                Kind::Px4 => STANDING,
                Kind::ArduCopter => AGAIN,
            };
        let is_said = !stands || kind == Kind::Px4 || !target.is_taken;
        if !stands {
            (target.told, target.is_taken) = (0, false);
        } else if is_said && kind == Kind::ArduCopter {
            target.told = target.told.saturating_add(1);
            self.events.refused |= target.told == REFUSED_AFTER + 1;
        }
        self.target = Some(target);
        if !is_said {
            return None;
        }
        self.told(now, &target.carrot)
    }

    /// The frame that tells the autopilot to fly there.
    fn told(&mut self, now: Instant, carrot: &Carrot) -> Option<FrameBytes> {
        let at: Geodetic = self.axis.point(carrot.place)?;
        let x_m = carrot.place.x_m;
        let velocity_m_s = (!carrot.stands()).then(|| self.axis.to_ned(x_m, carrot.velocity_m_s));
        let yaw_rad = self
            .look
            .map(|look| turned(self.axis.azimuth_rad(x_m) + look.azimuth_rad));
        Some(self.frame(Outgoing::SetPosition {
            boot_ms: self.boot_ms(now),
            at,
            velocity_m_s,
            yaw_rad,
        }))
    }

    fn frame(&mut self, message: Outgoing<'_>) -> FrameBytes {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        message.encode(self.own(), self.peer(), sequence)
    }

    /// It is a part of the vehicle: it has the system of its autopilot.
    fn own(&self) -> Address {
        Address {
            component: COMPONENT,
            ..self.peer()
        }
    }

    fn peer(&self) -> Address {
        self.vehicle.address().unwrap_or(Address {
            system: SYSTEM,
            component: 1,
        })
    }

    const fn boot_ms(&self, now: Instant) -> u32 {
        millis(now.since(self.began).as_micros())
    }

    /// The next place where the drone was, and when: for `Relay::handle_position`. Of several since the last call the newest.
    pub const fn poll_position(&mut self) -> Option<Position> {
        self.position.take()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<AutopilotEvent> {
        let events = &mut self.events;
        if let Some(kind) = events.found.take() {
            return Some(AutopilotEvent::Found(kind));
        }
        if core::mem::take(&mut events.restarted) {
            return Some(AutopilotEvent::Restarted);
        }
        if let Some(state) = events.state.take() {
            return Some(AutopilotEvent::State(state));
        }
        if core::mem::take(&mut events.refused) {
            return Some(AutopilotEvent::Refused);
        }
        self.trust.take_event().map(AutopilotEvent::Mistrusted)
    }

    /// When to call [`handle_timeout`](Self::handle_timeout) at the latest.
    pub fn poll_timeout(&self, now: Instant) -> Instant {
        let target = self.target.map(|target| target.due);
        let report = self
            .report
            .next_timeout()
            .filter(|_| self.state != State::Silent);
        [target, report, self.vehicle.next_timeout(now)]
            .into_iter()
            .flatten()
            .fold(
                self.heartbeat_at.min(self.streams.next_timeout()),
                Instant::min,
            )
    }

    /// Who flies.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Whether the relay's setpoint is flown.
    pub const fn is_flown(&self) -> bool {
        self.state.is_flown()
    }

    /// What came from the autopilot, whole and hurt.
    pub const fn counters(&self) -> Counters {
        self.parser.counters()
    }
}

/// Milliseconds, which wrap after 49 days as the autopilot's do. In two steps that the target has an instruction for: a division of 64 bits
/// is a kilobyte of flash.
#[expect(clippy::cast_possible_truncation, reason = "eight years are 48 bits")]
const fn millis(micros: u64) -> u32 {
    let high = (micros >> 16) as u32;
    let low = ((high % 1_000) << 16) | (micros & 0xFFFF) as u32;
    ((high / 1_000) << 16).wrapping_add(low / 1_000)
}

/// The same angle from -π to π.
fn turned(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn milliseconds_are_those_of_a_division() {
        let mut micros = 0_u64;
        for step in 0..40_000_u64 {
            let wrapped = u32::try_from(micros / 1_000 % (1 << 32));
            assert_eq!(Ok(super::millis(micros)), wrapped, "{micros}");
            micros = (micros * 3 + step) % (1 << 48);
        }
    }
}
