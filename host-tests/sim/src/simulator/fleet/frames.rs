//! MAVLink frames of a simulated autopilot: encoding and decoding.

use uav_relay::Geodetic;
use uav_relay::flight::mavlink::frame::{CHECKSUM, HEADER, MAGIC, checksum, find_known, id};

/// MAVLink system ID.
const SYSTEM: u8 = 1;

/// Message sent by the autopilot.
#[derive(Clone, Copy, Debug)]
pub(super) enum SensorReading {
    Heartbeat {
        autopilot: u8,
        armed: bool,
        custom_mode: u32,
        /// True for `MAV_STATE` 5 (critical): failsafe.
        is_critical: bool,
    },
    /// Reply to a TIMESYNC request.
    Sync {
        asked: u64,
    },
    State {
        landed: u8,
    },
    Position {
        boot_ms: u32,
        at: Geodetic,
    },
    Target {
        at: Geodetic,
    },
}

impl SensorReading {
    pub(super) fn frame(self, sequence: u8) -> Vec<u8> {
        let mut payload = Vec::new();
        let id = match self {
            Self::Heartbeat {
                autopilot,
                armed,
                custom_mode,
                is_critical,
            } => {
                payload.extend(custom_mode.to_le_bytes());
                // Quadrotor; custom mode; active or critical.
                let status = if is_critical { 5 } else { 4 };
                payload.extend([2, autopilot, 1 | if armed { 128 } else { 0 }, status, 3]);
                id::HEARTBEAT
            }
            Self::Sync { asked } => {
                payload.extend(1_u64.to_le_bytes());
                payload.extend(asked.to_le_bytes());
                id::TIMESYNC
            }
            Self::State { landed } => {
                payload.extend([0, landed]);
                id::EXTENDED_SYS_STATE
            }
            Self::Position { boot_ms, at } => {
                payload.extend(boot_ms.to_le_bytes());
                for part in [at.lat_e7, at.lon_e7, at.amsl_mm, 0] {
                    payload.extend(part.to_le_bytes());
                }
                payload.extend([0; 8]);
                id::GLOBAL_POSITION_INT
            }
            Self::Target { at } => {
                payload.extend([0; 4]);
                payload.extend(at.lat_e7.to_le_bytes());
                payload.extend(at.lon_e7.to_le_bytes());
                #[expect(clippy::cast_precision_loss, reason = "the wire has an f32")]
                payload.extend((at.amsl_mm as f32 / 1e3).to_le_bytes());
                payload.extend([0; 32]);
                payload.extend([0xF8, 0x0D, 5]);
                id::POSITION_TARGET_GLOBAL_INT
            }
        };
        framed(id, &payload, sequence)
    }
}

fn framed(id: u32, payload: &[u8], sequence: u8) -> Vec<u8> {
    let [a, b, c, _] = id.to_le_bytes();
    let length = u8::try_from(payload.len()).unwrap_or(u8::MAX);
    let mut frame = vec![MAGIC, length, 0, 0, sequence, SYSTEM, 1, a, b, c];
    frame.extend(payload);
    if let (Some(known), Some(covered)) = (find_known(id), frame.get(1..)) {
        frame.extend(checksum(covered, known).to_le_bytes());
    }
    frame
}

/// Message received by the autopilot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Heard {
    /// Message interval request, µs.
    Interval { id: u32, interval_us: u64 },
    /// Position target.
    Target(Geodetic),
    /// TIMESYNC request; the value is returned.
    Sync(u64),
}

/// Decodes a received frame; `None` for messages that the autopilot ignores.
pub(super) fn heard(frame: &[u8]) -> Option<Heard> {
    let end = frame.len().checked_sub(CHECKSUM)?;
    let header = frame.first_chunk::<HEADER>()?;
    let [.., a, b, c] = *header;
    let payload = frame.get(HEADER..end)?;
    let bytes = |at: usize| [0, 1, 2, 3].map(|i| payload.get(at + i).copied().unwrap_or(0));
    let float = |at| f64::from(f32::from_le_bytes(bytes(at)));
    match u32::from_le_bytes([a, b, c, 0]) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "numbers of messages and microseconds"
        )]
        id::COMMAND_LONG => Some(Heard::Interval {
            id: float(0) as u32,
            interval_us: float(4) as u64,
        }),
        #[expect(clippy::cast_possible_truncation, reason = "millimetres")]
        id::SET_POSITION_TARGET_GLOBAL_INT => Some(Heard::Target(Geodetic {
            lat_e7: i32::from_le_bytes(bytes(4)),
            lon_e7: i32::from_le_bytes(bytes(8)),
            amsl_mm: (float(12) * 1e3).round() as i32,
        })),
        id::TIMESYNC => {
            let [low, high] = [8, 12].map(|at| u64::from(u32::from_le_bytes(bytes(at))));
            Some(Heard::Sync(high << 32 | low))
        }
        _ => None,
    }
}
