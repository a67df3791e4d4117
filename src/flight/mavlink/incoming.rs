//! Received messages, and the parser of their byte stream.
//!
//! Senders are the autopilot, and ground stations through it. After an invalid frame the parser continues at the second
//! byte of that frame, so no valid frame is lost. A frame must have the id of a known message, so few false starts
//! occur in noise and in other messages.

use super::frame::{
    Address, CHECKSUM, HEADER, Known, MAGIC, MAX_FRAME, MAX_PAYLOAD, SIGNATURE, SIGNED, checksum,
    find_known, id,
};
use crate::geodetic::Geodetic;
use heapless::Vec;

/// Payload of a received message; reads beyond its end return 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Payload<'a>(pub(super) &'a [u8]);

impl Payload<'_> {
    #[inline(never)] // called from many places
    fn bytes<const N: usize>(self, at: usize) -> [u8; N] {
        core::array::from_fn(|i| self.0.get(at + i).copied().unwrap_or(0))
    }

    fn u8(self, at: usize) -> u8 {
        self.bytes::<1>(at)[0]
    }

    fn i8(self, at: usize) -> i8 {
        i8::from_le_bytes(self.bytes(at))
    }

    fn i16(self, at: usize) -> i16 {
        i16::from_le_bytes(self.bytes(at))
    }

    fn u16(self, at: usize) -> u16 {
        u16::from_le_bytes(self.bytes(at))
    }

    fn i32(self, at: usize) -> i32 {
        i32::from_le_bytes(self.bytes(at))
    }

    fn u32(self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes(at))
    }

    fn u64(self, at: usize) -> u64 {
        u64::from_le_bytes(self.bytes(at))
    }

    fn f32(self, at: usize) -> f32 {
        f32::from_le_bytes(self.bytes(at))
    }
}

const _: () = assert!(
    MAX_PAYLOAD <= u8::MAX as usize,
    "the length field of a MAVLink message is one byte"
);

/// Received MAVLink message, in the units and coordinate frames of the wire. Enum values are unchecked numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Incoming {
    /// HEARTBEAT: the sender's type, mode and status.
    Heartbeat {
        /// Value of `MAV_TYPE`, the type of vehicle.
        kind: u8,
        /// Value of `MAV_AUTOPILOT`: 3 is ArduPilot, 12 PX4.
        autopilot: u8,
        /// Flags of `MAV_MODE_FLAG`: bit 7 is armed.
        base_mode: u8,
        /// Number of the flight mode, defined by the autopilot.
        custom_mode: u32,
        /// Value of `MAV_STATE`, such as active or in a failsafe.
        status: u8,
    },
    /// GLOBAL_POSITION_INT: position and velocity of the vehicle.
    GlobalPosition {
        /// Time of the position, ms since the autopilot's start.
        boot_ms: u32,
        /// Latitude of the vehicle, 10⁻⁷ degrees.
        lat_e7: i32,
        /// Longitude of the vehicle, 10⁻⁷ degrees.
        lon_e7: i32,
        /// Height above mean sea level, mm.
        amsl_mm: i32,
        /// Velocity toward north, east and down, cm/s.
        velocity_cm_s: [i16; 3],
    },
    /// SYS_STATUS, or BATTERY_STATUS of one battery.
    Battery {
        /// Number of the battery; `None` in SYS_STATUS.
        battery: Option<u8>,
        /// Remaining charge, percent; -1 is unknown.
        percent: i8,
        /// Remaining time of flight, s; 0 is unknown.
        remaining_s: i32,
    },
    /// HOME_POSITION: position to which the vehicle returns.
    Home(Geodetic),
    /// EXTENDED_SYS_STATE: landed state of the vehicle.
    ExtendedSysState {
        /// Value of `MAV_LANDED_STATE`: 1 on the ground, 2 in the air, 3 taking off, 4 landing.
        landed_state: u8,
    },
    /// POSITION_TARGET_LOCAL_NED: the vehicle's target in its local frame; only the mask is read.
    PositionTargetLocal {
        /// Mask of the parts of the target that the vehicle ignores: position, velocity, acceleration, yaw.
        type_mask: u16,
    },
    /// POSITION_TARGET_GLOBAL_INT: the vehicle's target.
    PositionTargetGlobal {
        /// Latitude of the target, 10⁻⁷ degrees.
        lat_e7: i32,
        /// Longitude of the target, 10⁻⁷ degrees.
        lon_e7: i32,
        /// Altitude of the target above the reference of `frame`, m.
        altitude_m: f32,
        /// Mask of the parts of the target that the vehicle ignores: position, velocity, acceleration, yaw.
        type_mask: u16,
        /// Value of `MAV_FRAME`: 5 is above mean sea level.
        frame: u8,
    },
    /// COMMAND_LONG: command with seven parameters.
    CommandLong {
        /// Value of `MAV_CMD`: number of the command.
        command: u16,
        /// Parameters of the command. Their meaning depends on `command`.
        parameters: [f32; 7],
        /// MAVLink address of the addressee.
        to: Address,
        /// True if the sender repeats a command because it has received no answer.
        is_repeated: bool,
    },
    /// COMMAND_ACK: reply to a command.
    CommandAck {
        /// Value of `MAV_CMD`: number of the command.
        command: u16,
        /// Value of `MAV_RESULT`: 0 is accepted.
        result: u8,
    },
    /// TIMESYNC: a request or its reply.
    TimeSync {
        /// Clock of the replying system, ns; 0 in a request.
        answered: u64,
        /// Time stamp of the request, repeated in the reply, in units chosen by the requesting system.
        asked: u64,
    },
    /// FENCE_STATUS: state of the vehicle's geofence.
    FenceStatus {
        /// True while the vehicle is outside of its geofence.
        is_breached: bool,
    },
    /// RADIO_STATUS of a SiK radio: signal and noise. [`noise_w`] converts a noise level to W.
    RadioStatus {
        /// Signal strength of the last received frame, in steps of 1/1.9 dB above -127 dBm; 255 is unknown.
        rssi: u8,
        /// Noise level between frames, in steps of 1/1.9 dB above -127 dBm; 0 and 255 are unknown.
        noise: u8,
    },
}

