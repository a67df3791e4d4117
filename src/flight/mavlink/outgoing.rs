//! Messages that a companion sends.

use heapless::Vec;

use super::frame::{Address, CHECKSUM, HEADER, MAGIC, SIGNATURE, checksum, find_known, id};
use crate::features::MAVLINK_SIGNING;
use crate::geodetic::Geodetic;

/// Maximum payload length of the messages that this crate sends, bytes.
const LONGEST: usize = 54;

/// Number of bytes reserved for a signature; 0 without the feature `mavlink-signing`.
const SIGNING: usize = if MAVLINK_SIGNING { SIGNATURE } else { 0 };

/// Length of the longest frame to send, bytes, with a signature.
pub(crate) const FRAME: usize = HEADER + LONGEST + CHECKSUM + SIGNING;

/// MAVLink frame to send. The capacity includes a signature.
pub type FrameBytes = Vec<u8, FRAME>;

/// Severities of [`Outgoing::StatusText`] (`MAV_SEVERITY`).
pub mod severity {
    /// Severity of a problem that requires action now.
    pub const CRITICAL: u8 = 2;
    /// Severity of a problem that does not end the flight.
    pub const WARNING: u8 = 4;
    /// Severity of information for the operator.
    pub const INFO: u8 = 6;
}

/// MAVLink message to send, in the units and coordinate frames of the wire.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Outgoing<'a> {
    /// HEARTBEAT of an active onboard computer, the companion.
    Heartbeat,
    /// COMMAND_LONG 511, SET_MESSAGE_INTERVAL: request to send a message at an interval.
    SetMessageInterval {
        /// MAVLink id of the requested message.
        id: u32,
        /// Interval between two of the requested messages, µs.
        interval_us: u32,
    },
    /// COMMAND_ACK: reply to a command.
    CommandAck {
        /// Value of `MAV_CMD`, the number of the command.
        command: u16,
        /// Value of `MAV_RESULT`: answer to the command.
        result: u8,
        /// MAVLink address to which the reply goes: the sender of the command.
        to: Address,
    },
    /// SET_POSITION_TARGET_GLOBAL_INT: target to fly to, above mean sea level (frame 5).
    SetPosition {
        /// Time since the companion's start, ms.
        boot_ms: u32,
        /// Target position of the drone.
        at: Geodetic,
        /// Target velocity toward north, east and down, m/s. `None` if the drone is to stop at the target.
        velocity_m_s: Option<[f32; 3]>,
        /// Heading of the drone, radians clockwise from north; `None` leaves it to the autopilot.
        yaw_rad: Option<f32>,
    },
    /// TIMESYNC request, which the autopilot sends back.
    TimeSync {
        /// Time stamp of the request, repeated in the reply.
        asked: u64,
    },
    /// STATUSTEXT: text for an operator, of at most 50 bytes; a longer text is truncated.
    StatusText {
        /// Severity of the text: see [`severity`].
        severity: u8,
        /// Text for the operator.
        text: &'a str,
    },
    /// NAMED_VALUE_FLOAT: named number, for an operator to plot.
    NamedValue {
        /// Time since the companion's start, ms.
        boot_ms: u32,
        /// Name of the number, at most ten bytes; a longer name is truncated.
        name: &'a str,
        /// Value of the number.
        value: f32,
    },
}

/// Bits of `type_mask` in a target message: values that the autopilot must ignore.
///
/// Position (bits 0 to 2), velocity (3 to 5), acceleration (6 to 8), yaw (10), yaw rate (11).
mod mask {
    pub(super) const VELOCITY: u16 = 0b11_1000;
    pub(super) const ACCELERATION: u16 = 0b1_1100_0000;
    pub(super) const YAW: u16 = 1 << 10;
    pub(super) const YAW_RATE: u16 = 1 << 11;
}

/// Value `MAV_FRAME_GLOBAL_INT`: latitude, longitude, and altitude above mean sea level.
const FRAME_AMSL: u8 = 5;

pub(in crate::flight) const SET_MESSAGE_INTERVAL: u16 = 511;

