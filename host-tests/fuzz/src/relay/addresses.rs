//! Sender and port of a frame to a relay.

use uav_relay::wire::frame::Header;
use uav_relay::{Port, Wiring};

use super::super::watch::NETWORK;

/// Returns header and port of a frame from a neighbour of relay `index`.
///
/// `side` is 0 upstream, 1 downstream. On a shared channel both sides use the same port.
pub(super) const fn from(index: u16, side: usize, wiring: Wiring) -> (Header, Port) {
    let (sender, port) = if side == 1 {
        (index + 1, Port::Downstream)
    } else {
        (index - 1, Port::Upstream)
    };
    let header = Header {
        network: NETWORK,
        sender,
        destination: index,
        counter: 0,
    };
    match wiring {
        Wiring::Pair => (header, port),
        Wiring::Shared => (header, Port::Shared),
    }
}

/// Returns the number of a node farther away from relay `index` than its neighbour at `side`.
///
/// `side` is 0 upstream, 1 downstream. The node is `more` numbers farther away than the neighbour; upstream the result
/// is at least 0.
pub(super) const fn far(index: u16, side: usize, more: u8) -> u16 {
    let distance = 1 + more as u16;
    if side == 1 {
        index + distance
    } else {
        index.saturating_sub(distance)
    }
}

pub(super) const fn port(byte: u8) -> Port {
    match byte % 3 {
        0 => Port::Upstream,
        1 => Port::Downstream,
        _ => Port::Shared,
    }
}
