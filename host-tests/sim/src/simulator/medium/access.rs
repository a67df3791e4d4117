//! Channel access of the radios and its timing.
//!
//! Values of IEEE 802.15.4-2006 at 250 kbit/s (unslotted CSMA-CA, 6.4 and 7.5.1.4) in bytes, so that they scale with the data
//! rate: a symbol is half a byte.

/// Access method of a shared channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Access {
    /// Separate line per sender: no collisions.
    #[default]
    Ideal,
    /// Half-duplex channel; a radio sends at once unless it is already sending.
    Aloha,
    /// Half-duplex channel; a radio waits a random time and sends if the channel is free.
    Csma,
}

/// Bytes sent before a frame: preamble, start of frame, length (SHR and PHR).
pub const HEADER: usize = 6;

/// Turnaround from receiving to sending, in bytes: `aTurnaroundTime`, 12 symbols. The radio neither sends nor receives meanwhile.
pub const TURNAROUND: usize = 6;

/// Overhead of a frame on the air, bytes.
pub const OVERHEAD: usize = HEADER + TURNAROUND;

/// Length of a back-off slot, bytes: `aUnitBackoffPeriod`, 20 symbols. It is longer than the turnaround, so that later slots sense
/// the sender.
pub const SLOT: usize = 10;

/// Initial back-off exponent, `macMinBE`: the first wait is 0 to 2^3 - 1 slots.
pub const LEAST_EXPONENT: u32 = 3;

/// Largest back-off exponent, `macMaxBE`: each busy channel doubles the bound, up to 2^5 - 1 slots. Retries are unlimited.
pub const MOST_EXPONENT: u32 = 5;

/// Frames that a radio holds, including the one being sent. A full queue drops the newest frame, as modems do.
pub const QUEUE: usize = 4;