impl Incoming {
    /// Decodes the payload of message `id`; `None` for a message that a companion does not use.
    pub(super) fn read(id: u32, payload: Payload<'_>) -> Option<Self> {
        Some(match id {
            id::HEARTBEAT => Self::Heartbeat {
                custom_mode: payload.u32(0),
                kind: payload.u8(4),
                autopilot: payload.u8(5),
                base_mode: payload.u8(6),
                status: payload.u8(7),
            },
            id::GLOBAL_POSITION_INT => Self::GlobalPosition {
                boot_ms: payload.u32(0),
                lat_e7: payload.i32(4),
                lon_e7: payload.i32(8),
                amsl_mm: payload.i32(12),
                velocity_cm_s: [20, 22, 24].map(|at| payload.i16(at)),
            },
            id::SYS_STATUS => Self::Battery {
                battery: None,
                percent: payload.i8(30),
                remaining_s: 0,
            },
            id::BATTERY_STATUS => Self::Battery {
                battery: Some(payload.u8(32)),
                percent: payload.i8(35),
                remaining_s: payload.i32(36),
            },
            id::HOME_POSITION => Self::Home(Geodetic {
                lat_e7: payload.i32(0),
                lon_e7: payload.i32(4),
                amsl_mm: payload.i32(8),
            }),
            id::EXTENDED_SYS_STATE => Self::ExtendedSysState {
                landed_state: payload.u8(1),
            },
            id::POSITION_TARGET_LOCAL_NED => Self::PositionTargetLocal {
                type_mask: payload.u16(48),
            },
            id::POSITION_TARGET_GLOBAL_INT => Self::PositionTargetGlobal {
                lat_e7: payload.i32(4),
                lon_e7: payload.i32(8),
                altitude_m: payload.f32(12),
                type_mask: payload.u16(48),
                frame: payload.u8(50),
            },
            id::COMMAND_LONG => Self::CommandLong {
                command: payload.u16(28),
                parameters: [0, 4, 8, 12, 16, 20, 24].map(|at| payload.f32(at)),
                to: Address {
                    system: payload.u8(30),
                    component: payload.u8(31),
                },
                is_repeated: payload.u8(32) > 0,
            },
            id::COMMAND_ACK => Self::CommandAck {
                command: payload.u16(0),
                result: payload.u8(2),
            },
            id::TIMESYNC => Self::TimeSync {
                answered: payload.u64(0),
                asked: payload.u64(8),
            },
            id::FENCE_STATUS => Self::FenceStatus {
                is_breached: payload.u8(6) != 0,
            },
            id::RADIO_STATUS => Self::RadioStatus {
                rssi: payload.u8(4),
                noise: payload.u8(7),
            },
            _ => return None,
        })
    }
}

/// Step of a SiK radio's signal levels, 1/1.9 dB, as log2 of the ratio of two powers: log2(10) / 19.
const SIK_PER_UNIT: f32 = 0.174_838_32;

/// Lowest signal level of a SiK radio (level 0, -127 dBm), as log2 of the power in W: -15.7 log2(10).
const SIK_ZERO: f32 = -52.154_27;

/// Returns the noise power for the value `noise` of a SiK radio's RADIO_STATUS, W.
///
/// `None` for 255 (unknown), and for 0, which a radio reports before its first measurement. The radio's documentation
/// states `signal_dBm = (RSSI / 1.9) - 127` as an approximation, and the same units for noise.
///
/// Source: "SiK Radio, advanced configuration" of ArduPilot, on `LBT_RSSI`; mavros (`3dr_radio`) and INAV convert
/// alike.
pub fn noise_w(noise: u8) -> Option<f32> {
    (1..=254)
        .contains(&noise)
        .then(|| libm::exp2f(SIK_ZERO + SIK_PER_UNIT * f32::from(noise)))
}

