//! Receivers of a frame.

/// Receiving node: a relay or a ground station, from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Receiver {
    Relay(usize),
    Ground(usize),
}
