//! Layout of a MAVLink 2 frame, and the known messages of the `common` dialect.
//!
//! | byte | content |
//! | --- | --- |
//! | 0 | 0xFD |
//! | 1 | payload length; trailing zeros are not sent, except for the first byte |
//! | 2, 3 | incompatible flags (1: signed), and compatible flags |
//! | 4 | sequence number of the sender |
//! | 5, 6 | system and component of the sender |
//! | 7 to 9 | message id, little-endian |
//! | then | payload, checksum (2 bytes), signature (13 bytes, if signed) |
//!
//! The checksum is CRC-16/MCRF4XX over all bytes but the first, and over the message's CRC seed, which is not sent.

use crc::{CRC_16_MCRF4XX, Crc, NoTable};

/// First byte of a MAVLink 2 frame.
pub const MAGIC: u8 = 0xFD;

/// Length of a MAVLink frame's header, bytes.
pub const HEADER: usize = 10;

/// Length of a MAVLink frame's checksum, bytes.
pub const CHECKSUM: usize = 2;
/// Length of a signed MAVLink frame's signature, bytes.
pub const SIGNATURE: usize = 13;

/// Maximum payload length of a MAVLink frame, bytes.
pub const MAX_PAYLOAD: usize = 255;

/// Maximum length of a MAVLink frame, bytes.
pub const MAX_FRAME: usize = HEADER + MAX_PAYLOAD + CHECKSUM + SIGNATURE;

/// Incompatibility flag that marks a signed MAVLink frame.
pub const SIGNED: u8 = 1;

/// CRC of MAVLink, computed bit by bit. A table would take a kilobyte of flash, and a link to an autopilot transports
/// only about 10 kB/s.
static CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_MCRF4XX);

/// MAVLink address: sender or addressee of a message.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Address {
    /// MAVLink system id of the sender or addressee, 1 to 255.
    pub system: u8,
    /// MAVLink component id: 1 is the autopilot, 191 an onboard computer.
    pub component: u8,
}

/// Returns the checksum of a frame with the message properties `known`, which include the CRC seed. `covered` are the
/// bytes of the frame from the second byte to the end of the payload.
pub fn checksum(covered: &[u8], known: Known) -> u16 {
    let mut digest = CRC.digest();
    digest.update(covered);
    digest.update(&[known.crc_extra]);
    digest.finalize()
}

/// Properties of a MAVLink message that the checksum and the parser need.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Known {
    /// Id of the MAVLink message, 24 bits.
    pub id: u32,
    /// CRC seed, a digest of the message's definition. With different definitions at sender and receiver the checksum
    /// fails.
    pub crc_extra: u8,
    /// Length of the message's original fields, bytes. Extension fields of later MAVLink dialects are not counted.
    pub length: u8,
}

/// Ids of the MAVLink messages that this crate uses.
pub mod id {
    /// Message HEARTBEAT: type, mode and state of a system.
    pub const HEARTBEAT: u32 = 0;
    /// Message SYS_STATUS: state of the vehicle's parts, with the battery's percentage.
    pub const SYS_STATUS: u32 = 1;
    /// Message PARAM_REQUEST_READ: a request for the value of a parameter.
    pub const PARAM_REQUEST_READ: u32 = 20;
    /// Message PARAM_VALUE: the value of a parameter.
    pub const PARAM_VALUE: u32 = 22;
    /// Message GLOBAL_POSITION_INT: position of the vehicle.
    pub const GLOBAL_POSITION_INT: u32 = 33;
    /// Message COMMAND_LONG: a command with seven parameters.
    pub const COMMAND_LONG: u32 = 76;
    /// Message COMMAND_ACK: reply to a command.
    pub const COMMAND_ACK: u32 = 77;
    /// Message POSITION_TARGET_LOCAL_NED: the vehicle's target, in its local frame.
    pub const POSITION_TARGET_LOCAL_NED: u32 = 85;
    /// Message SET_POSITION_TARGET_GLOBAL_INT: target position to fly to.
    pub const SET_POSITION_TARGET_GLOBAL_INT: u32 = 86;
    /// Message POSITION_TARGET_GLOBAL_INT: the vehicle's target, as latitude and longitude.
    pub const POSITION_TARGET_GLOBAL_INT: u32 = 87;
    /// Message RADIO_STATUS: signal and noise level of a radio.
    pub const RADIO_STATUS: u32 = 109;
    /// Message TIMESYNC: clock value, which the receiver of the message sends back.
    pub const TIMESYNC: u32 = 111;
    /// Message BATTERY_STATUS: state of one battery.
    pub const BATTERY_STATUS: u32 = 147;
    /// Message FENCE_STATUS: state of the vehicle's geofence.
    pub const FENCE_STATUS: u32 = 162;
    /// Message HOME_POSITION: position to which the vehicle returns.
    pub const HOME_POSITION: u32 = 242;
    /// Message EXTENDED_SYS_STATE: landed state of the vehicle.
    pub const EXTENDED_SYS_STATE: u32 = 245;
    /// Message NAMED_VALUE_FLOAT: named number, for an operator to plot.
    pub const NAMED_VALUE_FLOAT: u32 = 251;
    /// Message STATUSTEXT: text for an operator.
    pub const STATUSTEXT: u32 = 253;
}

