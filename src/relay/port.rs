//! Where the bytes of a relay come from and go to.

/// Where bytes come from and go to.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Port {
    /// The link toward the transmitter, with [`Wiring::Pair`](crate::Wiring::Pair).
    Upstream,
    /// The link toward the receiver, with [`Wiring::Pair`](crate::Wiring::Pair).
    Downstream,
    /// The one channel, with [`Wiring::Shared`](crate::Wiring::Shared).
    Shared,
}

/// A frame to be sent: the first `len` bytes of the buffer, through `port`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmit {
    /// Where to.
    pub port: Port,
    /// Bytes, the delimiter included; at most [`MAX_FRAME`](crate::wire::frame::MAX_FRAME).
    pub len: usize,
}
