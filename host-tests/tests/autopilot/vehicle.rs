//! Simulated vehicle with a PX4 or ArduCopter: it hovers, or flies to the companion's last target.

use host_tests::make;
use mavlink::dialects::common::{
    COMMAND_ACK_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, MavLandedState,
    MavMessage, POSITION_TARGET_GLOBAL_INT_DATA, SET_POSITION_TARGET_GLOBAL_INT_DATA,
    TIMESYNC_DATA,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader, MavlinkReader, MavlinkVersion};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::{Autopilot, AutopilotEvent, Kind, Position};
use uav_relay::flight::axis::Axis;
use uav_relay::flight::mavlink::frame;
use uav_relay::{Geodetic, Instant, Placement, Sites};

use crate::signed::Key;

pub(crate) const SYSTEM: u8 = 7;

/// Time step of the simulation, ms.
const STEP_MS: u64 = 20;

/// Flight speed of the simulated vehicle, m/s.
const SPEED: f32 = 8.0;

pub(crate) const fn place(x_m: f32) -> Placement {
    Placement::on_line(x_m, 20.0)
}

pub(crate) fn sites() -> Sites {
    Sites {
        tx: Geodetic::from_degrees(47.40, 8.54, 420.0).unwrap(),
        rx: Geodetic::from_degrees(47.41, 8.55, 431.0).unwrap(),
    }
}

pub(crate) fn axis() -> Axis {
    Axis::between(sites()).unwrap()
}

/// Message from the link, as the simulated vehicle decodes it.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum LinkMessage {
    Heartbeat,
    Interval {
        id: u32,
    },
    Target(Target),
    Text(String),
    Value {
        name: String,
        value: f32,
    },
    /// Answer to a command: id and result of the command, and the recipient of the answer.
    Ack {
        command: u32,
        result: u32,
        to: [u8; 2],
    },
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Target {
    pub(crate) lat_e7: i32,
    pub(crate) lon_e7: i32,
    pub(crate) alt_m: f32,
    pub(crate) velocity_m_s: [f32; 3],
    pub(crate) type_mask: u16,
    pub(crate) yaw_rad: f32,
}

impl Target {
    pub(crate) const fn has_velocity(&self) -> bool {
        self.type_mask & 0b11_1000 == 0
    }

    pub(crate) fn place(&self) -> Placement {
        let point = make::geodetic(self.lat_e7, self.lon_e7, (self.alt_m * 1e3) as i32);
        axis().place(point).unwrap()
    }
}

/// Flight modes with PX4's and ArduCopter's numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mode {
    /// The pilot flies the drone by the sticks.
    Position,
    /// The autopilot flies by itself: it holds the position, flies its own mission or returns.
    Hold,
    /// OFFBOARD (PX4) or GUIDED (ArduCopter): the drone follows the companion's targets.
    Companion,
}

#[expect(
    clippy::struct_excessive_bools,
    reason = "faults that are independent of each other"
)]
pub(crate) struct Vehicle {
    kind: Kind,
    pub(crate) link: Autopilot,
    pub(crate) now: Instant,
    pub(crate) began: Instant,
    pub(crate) armed: bool,
    pub(crate) landed: MavLandedState,
    pub(crate) mode: Mode,
    pub(crate) place: Placement,
    pub(crate) setpoint: Option<Placement>,
    /// Target that the simulated vehicle is flying to; `None` without one.
    goal: Option<Target>,
    pub(crate) mute: bool,
    pub(crate) takes_targets: bool,
    pub(crate) says_targets: bool,
    /// True if the autopilot answers TIMESYNC requests.
    pub(crate) echoes: bool,
    /// `MAV_STATE`: 4 for active, 5 for a failsafe.
    pub(crate) status: u8,
    pub(crate) position_every_ms: u64,
    pub(crate) late_ms: u64,
    number: u8,
    /// Signing key; with a key, unsigned frames are ignored.
    pub(crate) key: Option<Key>,
    pub(crate) received: Vec<(Instant, LinkMessage)>,
    pub(crate) systems: Vec<u8>,
    pub(crate) events: Vec<AutopilotEvent>,
    pub(crate) positions: Vec<(Instant, Position)>,
}

