//! Wire format of frames and messages.
//!
//! [`deframe`] splits the byte stream and decodes COBS, [`frame`] has addresses and the CRC, [`message`] the messages, [`digest`]
//! the digest of a mission, [`auth`] the authentication, `endpoint` one node's frames, `upload` uploaded missions. This file has
//! the check sequence and the range of node numbers. `FORMAT.md` in this folder has the byte tables, `CONTRIBUTING.md` the steps to add
//! a message.

pub mod auth;
mod blake2s;
pub mod deframe;
pub mod digest;
pub(crate) mod endpoint;
pub mod frame;
pub mod message;
pub(crate) mod session;
pub mod upload;

use crc::{CRC_32_ISCSI, Crc, Table};

/// CRC-32C (Castagnoli), the check sequence at the end of every frame. Constant work per byte.
///
/// Its Hamming distance is 6 for the frame lengths used here (CRC-32: 5). Without the table (1 KiB of flash), a sweep
/// message of maximum length, whose CRC is computed twice, takes far more instructions than allowed.
pub static CRC_32C: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);

/// Largest valid node number; 4095 is reserved for broadcasts.
pub const MAX_NODE: u16 = 4094;

/// Number of nearest nodes on each side, toward Tx and toward Rx, to which a relay sends hellos. One of these nodes
/// becomes the relay's neighbour on that side.
pub(crate) const CANDIDATES: u16 = 4;

/// Number of the relays nearest to Tx or Rx that exchange messages with it on a shared channel.
pub(crate) const STATION_REACH: u16 = 2 * CANDIDATES;

/// Maximum length on the wire of a sweep message with its frame, bytes. A sweep carries up to sixteen target SIRs.
pub const MAX_SWEEP: usize = 100 + auth::TAG_ROOM;
