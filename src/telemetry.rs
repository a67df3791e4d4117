//! Telemetry: the state of every relay, passed along the chain to a ground station.

use crate::flight::autopilot::state::State;
use crate::guard::HoldReason;
use crate::node::round::state::Phase;
use crate::place::Placement;
use crate::time::Instant;

/// State that a relay has reported, and that has reached the ground station through the chain.
///
/// Pairs have the neighbour toward Tx first, then the one toward Rx.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Report {
    /// Number of the relay in the mission, 1..=N.
    pub relay: u16,
    /// Time of the state, on the clock of the station.
    pub at: Instant,
    /// Position of the drone by its autopilot; `None` if it has none.
    pub position: Option<Placement>,
    /// Setpoint of the drone.
    pub setpoint: Option<Placement>,
    /// Position on which the chain has agreed for this relay.
    pub agreed: Option<Placement>,
    /// Phase of the relay's protocol.
    pub phase: Phase,
    /// True while the relay is passive because another node has its number.
    pub is_passive: bool,
    /// Control state of the drone; `None` for a relay without an autopilot link.
    pub control: Option<State>,
    /// Reasons to hold the position, because of each neighbour.
    pub hold_reasons: [Option<HoldReason>; 2],
    /// Numbers of the neighbours in the relay's view.
    pub neighbours: [Option<u16>; 2],
    /// True for a neighbour that this relay does not receive now.
    pub silent: [bool; 2],
    /// Measured interference of the hop's receiver at this relay, W; `None` if not measured.
    pub interference_w: Option<f32>,
    /// Version of the mission that the relay flies.
    pub version: u16,
}