impl Vehicle {
    pub(crate) fn new(kind: Kind) -> Self {
        let now = Instant::from_millis(1_000_000);
        Self {
            kind,
            link: Autopilot::new(axis(), Pace::default(), now),
            now,
            began: now,
            armed: false,
            landed: MavLandedState::MAV_LANDED_STATE_ON_GROUND,
            mode: Mode::Position,
            place: place(100.0),
            setpoint: None,
            goal: None,
            mute: false,
            takes_targets: true,
            says_targets: true,
            echoes: true,
            status: 4,
            position_every_ms: 200,
            late_ms: 0,
            number: 0,
            key: None,
            received: Vec::new(),
            systems: Vec::new(),
            events: Vec::new(),
            positions: Vec::new(),
        }
    }

    /// Returns a vehicle in the air under its pilot's control.
    pub(crate) fn flying(kind: Kind) -> Self {
        let mut vehicle = Self::new(kind);
        vehicle.fly_off();
        vehicle
    }

    /// Returns a vehicle in the air that flies to a setpoint at `x_m`.
    pub(crate) fn engaged(kind: Kind, x_m: f32) -> Self {
        let mut vehicle = Self::flying(kind);
        vehicle.setpoint = Some(place(x_m));
        vehicle.engage();
        vehicle
    }

    /// Simulates the take-off under the pilot's control.
    pub(crate) fn fly_off(&mut self) {
        self.run(2_000);
        self.armed = true;
        self.landed = MavLandedState::MAV_LANDED_STATE_TAKEOFF;
        self.run(2_000);
        self.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
        self.run(2_000);
    }

    /// Simulates the pilot's choice of OFFBOARD or GUIDED.
    pub(crate) fn engage(&mut self) {
        self.mode = Mode::Companion;
        self.run(1_100);
    }

    /// Simulates a reboot of the autopilot on the ground.
    pub(crate) fn reboot(&mut self) {
        self.began = self.now;
        self.armed = false;
        self.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
        self.goal = None;
    }

    pub(crate) fn run(&mut self, ms: u64) {
        for _ in 0..ms / STEP_MS {
            self.step();
        }
    }

    pub(crate) fn step(&mut self) {
        self.step_without_exchange();
        self.drive();
    }

    /// Simulates one time step of the flight, and sends messages to the autopilot link.
    ///
    /// The autopilot link answers in [`drive`](Self::drive) or [`answer`](Self::answer).
    pub(crate) fn step_without_exchange(&mut self) {
        self.now = Instant::from_micros(self.now.as_micros() + STEP_MS * 1_000);
        let ms = self.now.as_micros() / 1_000;
        self.fly();
        if !self.mute {
            if ms.is_multiple_of(1_000) {
                self.heartbeat();
            }
            if ms.is_multiple_of(500) {
                self.send_message(&MavMessage::EXTENDED_SYS_STATE(EXTENDED_SYS_STATE_DATA {
                    landed_state: self.landed,
                    ..EXTENDED_SYS_STATE_DATA::DEFAULT
                }));
                self.send_target();
            }
            if self.position_every_ms != u64::MAX && ms.is_multiple_of(self.position_every_ms) {
                self.send_position();
            }
        }
    }

    /// Runs one turn of a firmware's main loop: sets the setpoint, and collects frames and positions.
    pub(crate) fn drive(&mut self) {
        self.link.handle_setpoint(self.now, self.setpoint);
        if self.link.poll_timeout(self.now) <= self.now {
            self.link.handle_timeout(self.now);
        }
        self.answer();
        while let Some(position) = self.link.poll_position() {
            self.positions.push((self.now, position));
        }
    }

    /// Collects the frames and events of the autopilot link.
    pub(crate) fn answer(&mut self) {
        while let Some(frame) = self.link.poll_transmit(self.now) {
            self.receive(&frame);
        }
        while let Some(event) = self.link.poll_event() {
            self.events.push(event);
        }
    }

