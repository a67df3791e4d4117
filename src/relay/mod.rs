//! Interface to the firmware. Bytes in, frames, events and setpoints out, without input or output of its own.
//!
//! | file | content |
//! | --- | --- |
//! | `facade` | relay: bytes and time in, frames and events out; records and uploads across a reboot |
//! | `readings` | getters, and inputs besides bytes |
//! | `port` | ports |
//! | `frames` | frames to and from the protocol |

mod facade;
mod frames;
mod port;
mod readings;
#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;

pub use facade::Relay;
pub use port::{Port, Transmit};
