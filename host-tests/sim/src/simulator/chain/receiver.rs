//! Who hears a frame.

/// A relay or a station, counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Receiver {
    Relay(usize),
    Ground(usize),
}
