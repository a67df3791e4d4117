//! What a firmware calls: bytes in, bytes and setpoints out, and no input or output of its own.
//!
//! | file | one idea |
//! | --- | --- |
//! | `facade` | what goes into a relay and comes out of it |
//! | `readings` | what the firmware may read of it |
//! | `uploads` | a new mission in flight |
//! | `port` | where frames come in and go out |
//! | `incoming`, `signed` | a frame, without and with a tag, to the node and from it |

mod facade;
mod incoming;
mod port;
mod readings;
#[cfg(feature = "auth")]
pub(crate) mod signed;
#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;
#[cfg(feature = "upload")]
mod uploads;

pub use facade::Relay;
pub use port::{Port, Transmit};
