//! Interface to the firmware: bytes in, frames, events and setpoints out. Does no input or output.
//!
//! | file | content |
//! | --- | --- |
//! | `endurance` | endurance of the drone, and the departure that it causes |
//! | `facade` | relay: bytes and time in, frames and events out; records and uploads across a reboot; getters, and inputs besides bytes |
//! | `frames` | frames to and from the protocol |

mod endurance;
mod facade;
mod frames;
#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;

pub use facade::Relay;

/// Serial port or radio of a relay, through which frames are received and sent.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Port {
    /// Link to the neighbour toward the transmitter, with [`Wiring::Pair`](crate::Wiring::Pair).
    Upstream,
    /// Link to the neighbour toward the receiver, with [`Wiring::Pair`](crate::Wiring::Pair).
    Downstream,
    /// Shared channel, with [`Wiring::Shared`](crate::Wiring::Shared).
    Shared,
}

/// Frame to send: the first `len` bytes of the buffer, through `port`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmit {
    /// Port (serial link or radio) through which the frame must be sent.
    pub port: Port,
    /// Length in bytes, delimiter included; at most [`MAX_FRAME`](crate::wire::frame::MAX_FRAME).
    pub len: usize,
}
