//! The messages that are known, from the `common` dialect.

/// What the checksum and the parser have to know of a message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Known {
    /// Its number, of 24 bits.
    pub id: u32,
    /// The byte that is added to the checksum: a digest of the message's fields, so that both ends mean the same by it.
    pub crc_extra: u8,
    /// Bytes of its fields, without what a later dialect may add.
    pub length: u8,
}

/// Numbers of messages.
pub mod id {
    /// Who is there, of what kind, in which mode.
    pub const HEARTBEAT: u32 = 0;
    /// Where the vehicle is.
    pub const GLOBAL_POSITION_INT: u32 = 33;
    /// A command with seven numbers.
    pub const COMMAND_LONG: u32 = 76;
    /// What became of a command.
    pub const COMMAND_ACK: u32 = 77;
    /// What an ArduPilot or PX4 flies to, in its own local frame.
    pub const POSITION_TARGET_LOCAL_NED: u32 = 85;
    /// Where to fly to.
    pub const SET_POSITION_TARGET_GLOBAL_INT: u32 = 86;
    /// What the vehicle flies to.
    pub const POSITION_TARGET_GLOBAL_INT: u32 = 87;
    /// What a radio has heard.
    pub const RADIO_STATUS: u32 = 109;
    /// A clock that is sent back.
    pub const TIMESYNC: u32 = 111;
    /// The state of the vehicle's fence.
    pub const FENCE_STATUS: u32 = 162;
    /// Whether it is on the ground.
    pub const EXTENDED_SYS_STATE: u32 = 245;
    /// A number with a name, for an operator to plot.
    pub const NAMED_VALUE_FLOAT: u32 = 251;
    /// A line for an operator to read.
    pub const STATUSTEXT: u32 = 253;
}

/// So many bytes a later dialect may add to a message. What says that it is longer is none: its number is noise.
const ADDED: u8 = 24;

impl Known {
    /// The longest payload that is taken for this message.
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

/// First what is read or written; then what carries bytes of others, which may look like frames: it has to be known to be passed over whole.
const TABLE: [Known; 26] = [
    known(id::HEARTBEAT, 50, 9),
    known(id::GLOBAL_POSITION_INT, 104, 28),
    known(id::COMMAND_LONG, 152, 33),
    known(id::COMMAND_ACK, 143, 10),
    known(id::POSITION_TARGET_LOCAL_NED, 140, 51),
    known(id::SET_POSITION_TARGET_GLOBAL_INT, 5, 53),
    known(id::POSITION_TARGET_GLOBAL_INT, 150, 51),
    known(id::RADIO_STATUS, 185, 9),
    known(id::TIMESYNC, 34, 16),
    known(id::FENCE_STATUS, 189, 8),
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

/// What is known of that message.
pub fn find(id: u32) -> Option<Known> {
    TABLE.into_iter().find(|known| known.id == id)
}
