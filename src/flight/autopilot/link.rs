//! The link to one autopilot: what it says, who flies by that, and what it is told.

use super::carrot::{Carrot, Pace};
use super::clock::millis;
use super::event::{AutopilotEvent, Events};
use super::noise::RadioNoise;
use super::report::{Report, line_of};
use super::state::State;
use super::streams::Streams;
use super::target::Target;
use super::trust::Trust;
use super::vehicle::{Kind, Position, Vehicle, VehicleUpdate};
use crate::event::Event;
use crate::flight::axis::Axis;
use crate::flight::mavlink::frame::Address;
use crate::flight::mavlink::outgoing::{FrameBytes, Outgoing, severity};
use crate::flight::mavlink::parser::{Counters, Parser};
#[cfg(feature = "mavlink-signing")]
use crate::flight::mavlink::signing::Signing;
use crate::geodetic::Geodetic;
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::pointing::Bearing;
use crate::time::{Duration, Instant};

/// An onboard computer, `MAV_COMP_ID_ONBOARD_COMPUTER`.
const COMPONENT: u8 = 191;

/// The system to send as before the autopilot has said its own: the one that autopilots have unless told otherwise.
const SYSTEM: u8 = 1;

const HEARTBEAT: Duration = Duration::from_millis(1_000);

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
    /// What a radio has heard where the drone was, W.
    noise: RadioNoise,
    events: Events,
    sequence: u8,
    heartbeat_at: Instant,
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
            noise: RadioNoise::NONE,
            events: Events::default(),
            sequence: 0,
            heartbeat_at: now,
        }
    }

    /// Bytes from the autopilot, any number of them.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for byte in bytes {
            self.parser.push(*byte);
            while let Some(received) = self.trust.next_received(now, &mut self.parser) {
                self.noise.hear(now, &received, &self.vehicle);
                let heard = self.vehicle.hear(now, &received, &self.axis);
                if heard != VehicleUpdate::Nothing {
                    self.streams.hear(received.id);
                }
                self.take(now, heard);
            }
        }
    }

    fn take(&mut self, now: Instant, heard: VehicleUpdate) {
        match heard {
            VehicleUpdate::Nothing | VehicleUpdate::News => {}
            VehicleUpdate::Found => {
                self.events.found = self.vehicle.kind();
                self.streams = Streams::new(now);
            }
            VehicleUpdate::Restarted => {
                self.events.restarted = true;
                self.streams = Streams::new(now);
            }
            VehicleUpdate::Position(position) => self.position = Some(position),
            VehicleUpdate::Target(lat_e7, lon_e7) => {
                if let Some(target) = &mut self.target {
                    target.compare(&self.axis, lat_e7, lon_e7);
                }
            }
        }
        self.review(now);
    }

    /// The drone flies along `axis` from now on: between the sites of a new mission. Call it when `Relay::sites` has changed, before the next
    /// [`handle_setpoint`](Self::handle_setpoint). The drone stays where it is until a setpoint is given: what was given before is of the
    /// other line. Constant work; the same line again has no effect.
    pub fn fly_along(&mut self, now: Instant, axis: Axis) {
        if axis == self.axis {
            return;
        }
        let before = core::mem::replace(&mut self.axis, axis);
        let moved = |place| before.point(place).and_then(|point| axis.place(point));
        self.vehicle.move_places(moved);
        (self.setpoint, self.look) = (None, None);
        // It was measured before the relay knew of the line.
        self.position = None;
        self.target = self.target.and_then(|target| {
            let at = moved(target.carrot.place);
            at.map(|place| Target::at(place, now))
        });
        if self.target.is_none() && self.state.is_flown() {
            self.target = self.at_own_place(now);
        }
    }

    /// Where to fly: what `Relay::setpoint` says; `None` to hold the place, and so is one that is not finite or not near the line.
    pub fn handle_setpoint(&mut self, now: Instant, setpoint: Option<Placement>) {
        let setpoint = setpoint.filter(|place| self.axis.is_around(*place));
        if self.setpoint != setpoint {
            self.setpoint = setpoint;
            if let Some(target) = &mut self.target {
                target.renew(now);
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
        if let Some(text) = line_of(event) {
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
        Some(Target::at(position.place, now))
    }

    /// The next frame to send. Call until there is none.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<FrameBytes> {
        let frame = self.next_frame(now)?;
        Some(self.trust.sign(now, frame))
    }

    /// The same without a signature.
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
            target.tell_own_place(now);
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
        let is_told = target.tell(now, kind);
        self.target = Some(target);
        if !is_told {
            return None;
        }
        self.events.refused |= target.is_refused();
        self.told(now, &target.carrot)
    }

    /// The frame that tells the autopilot to fly there.
    fn told(&mut self, now: Instant, carrot: &Carrot) -> Option<FrameBytes> {
        let at: Geodetic = self.axis.point(carrot.place)?;
        let x_m = carrot.place.x_m;
        let velocity_m_s = (!carrot.stands()).then(|| self.axis.to_ned(x_m, carrot.velocity_m_s));
        let yaw_rad = self
            .look
            .map(|look| self.axis.heading_rad(x_m, look.azimuth_rad));
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

    /// What a SiK radio has heard between frames, by its RADIO_STATUS, and where the drone was in the air: for `Relay::handle_sample`. Of
    /// several since the last call the newest; without the feature `sensing` none.
    pub fn poll_sample(&mut self) -> Option<Sample> {
        self.noise.take()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<AutopilotEvent> {
        let mistrusted = || self.trust.take_event().map(AutopilotEvent::Mistrusted);
        self.events.take().or_else(mistrusted)
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

    /// Has the link sign what it says, and take nothing but what is signed with that key; RADIO_STATUS apart. The autopilot's is set by a
    /// ground station (SETUP_SIGNING).
    #[cfg(feature = "mavlink-signing")]
    pub const fn sign(&mut self, signing: Signing) {
        self.trust.sign_with(signing);
    }

    /// Whole frames that were not taken, because of their signatures.
    pub const fn refused(&self) -> u32 {
        self.trust.refused()
    }
}
