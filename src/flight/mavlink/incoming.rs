//! Received messages, from the autopilot and from ground stations behind it.

use super::frame::{Address, MAX_PAYLOAD};
use super::table::id;

/// Payload of a message; reads beyond its end return 0.
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

const _: () = assert!(MAX_PAYLOAD <= u8::MAX as usize, "what a length says");

/// Received message, in the units and frames of the wire. Enum values are unchecked numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Incoming {
    /// HEARTBEAT.
    Heartbeat {
        /// `MAV_TYPE`.
        kind: u8,
        /// `MAV_AUTOPILOT`: 3 is ArduPilot, 12 PX4.
        autopilot: u8,
        /// `MAV_MODE_FLAG`: bit 7 is armed.
        base_mode: u8,
        /// Mode number of the autopilot.
        custom_mode: u32,
        /// `MAV_STATE`.
        status: u8,
    },
    /// GLOBAL_POSITION_INT.
    GlobalPosition {
        /// Time of the position, ms since the autopilot's start.
        boot_ms: u32,
        /// 10⁻⁷ degrees.
        lat_e7: i32,
        /// 10⁻⁷ degrees.
        lon_e7: i32,
        /// Height above mean sea level, mm.
        amsl_mm: i32,
        /// Velocity toward north, east and down, cm/s.
        velocity_cm_s: [i16; 3],
    },
    /// EXTENDED_SYS_STATE.
    ExtendedSysState {
        /// `MAV_LANDED_STATE`: 1 on the ground, 2 in the air, 3 taking off, 4 landing.
        landed_state: u8,
    },
    /// POSITION_TARGET_LOCAL_NED; only its kind of target.
    PositionTargetLocal {
        /// Bits of the ignored fields.
        type_mask: u16,
    },
    /// POSITION_TARGET_GLOBAL_INT.
    PositionTargetGlobal {
        /// 10⁻⁷ degrees.
        lat_e7: i32,
        /// 10⁻⁷ degrees.
        lon_e7: i32,
        /// Altitude in `frame`, m.
        altitude_m: f32,
        /// Bits of the ignored fields.
        type_mask: u16,
        /// `MAV_FRAME`: 5 is above mean sea level.
        frame: u8,
    },
    /// COMMAND_LONG.
    CommandLong {
        /// `MAV_CMD`.
        command: u16,
        /// Seven parameters.
        parameters: [f32; 7],
        /// System and component of the addressee.
        to: Address,
        /// True for a repetition of a command without an answer.
        is_repeated: bool,
    },
    /// COMMAND_ACK.
    CommandAck {
        /// `MAV_CMD`.
        command: u16,
        /// `MAV_RESULT`: 0 accepted.
        result: u8,
    },
    /// TIMESYNC: a request or its reply.
    TimeSync {
        /// Clock of the replying system, ns; 0 in a request.
        answered: u64,
        /// Clock of the requesting system.
        asked: u64,
    },
    /// FENCE_STATUS.
    FenceStatus {
        /// True while the vehicle is outside of its geofence.
        is_breached: bool,
    },
    /// RADIO_STATUS of a SiK radio, in the units of [`sik`](super::sik); 255 is unknown.
    RadioStatus {
        /// Signal strength of the last frame.
        rssi: u8,
        /// Noise level between frames.
        noise: u8,
    },
}

impl Incoming {
    /// Decodes a payload; `None` for a message that a companion does not use.
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