impl Outgoing<'_> {
    const fn id(&self) -> u32 {
        match self {
            Self::Heartbeat => id::HEARTBEAT,
            Self::SetMessageInterval { .. } => id::COMMAND_LONG,
            Self::CommandAck { .. } => id::COMMAND_ACK,
            Self::SetPosition { .. } => id::SET_POSITION_TARGET_GLOBAL_INT,
            Self::TimeSync { .. } => id::TIMESYNC,
            Self::StatusText { .. } => id::STATUSTEXT,
            Self::NamedValue { .. } => id::NAMED_VALUE_FLOAT,
        }
    }

    /// Encodes the message as an unsigned frame from `from` to the autopilot `to`. Constant work.
    pub fn encode(&self, from: Address, to: Address, sequence: u8) -> FrameBytes {
        let mut writer = Writer(FrameBytes::new());
        let [a, b, c, _] = self.id().to_le_bytes();
        let Address { system, component } = from;
        writer.bytes(&[MAGIC, 0, 0, 0, sequence, system, component, a, b, c]);
        self.write(&mut writer, to);
        let mut frame = writer.0;
        while frame.len() > HEADER + 1 && frame.last() == Some(&0) {
            frame.pop();
        }
        let length = frame.len() - HEADER;
        if let (Some(byte), Ok(length)) = (frame.get_mut(1), u8::try_from(length)) {
            *byte = length;
        }
        if let (Some(known), Some(covered)) = (find_known(self.id()), frame.get(1..)) {
            let checksum = checksum(covered, known);
            let mut writer = Writer(frame);
            writer.bytes(&checksum.to_le_bytes());
            frame = writer.0;
        }
        frame
    }

    fn write(&self, to_frame: &mut Writer, to: Address) {
        match *self {
            Self::Heartbeat => {
                // Onboard controller (18), no autopilot (8), no flags, active (4), MAVLink version 3.
                to_frame.bytes(&[0, 0, 0, 0, 18, 8, 0, 4, 3]);
            }
            Self::SetMessageInterval { id, interval_us } => {
                #[expect(
                    clippy::cast_precision_loss,
                    reason = "numbers and intervals are small"
                )]
                let parameters = [id as f32, interval_us as f32];
                for parameter in parameters {
                    to_frame.bytes(&parameter.to_le_bytes());
                }
                to_frame.bytes(&[0; 20]);
                to_frame.bytes(&SET_MESSAGE_INTERVAL.to_le_bytes());
                to_frame.bytes(&[to.system, to.component, 0]);
            }
            Self::CommandAck {
                command,
                result,
                to,
            } => {
                to_frame.bytes(&command.to_le_bytes());
                to_frame.bytes(&[result, 0, 0, 0, 0, 0, to.system, to.component]);
            }
            Self::SetPosition {
                boot_ms,
                at,
                velocity_m_s,
                yaw_rad,
            } => {
                to_frame.bytes(&boot_ms.to_le_bytes());
                to_frame.bytes(&at.lat_e7.to_le_bytes());
                to_frame.bytes(&at.lon_e7.to_le_bytes());
                #[expect(
                    clippy::cast_precision_loss,
                    reason = "the wire has an f32, a millimetre up to 16 km"
                )]
                let amsl_m = at.amsl_mm as f32 / 1e3;
                to_frame.bytes(&amsl_m.to_le_bytes());
                for part in velocity_m_s.unwrap_or_default() {
                    to_frame.bytes(&part.to_le_bytes());
                }
                to_frame.bytes(&[0; 12]);
                to_frame.bytes(&yaw_rad.unwrap_or_default().to_le_bytes());
                to_frame.bytes(&[0; 4]);
                let mut left_out = mask::ACCELERATION | mask::YAW_RATE;
                if velocity_m_s.is_none() {
                    left_out |= mask::VELOCITY;
                }
                if yaw_rad.is_none() {
                    left_out |= mask::YAW;
                }
                to_frame.bytes(&left_out.to_le_bytes());
                to_frame.bytes(&[to.system, to.component, FRAME_AMSL]);
            }
            Self::TimeSync { asked } => {
                to_frame.bytes(&[0; 8]);
                to_frame.bytes(&asked.to_le_bytes());
            }
            Self::StatusText { severity, text } => {
                to_frame.bytes(&[severity]);
                to_frame.text::<50>(text);
                to_frame.bytes(&[0; 3]);
            }
            Self::NamedValue {
                boot_ms,
                name,
                value,
            } => {
                to_frame.bytes(&boot_ms.to_le_bytes());
                to_frame.bytes(&value.to_le_bytes());
                to_frame.text::<10>(name);
            }
        }
    }
}

/// Writer of a message's fields into a frame. The frame never overflows, since the fields of a sent message have at
/// most [`LONGEST`] bytes.
struct Writer(FrameBytes);

impl Writer {
    #[inline(never)] // called from many places
    fn bytes(&mut self, bytes: &[u8]) {
        debug_assert!(self.0.len() + bytes.len() <= self.0.capacity());
        for byte in bytes {
            // There is room for the byte, as asserted.
            let _ = self.0.push(*byte);
        }
    }

    /// Writes `N` bytes: the part of `text` that fits, without a partial character, then zeros.
    fn text<const N: usize>(&mut self, text: &str) {
        let mut end = text.len().min(N);
        while !text.is_char_boundary(end) {
            end = end.saturating_sub(1);
        }
        let text = text.as_bytes().get(..end).unwrap_or_default();
        self.bytes(text);
        for _ in text.len()..N {
            self.bytes(&[0]);
        }
    }
}
