//! What the firmware is told, and what has been counted.

use crate::event::Pending;
use crate::stats::Stats;

/// What the firmware is told.
#[derive(Clone, Debug, Default)]
pub(super) struct Telemetry {
    pub(super) events: Pending,
    pub(super) stats: Stats,
    /// Whether a lapse of the lease, and a refusal, have been told since a view was agreed on.
    pub(super) told_lapsed: bool,
    pub(super) told_refused: bool,
}