/// Received MAVLink message, and its sender.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Received {
    /// MAVLink address of the sender.
    pub from: Address,
    /// Decoded message; `None` if this crate does not decode messages with this id.
    pub message: Option<Incoming>,
    /// MAVLink id of the received message.
    pub id: u32,
    /// True if the frame has a signature, which the parser does not check.
    pub is_signed: bool,
}

/// Counters of received MAVLink frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Number of valid MAVLink frames received.
    pub frames: u32,
    /// Number of corrupted frames: known messages with a wrong checksum or unknown incompatibility flags. Received
    /// bytes that only look like a frame are counted, too.
    pub broken: u32,
}

/// Parser of MAVLink frames, with a buffer of one frame of maximum length.
#[derive(Clone, Debug, Default)]
pub struct Parser {
    /// Received bytes that have not been parsed yet. The first byte, if any, is the start byte of a possible frame.
    bytes: Vec<u8, MAX_FRAME>,
    counters: Counters,
}

enum First {
    /// The received bytes are the start of an incomplete frame.
    Part,
    /// The received bytes do not start a frame: the header is unknown or invalid.
    None,
    /// The received bytes start with a corrupted frame.
    Broken,
    Frame(Received, usize),
}

impl Parser {
    /// Creates a MAVLink parser that has not received any bytes.
    pub const fn new() -> Self {
        Self {
            bytes: Vec::new(),
            counters: Counters {
                frames: 0,
                broken: 0,
            },
        }
    }

    /// Adds one received byte. Call [`next_message`](Self::next_message) until it returns `None` before the next
    /// byte. Constant work.
    pub fn push(&mut self, byte: u8) {
        if self.bytes.is_empty() && byte != MAGIC {
            return;
        }
        if self.bytes.push(byte).is_err() {
            // The caller has not called `next_message` often enough.
            self.bytes.clear();
        }
    }

    /// Returns the next received message, or `None`. Constant work for each byte, see [`next_frame`](Self::next_frame).
    pub fn next_message(&mut self) -> Option<Received> {
        self.next_frame(|received, _| received)
    }

    /// Calls `read` with the next received message and its frame's bytes, and returns the result of `read`. `None` if
    /// no complete message has been received.
    ///
    /// Work: for each received byte, at most one checksum over at most 266 bytes. In real frames a checksum is computed
    /// for at most one byte in ten, in maliciously chosen bytes for one in three.
    pub fn next_frame<T>(&mut self, read: impl FnOnce(Received, &[u8]) -> T) -> Option<T> {
        while !self.bytes.is_empty() {
            match first(&self.bytes) {
                First::Part => return None,
                First::None => self.drop_front(1),
                First::Broken => {
                    self.counters.broken = self.counters.broken.saturating_add(1);
                    self.drop_front(1);
                }
                First::Frame(received, length) => {
                    self.counters.frames = self.counters.frames.saturating_add(1);
                    let all = self.bytes.get(..length).unwrap_or_default();
                    let read = read(received, all);
                    self.drop_front(length);
                    return Some(read);
                }
            }
        }
        None
    }

    /// Returns the numbers of valid and corrupted frames since the parser was created.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Discards the first `length` received bytes. The bytes before the next possible start of a frame are discarded,
    /// too.
    fn drop_front(&mut self, length: usize) {
        let rest = self.bytes.get(length..).unwrap_or_default();
        let skipped = rest.iter().take_while(|byte| **byte != MAGIC).count();
        let from = length + skipped;
        let left = self.bytes.len().saturating_sub(from);
        // A manual loop is used, since `copy_within` would add 1.5 KB of flash.
        for at in 0..left {
            let byte = self.bytes.get(from + at).copied().unwrap_or_default();
            if let Some(place) = self.bytes.get_mut(at) {
                *place = byte;
            }
        }
        self.bytes.truncate(left);
    }
}

fn first(bytes: &[u8]) -> First {
    let Some(header) = bytes.first_chunk::<HEADER>() else {
        return First::Part;
    };
    let [_, length, incompatible, _, _, system, component, a, b, c] = *header;
    let id = u32::from_le_bytes([a, b, c, 0]);
    let Some(known) = find_known(id).filter(|known| length <= known.longest()) else {
        return First::None;
    };
    if incompatible & !SIGNED != 0 {
        return First::Broken;
    }
    let is_signed = incompatible & SIGNED != 0;
    let end = HEADER + usize::from(length);
    let all = end + CHECKSUM + if is_signed { SIGNATURE } else { 0 };
    if bytes.len() < all {
        return First::Part;
    }
    if !holds(bytes, end, known) {
        return First::Broken;
    }
    let payload = Payload(bytes.get(HEADER..end).unwrap_or_default());
    let received = Received {
        from: Address { system, component },
        message: Incoming::read(id, payload),
        id,
        is_signed,
    };
    First::Frame(received, all)
}

/// Returns true if the checksum at index `end` of `bytes` matches the bytes from index 1 to `end`.
fn holds(bytes: &[u8], end: usize, known: Known) -> bool {
    let said = bytes.get(end..).and_then(<[u8]>::first_chunk);
    bytes
        .get(1..end)
        .is_some_and(|covered| said == Some(&checksum(covered, known).to_le_bytes()))
}