    fn fly(&mut self) {
        let Some(goal) = self.goal.filter(|_| self.mode == Mode::Companion) else {
            return;
        };
        let to = goal.place();
        let step = SPEED * STEP_MS as f32 / 1e3;
        for (own, to) in [
            (&mut self.place.x_m, to.x_m),
            (&mut self.place.y_m, to.y_m),
            (&mut self.place.altitude_m, to.altitude_m),
        ] {
            *own += (to - *own).clamp(-step, step);
        }
    }

    fn boot_ms(&self) -> u32 {
        let ms = self.now.since(self.began).as_micros() / 1_000;
        ms.saturating_sub(self.late_ms) as u32
    }

    fn custom_mode(&self) -> u32 {
        match (self.kind, self.mode) {
            (Kind::Px4, Mode::Position) => 3 << 16,
            (Kind::Px4, Mode::Hold) => 4 << 16 | 3 << 24,
            (Kind::Px4, Mode::Companion) => 6 << 16,
            (Kind::ArduCopter, Mode::Position) => 16,
            (Kind::ArduCopter, Mode::Hold) => 5,
            (Kind::ArduCopter, Mode::Companion) => 4,
        }
    }

    pub(crate) fn heartbeat(&mut self) {
        let autopilot = match self.kind {
            Kind::Px4 => 12,
            Kind::ArduCopter => 3,
        };
        self.heartbeat_of(SYSTEM, 1, 2, autopilot, self.custom_mode());
    }

    /// Sends a heartbeat whose fields are raw numbers, so that undefined values can be sent.
    pub(crate) fn heartbeat_of(
        &mut self,
        system: u8,
        component: u8,
        kind: u8,
        autopilot: u8,
        mode: u32,
    ) {
        let base_mode = 1 | if self.armed { 128 } else { 0 };
        let mut payload = mode.to_le_bytes().to_vec();
        payload.extend([kind, autopilot, base_mode, self.status, 3]);
        let mut covered = vec![
            payload.len() as u8,
            0,
            0,
            self.number,
            system,
            component,
            0,
            0,
            0,
        ];
        covered.extend(payload);
        self.number = self.number.wrapping_add(1);
        let known = frame::find_known(0).unwrap();
        let checksum = frame::checksum(&covered, known);
        let mut frame = vec![0xFD];
        frame.extend(covered);
        frame.extend(checksum.to_le_bytes());
        self.send(frame);
    }

