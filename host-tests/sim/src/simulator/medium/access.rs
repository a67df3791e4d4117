//! How radios come by a shared channel, and what that takes.
//!
//! The numbers are those of IEEE 802.15.4-2006 at 250 kbit/s (unslotted CSMA-CA, 6.4 and 7.5.1.4), kept in bytes, so that they scale
//! with the data rate: a symbol is half a byte there.

/// How a shared channel is simulated.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Access {
    /// Every sender has a line of its own: no frame is in another's way.
    #[default]
    Ideal,
    /// One half-duplex channel. A radio sends at once when it is not sending already.
    Aloha,
    /// One half-duplex channel. A radio waits a random number of slots, listens, and sends if it hears nobody.
    Csma,
}

/// What a radio sends before a frame, bytes: preamble, start of frame, length (SHR and PHR).
pub const HEADER: usize = 6;

/// What a radio takes to turn from receiving to sending, in bytes: `aTurnaroundTime`, 12 symbols. Until then nobody hears it, and it
/// hears nobody.
pub const TURNAROUND: usize = 6;

/// What a frame costs on the air beside its bytes, in bytes.
pub const OVERHEAD: usize = HEADER + TURNAROUND;

/// A slot of the back-off, in bytes: `aUnitBackoffPeriod`, 20 symbols, so that who senses a slot later hears who has begun.
pub const SLOT: usize = 10;

/// The first wait of a frame is 0 to 2^3 - 1 slots: `macMinBE`.
pub const LEAST_EXPONENT: u32 = 3;

/// With each busy channel the bound doubles, up to 2^5 - 1 slots: `macMaxBE`. A frame is tried until the channel is free: it is the queue
/// that gives up.
pub const MOST_EXPONENT: u32 = 5;

/// Frames that a radio holds, the one that it sends among them. When it is full the newest is dropped, as a modem does with what
/// comes in by its serial port.
pub const QUEUE: usize = 4;
