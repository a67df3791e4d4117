//! Vehicle with an autopilot at the end of a socket; its clock is as fast as the drones'.

use std::collections::BTreeSet;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use host_tests::firmware::emulator::Life;
use host_tests::make;
use mavlink::dialects::common::{
    EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot,
    MavLandedState, MavMessage, MavModeFlag, MavState, MavType, POSITION_TARGET_GLOBAL_INT_DATA,
    RADIO_STATUS_DATA, SET_POSITION_TARGET_GLOBAL_INT_DATA, TIMESYNC_DATA,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader, MavlinkReader, MavlinkVersion};
use uav_relay::Geodetic;
use uav_relay::Placement;
use uav_relay::flight::autopilot::Kind;
use uav_relay::flight::axis::Axis;

use crate::fleet::PATIENCE;

const SYSTEM: u8 = 7;

const FASTEST_M_S: f32 = 8.0;

/// Time for which the pilot stays in a mode other than OFFBOARD and GUIDED, ms. It is six heartbeats.
const ELSEWHERE: u64 = 1_500;

/// Id of the MAVLink message HEARTBEAT.
const HEARTBEAT: u32 = 0;
const POSITION: u32 = 33;
const TARGET: u32 = 87;
const SYS_STATE: u32 = 245;
/// Ids of the messages that the vehicle sends, and their intervals, ms.
///
/// Heartbeats are frequent because this process may be delayed.
const PERIODS: [(u32, u64); 4] = [
    (HEARTBEAT, 250),
    (POSITION, 200),
    (TARGET, 500),
    (SYS_STATE, 500),
];

/// Position target that the vehicle has received, with the time in ms.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct SentTarget {
    pub(crate) at: u64,
    pub(crate) place: Placement,
}

pub(crate) struct Vehicle {
    kind: Kind,
    socket: UnixStream,
    axis: Axis,
    began: Instant,
    /// Speed of the drone's clock: real time, or 10.5 times as fast.
    life: Life,
    moved_at: u64,
    said_at: [u64; PERIODS.len()],
    number: u8,
    waiting: Vec<u8>,
    goal: Option<(Placement, Geodetic)>,
    pub(crate) armed: bool,
    pub(crate) landed: MavLandedState,
    /// True if the pilot chooses OFFBOARD or GUIDED; false if the pilot flies the drone manually.
    ///
    /// If the companion asks for another mode, the pilot chooses another mode for a while, and then OFFBOARD or
    /// GUIDED again.
    pub(crate) granted: bool,
    /// Time until which the pilot stays in a mode other than OFFBOARD and GUIDED, ms.
    elsewhere_until: u64,
    pub(crate) place: Placement,
    /// Ids of the messages that the companion has requested.
    pub(crate) asked: BTreeSet<u32>,
    pub(crate) told: Vec<SentTarget>,
    pub(crate) texts: Vec<String>,
    pub(crate) heartbeats: u32,
}

/// Returns the distance of two positions, m.
pub(crate) fn apart(a: Placement, b: Placement) -> f32 {
    let [x, y, h] = [a.x_m - b.x_m, a.y_m - b.y_m, a.altitude_m - b.altitude_m];
    (x * x + y * y + h * h).sqrt()
}

impl Vehicle {
    /// Creates a vehicle on the ground at `place`, whose autopilot is at the end of `socket`.
    pub(crate) fn new(
        kind: Kind,
        socket: UnixStream,
        axis: Axis,
        place: Placement,
        life: Life,
    ) -> Self {
        socket.set_nonblocking(true).unwrap();
        Self {
            kind,
            socket,
            axis,
            began: Instant::now(),
            life,
            moved_at: 0,
            said_at: [0; PERIODS.len()],
            number: 0,
            waiting: Vec::new(),
            goal: None,
            armed: false,
            landed: MavLandedState::MAV_LANDED_STATE_ON_GROUND,
            granted: false,
            elsewhere_until: 0,
            place,
            asked: BTreeSet::new(),
            told: Vec::new(),
            texts: Vec::new(),
            heartbeats: 0,
        }
    }

