//! What a firmware calls: bytes in, bytes and setpoints out, and no input or output of its own.
//!
//! | file | one idea |
//! | --- | --- |
//! | `facade` | bytes and time into a relay, frames and events out of it; records and uploads over a reboot |
//! | `readings` | what the firmware may read of it, and what it tells it of the world |
//! | `port` | where frames come in and go out |
//! | `frames` | frames to the node and from it |

mod facade;
mod frames;
mod port;
mod readings;
#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;

pub use facade::Relay;
pub use port::{Port, Transmit};
