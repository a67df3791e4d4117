//! What a firmware calls: bytes in, bytes and setpoints out, and no input or output of its own.
//!
//! | file | one idea |
//! | --- | --- |
//! | `facade` | bytes and time into a relay, frames and events out of it |
//! | `told` | what the firmware tells it of the world |
//! | `readings` | what the firmware may read of it |
//! | `records` | what it has promised, over a reboot |
//! | `uploads` | a new mission in flight |
//! | `port` | where frames come in and go out |
//! | `incoming`, `signed` | a frame, without and with a tag, to the node and from it |

mod facade;
mod incoming;
mod port;
mod readings;
mod records;
#[cfg(feature = "auth")]
pub(crate) mod signed;
#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;
mod told;
#[cfg(feature = "upload")]
mod uploads;

pub use facade::Relay;
pub use port::{Port, Transmit};