    /// Returns the time since the vehicle was created, ms of the drone's clock.
    pub(crate) fn now(&self) -> u64 {
        let ms = self.began.elapsed().mul_f64(self.life.speed()).as_millis();
        u64::try_from(ms).unwrap()
    }

    pub(crate) fn run(&mut self, ms: u64) {
        let end = self.now() + ms;
        while self.now() < end {
            self.step();
        }
    }

    /// Runs the vehicle until `done` is true. On a timeout the test fails.
    pub(crate) fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let end = Instant::now() + PATIENCE;
        while !done(self) {
            assert!(
                Instant::now() < end,
                "no {what} in time: at {:?}, asked {:?}, told {:?}, {:?}",
                self.place,
                self.asked,
                self.told.last(),
                self.texts
            );
            self.step();
        }
    }

    /// Sends the vehicle's position and a SiK radio's noise value.
    pub(crate) fn send_noise(&mut self, noise: u8) {
        self.send_by_id(POSITION, self.now());
        let radio = MavHeader {
            system_id: u32::from(b'3'),
            component_id: b'D',
            sequence: 0,
        };
        let said = RADIO_STATUS_DATA {
            rssi: 200,
            noise,
            ..RADIO_STATUS_DATA::DEFAULT
        };
        self.send(radio, &MavMessage::RADIO_STATUS(said));
    }

    pub(crate) fn has_target_since(&self, at: u64) -> bool {
        self.told.last().is_some_and(|told| told.at > at)
    }

    pub(crate) fn step(&mut self) {
        self.receive();
        let now = self.now();
        self.fly(now);
        for (index, (id, period)) in PERIODS.into_iter().enumerate() {
            let says = id == HEARTBEAT || self.asked.contains(&id);
            if says && now >= self.said_at[index] + period {
                self.said_at[index] = now;
                self.send_by_id(id, now);
            }
        }
        std::thread::sleep(Duration::from_millis(1));
    }

    /// Returns true if the vehicle is in OFFBOARD or GUIDED at time `now`.
    fn is_handed_over(&self, now: u64) -> bool {
        self.granted && now >= self.elsewhere_until
    }

    /// Reads a status text for the operator. If the text asks the pilot to choose another mode, the vehicle leaves
    /// OFFBOARD or GUIDED for 1.5 s.
    fn read_status_text(&mut self, text: String) {
        if self.granted && text == "relay: waits, choose another mode first" {
            self.elsewhere_until = self.now() + ELSEWHERE;
        }
        self.texts.push(text);
    }

    fn fly(&mut self, now: u64) {
        let step = FASTEST_M_S * (now - self.moved_at) as f32 / 1e3;
        self.moved_at = now;
        let Some((to, _)) = self.goal.filter(|_| self.is_handed_over(now)) else {
            return;
        };
        let part = (step / apart(self.place, to)).min(1.0);
        if part.is_finite() {
            self.place.x_m += (to.x_m - self.place.x_m) * part;
            self.place.y_m += (to.y_m - self.place.y_m) * part;
            self.place.altitude_m += (to.altitude_m - self.place.altitude_m) * part;
        }
    }

    fn send_by_id(&mut self, id: u32, now: u64) {
        let boot = u32::try_from(now).unwrap();
        let message = match id {
            HEARTBEAT => {
                let (autopilot, mode) = match (self.kind, self.is_handed_over(now)) {
                    (Kind::Px4, false) => (MavAutopilot::MAV_AUTOPILOT_PX4, 3 << 16),
                    (Kind::Px4, true) => (MavAutopilot::MAV_AUTOPILOT_PX4, 6 << 16),
                    (Kind::ArduCopter, false) => (MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA, 16),
                    (Kind::ArduCopter, true) => (MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA, 4),
                };
                let mut base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
                if self.armed {
                    base_mode |= MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
                }
                MavMessage::HEARTBEAT(HEARTBEAT_DATA {
                    mavtype: MavType::MAV_TYPE_QUADROTOR,
                    autopilot,
                    base_mode,
                    custom_mode: mode,
                    system_status: MavState::MAV_STATE_ACTIVE,
                    ..HEARTBEAT_DATA::DEFAULT
                })
            }
            POSITION => {
                let point = self.axis.point(self.place).unwrap();
                MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
                    time_boot_ms: boot,
                    lat: point.lat_e7,
                    lon: point.lon_e7,
                    alt: point.amsl_mm,
                    ..GLOBAL_POSITION_INT_DATA::DEFAULT
                })
            }
            TARGET => {
                // A PX4 does not send its target.
                let is_said = self.kind == Kind::ArduCopter && self.is_handed_over(now);
                let Some((_, goal)) = self.goal.filter(|_| is_said) else {
                    return;
                };
                MavMessage::POSITION_TARGET_GLOBAL_INT(POSITION_TARGET_GLOBAL_INT_DATA {
                    lat_int: goal.lat_e7,
                    lon_int: goal.lon_e7,
                    ..POSITION_TARGET_GLOBAL_INT_DATA::DEFAULT
                })
            }
            SYS_STATE => MavMessage::EXTENDED_SYS_STATE(EXTENDED_SYS_STATE_DATA {
                landed_state: self.landed,
                ..EXTENDED_SYS_STATE_DATA::DEFAULT
            }),
            _ => unreachable!(),
        };
        let header = MavHeader {
            system_id: SYSTEM.into(),
            component_id: 1,
            sequence: self.number,
        };
        self.number = self.number.wrapping_add(1);
        self.send(header, &message);
    }

    fn send(&mut self, header: MavHeader, message: &MavMessage) {
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message(header, message);
        let mut left = raw.raw_bytes();
        let begun = Instant::now();
        // Bytes that the emulator does not read for so long are lost, as on a UART.
        while !left.is_empty() && begun.elapsed() < Duration::from_millis(100) {
            match self.socket.write(left) {
                Ok(count) => left = &left[count..],
                // The emulator reads at its UART's speed.
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Err(error) => panic!("{error}"),
            }
        }
    }

    fn receive(&mut self) {
        let mut bytes = [0; 1024];
        match self.socket.read(&mut bytes) {
            Ok(count) => self.waiting.extend(&bytes[..count]),
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        while let Some(&length) = self.waiting.get(1) {
            assert_eq!(self.waiting[0], 0xFD, "nothing but whole frames");
            let length = usize::from(length) + 12;
            if self.waiting.len() < length {
                return;
            }
            let frame: Vec<u8> = self.waiting.drain(..length).collect();
            let mut reader = MavlinkReader::new(&frame[..]);
            let (header, message) = reader
                .read_message::<MavMessage>(MavlinkVersion::V2)
                .unwrap();
            assert_eq!(header.component_id, 191);
            self.take(&message);
        }
    }

    fn take(&mut self, message: &MavMessage) {
        match message {
            MavMessage::HEARTBEAT(_) => self.heartbeats += 1,
            MavMessage::COMMAND_LONG(command) => {
                assert_eq!(command.command as u32, 511);
                self.asked.insert(command.param1 as u32);
            }
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(target) => self.target(target),
            MavMessage::STATUSTEXT(text) => {
                self.read_status_text(text.text.to_str().unwrap().to_owned());
            }
            MavMessage::NAMED_VALUE_FLOAT(_) => {}
            MavMessage::TIMESYNC(sync) => {
                let header = MavHeader {
                    system_id: SYSTEM.into(),
                    component_id: 1,
                    sequence: self.number,
                };
                self.number = self.number.wrapping_add(1);
                let answer = MavMessage::TIMESYNC(TIMESYNC_DATA {
                    tc1: 1,
                    ts1: sync.ts1,
                });
                self.send(header, &answer);
            }
            other => panic!("it does not say {other:?}"),
        }
    }

    fn target(&mut self, target: &SET_POSITION_TARGET_GLOBAL_INT_DATA) {
        assert_eq!((target.target_system, target.target_component), (SYSTEM, 1));
        assert_eq!(target.coordinate_frame as u32, 5);
        let point = make::geodetic(target.lat_int, target.lon_int, (target.alt * 1e3) as i32);
        let place = self.axis.place(point).unwrap();
        let at = self.now();
        self.told.push(SentTarget { at, place });
        if self.is_handed_over(at) {
            self.goal = Some((place, point));
        }
    }
}
