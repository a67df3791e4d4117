//! MAVLink 2, as far as a companion needs it: by a table of messages, numbers instead of enums, nothing that can panic.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`table`] | the messages that are known: number, CRC seed, length |
//! | [`frame`] | what stands around a payload, and the checksum |
//! | [`parser`] | frames out of a stream of bytes |
//! | [`incoming`] | what an autopilot says |
//! | [`outgoing`] | what a companion says |
//! | [`sik`] | the units of a SiK radio |
//! | `signing` | with the feature `mavlink-signing`, who has the key |
//!
//! A number that no enum has, and a message that the table has not, cost nothing but their bytes. MAVLink 1 is not read; an autopilot
//! that begins with it changes to MAVLink 2 as soon as it has heard a frame of that.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

pub mod frame;
pub mod incoming;
pub mod outgoing;
pub mod parser;
#[cfg(feature = "mavlink-signing")]
pub mod signing;
pub mod sik;
pub mod table;