/// Maximum length of the extension fields that a later MAVLink dialect may add to a message, bytes. Received bytes that
/// look like a longer message are skipped as noise.
const ADDED: u8 = 24;

impl Known {
    /// Maximum payload length of this message, bytes. 24 bytes for extension fields of later dialects are included.
    pub const fn longest(self) -> u8 {
        self.length.saturating_add(ADDED)
    }
}

const fn known(id: u32, crc_extra: u8, length: u8) -> Known {
    Known {
        id,
        crc_extra,
        length,
    }
}

/// Messages that the parser knows: those used by this crate, and those that can contain MAVLink frames.
///
/// A message that can contain frames is skipped together with its payload. So a frame inside the payload does not count
/// as received.
const TABLE: [Known; 31] = [
    known(id::HEARTBEAT, 50, 9),
    known(id::SYS_STATUS, 124, 31),
    known(id::PARAM_REQUEST_READ, 214, 20),
    known(id::PARAM_VALUE, 220, 25),
    known(id::GLOBAL_POSITION_INT, 104, 28),
    known(id::COMMAND_LONG, 152, 33),
    known(id::COMMAND_ACK, 143, 10),
    known(id::POSITION_TARGET_LOCAL_NED, 140, 51),
    known(id::SET_POSITION_TARGET_GLOBAL_INT, 5, 53),
    known(id::POSITION_TARGET_GLOBAL_INT, 150, 51),
    known(id::RADIO_STATUS, 185, 9),
    known(id::TIMESYNC, 34, 16),
    known(id::BATTERY_STATUS, 154, 36),
    known(id::FENCE_STATUS, 189, 8),
    known(id::HOME_POSITION, 104, 52),
    known(id::EXTENDED_SYS_STATE, 130, 2),
    known(id::NAMED_VALUE_FLOAT, 170, 18),
    known(id::STATUSTEXT, 83, 54),
    // FILE_TRANSFER_PROTOCOL, LOG_DATA, GPS_INJECT_DATA, SERIAL_CONTROL, ENCAPSULATED_DATA.
    known(110, 84, 254),
    known(120, 134, 97),
    known(123, 250, 113),
    known(126, 220, 81),
    known(131, 223, 255),
    // DATA64, DATA96, REMOTE_LOG_DATA_BLOCK, GPS_RTCM_DATA, V2_EXTENSION.
    known(171, 181, 66),
    known(172, 22, 98),
    known(184, 159, 206),
    known(233, 35, 182),
    known(248, 8, 254),
    // LOGGING_DATA, LOGGING_DATA_ACKED, TUNNEL.
    known(266, 193, 255),
    known(267, 35, 255),
    known(385, 147, 133),
];

/// Returns the properties of the message `id`; `None` for an unknown message.
pub fn find_known(id: u32) -> Option<Known> {
    TABLE.into_iter().find(|known| known.id == id)
}
