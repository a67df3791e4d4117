//! Drone with a PX4 at a UART: it hovers, or flies to the last target in OFFBOARD.

use embedded_io_async::Write as _;
use uav_relay::flight::axis::Axis;
use uav_relay::flight::mavlink::frame::{CHECKSUM, HEADER, MAGIC, checksum, find_known, id};
use uav_relay::{Geodetic, Placement};

use crate::bench::{Pipe, SITES};

const STEP_M: f32 = 0.008;

pub(crate) struct Vehicle {
    /// Bytes in transit: entry 0 from the autopilot to the relay, entry 1 to the autopilot.
    uart: [Pipe; 2],
    axis: Axis,
    millis: u32,
    sequence: u8,
    waiting: Vec<u8>,
    pub(crate) place: Placement,
    /// True if the drone is armed and in the air.
    pub(crate) flies: bool,
    /// True in PX4's mode OFFBOARD, in which the relay controls the drone; otherwise the pilot controls it.
    pub(crate) granted: bool,
    /// Text messages for the operator that the autopilot has received from the relay.
    pub(crate) texts: Vec<String>,
    /// Targets that the autopilot has received; tests may clear them.
    pub(crate) targets: Vec<Placement>,
}

impl Vehicle {
    pub(crate) fn new(place: Placement) -> Self {
        Self {
            uart: [Pipe::default(), Pipe::default()],
            axis: Axis::between(SITES.on_earth()).unwrap(),
            millis: 0,
            sequence: 0,
            waiting: Vec::new(),
            place,
            flies: false,
            granted: false,
            texts: Vec::new(),
            targets: Vec::new(),
        }
    }

    pub(crate) fn port(&self) -> (Pipe, Pipe) {
        let [to, from] = self.uart.clone();
        (to, from)
    }

    pub(crate) fn step(&mut self) {
        self.millis += 1;
        self.receive();
        if self.granted
            && let Some(to) = self.targets.last()
        {
            for (own, to) in [
                (&mut self.place.x_m, to.x_m),
                (&mut self.place.y_m, to.y_m),
                (&mut self.place.altitude_m, to.altitude_m),
            ] {
                *own += (to - *own).clamp(-STEP_M, STEP_M);
            }
        }
        if self.millis.is_multiple_of(1_000) {
            let mode: u32 = if self.granted { 6 << 16 } else { 3 << 16 };
            let armed = if self.flies { 128 } else { 0 };
            let rest = [2, 12, 1 | armed, 4, 3];
            self.send(id::HEARTBEAT, &[&mode.to_le_bytes()[..], &rest].concat());
        }
        if self.millis.is_multiple_of(500) {
            let landed = if self.flies { 2 } else { 1 };
            self.send(id::EXTENDED_SYS_STATE, &[0, landed]);
        }
        if self.millis.is_multiple_of(200) {
            let at = self.axis.point(self.place).unwrap();
            let mut payload = self.millis.to_le_bytes().to_vec();
            for part in [at.lat_e7, at.lon_e7, at.amsl_mm, 0, 0, 0] {
                payload.extend(part.to_le_bytes());
            }
            self.send(id::GLOBAL_POSITION_INT, &payload);
        }
    }

    fn send(&mut self, id: u32, payload: &[u8]) {
        let [a, b, c, _] = id.to_le_bytes();
        let length = u8::try_from(payload.len()).unwrap();
        let mut frame = vec![MAGIC, length, 0, 0, self.sequence, 1, 1, a, b, c];
        self.sequence = self.sequence.wrapping_add(1);
        frame.extend(payload);
        let sum = checksum(&frame[1..], find_known(id).unwrap());
        frame.extend(sum.to_le_bytes());
        embassy_futures::block_on(self.uart[0].write(&frame)).unwrap();
    }

    fn receive(&mut self) {
        let mut bytes = [0; 64];
        let count = self.uart[1].take(&mut bytes);
        self.waiting.extend(&bytes[..count]);
        while let Some(length) = self.waiting.get(1) {
            let end = HEADER + usize::from(*length) + CHECKSUM;
            if self.waiting.len() < end {
                break;
            }
            let frame: Vec<u8> = self.waiting.drain(..end).collect();
            assert_eq!(frame[0], MAGIC, "whole frames, one behind the other");
            if frame[7..HEADER] == id::SET_POSITION_TARGET_GLOBAL_INT.to_le_bytes()[..3] {
                let word = |at: usize| frame[HEADER + at..][..4].try_into().unwrap();
                let point = Geodetic {
                    lat_e7: i32::from_le_bytes(word(4)),
                    lon_e7: i32::from_le_bytes(word(8)),
                    #[expect(clippy::cast_possible_truncation, reason = "millimetres")]
                    amsl_mm: (f32::from_le_bytes(word(12)) * 1e3) as i32,
                };
                self.targets.push(self.axis.place(point).unwrap());
            }
            if frame[7..HEADER] == id::STATUSTEXT.to_le_bytes()[..3] {
                let text = &frame[HEADER + 1..end - CHECKSUM];
                let text = text.split(|byte| *byte == 0).next().unwrap();
                self.texts.push(String::from_utf8(text.to_vec()).unwrap());
            }
            if frame[7..HEADER] == id::TIMESYNC.to_le_bytes()[..3] {
                // The reply contains the request's timestamp, and a time of the drone's own clock.
                let mut answer = vec![0; 16];
                answer[0] = 1;
                let asked = &frame[HEADER + 8..end - CHECKSUM];
                answer[8..8 + asked.len()].copy_from_slice(asked);
                self.send(id::TIMESYNC, &answer);
            }
        }
    }
}