    fn send_position(&mut self) {
        let point = axis().point(self.place).unwrap();
        self.send_message(&MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
            time_boot_ms: self.boot_ms(),
            lat: point.lat_e7,
            lon: point.lon_e7,
            alt: point.amsl_mm,
            ..GLOBAL_POSITION_INT_DATA::DEFAULT
        }));
    }

    /// Reports the current target to the link, as an ArduCopter does in GUIDED and a PX4 does not.
    fn send_target(&mut self) {
        if self.kind == Kind::Px4 || self.mode != Mode::Companion || !self.says_targets {
            return;
        }
        if let Some(goal) = self.goal.or_else(|| self.own_goal()) {
            self.send_message(&MavMessage::POSITION_TARGET_GLOBAL_INT(
                POSITION_TARGET_GLOBAL_INT_DATA {
                    lat_int: goal.lat_e7,
                    lon_int: goal.lon_e7,
                    alt: goal.alt_m,
                    ..POSITION_TARGET_GLOBAL_INT_DATA::DEFAULT
                },
            ));
        }
    }

    fn own_goal(&self) -> Option<Target> {
        let Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        } = axis().point(self.place)?;
        Some(Target {
            lat_e7,
            lon_e7,
            alt_m: amsl_mm as f32 / 1e3,
            velocity_m_s: [0.0; 3],
            type_mask: 0xDF8,
            yaw_rad: 0.0,
        })
    }

    fn send_message(&mut self, message: &MavMessage) {
        self.send_from([SYSTEM, 1], message);
    }

    /// Sends the link a message from another MAVLink address, for example that of a ground station.
    pub(crate) fn send_from(&mut self, [system, component]: [u8; 2], message: &MavMessage) {
        let header = MavHeader {
            system_id: system.into(),
            component_id: component,
            sequence: self.number,
        };
        self.number = self.number.wrapping_add(1);
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message(header, message);
        self.send(raw.raw_bytes().to_vec());
    }

    fn send(&mut self, frame: Vec<u8>) {
        let frame = match &mut self.key {
            Some(key) => key.sign(self.now, frame),
            None => frame,
        };
        self.link.handle_bytes(self.now, &frame);
    }

    fn receive(&mut self, frame: &[u8]) {
        let key = self.key.as_mut();
        if key.is_some_and(|key| !key.believes(frame)) {
            return;
        }
        let mut reader = MavlinkReader::new(frame);
        let (header, message) = reader
            .read_message::<MavMessage>(MavlinkVersion::V2)
            .unwrap();
        self.systems.push(header.system_id as u8);
        let said = match message {
            MavMessage::HEARTBEAT(_) => LinkMessage::Heartbeat,
            MavMessage::COMMAND_LONG(command) => {
                assert_eq!(command.command as u32, 511);
                if !self.mute {
                    let command = command.command;
                    self.send_message(&MavMessage::COMMAND_ACK(COMMAND_ACK_DATA {
                        command,
                        ..COMMAND_ACK_DATA::DEFAULT
                    }));
                }
                LinkMessage::Interval {
                    id: command.param1 as u32,
                }
            }
            MavMessage::COMMAND_ACK(ack) => LinkMessage::Ack {
                command: ack.command as u32,
                result: ack.result as u32,
                // The recipient is an extension field, which the decoder does not read.
                to: frame[18..20].try_into().unwrap(),
            },
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(target) => {
                LinkMessage::Target(self.decode_target(&target))
            }
            MavMessage::STATUSTEXT(text) => {
                LinkMessage::Text(text.text.to_str().unwrap().to_owned())
            }
            MavMessage::NAMED_VALUE_FLOAT(value) => LinkMessage::Value {
                name: value.name.to_str().unwrap().to_owned(),
                value: value.value,
            },
            MavMessage::TIMESYNC(sync) => {
                assert_eq!(sync.tc1, 0, "a question");
                if !self.mute && self.echoes {
                    self.send_message(&MavMessage::TIMESYNC(TIMESYNC_DATA {
                        tc1: self.now.as_micros().cast_signed() * 1_000,
                        ts1: sync.ts1,
                    }));
                }
                return;
            }
            other => panic!("it does not say {other:?}"),
        };
        self.received.push((self.now, said));
    }

    fn decode_target(&mut self, target: &SET_POSITION_TARGET_GLOBAL_INT_DATA) -> Target {
        assert_eq!((target.target_system, target.target_component), (SYSTEM, 1));
        assert_eq!(target.coordinate_frame as u32, 5);
        let target = Target {
            lat_e7: target.lat_int,
            lon_e7: target.lon_int,
            alt_m: target.alt,
            velocity_m_s: [target.vx, target.vy, target.vz],
            type_mask: target.type_mask.bits(),
            yaw_rad: target.yaw,
        };
        if self.mode == Mode::Companion && self.takes_targets {
            self.goal = Some(target);
        }
        target
    }

    pub(crate) fn targets(&self) -> Vec<(Instant, Target)> {
        let all = self.received.iter();
        all.filter_map(|(at, said)| match said {
            LinkMessage::Target(target) => Some((*at, *target)),
            _ => None,
        })
        .collect()
    }

    pub(crate) fn targets_since(&self, from: Instant) -> Vec<(Instant, Target)> {
        let mut all = self.targets();
        all.retain(|(at, _)| *at > from);
        all
    }

    /// Returns the number of requests for message `id` that the vehicle has received.
    pub(crate) fn intervals(&self, id: u32) -> usize {
        let asked = self.received.iter();
        asked
            .filter(|(_, said)| *said == LinkMessage::Interval { id })
            .count()
    }

    pub(crate) fn has_text(&self, text: &str) -> bool {
        self.received
            .iter()
            .any(|(_, said)| *said == LinkMessage::Text(text.to_owned()))
    }
}
