//! Placement maths for a chain at given altitudes: pure functions of the mission, no state beyond what they are handed.
//!
//! [`spacing`] answers how far one hop reaches for a target SIR; [`ladder`] is the set of targets that one sweep tries;
//! [`verdict`] closes a chain at its tail; [`search`] narrows the targets from one sweep to the next; [`plan`] runs all
//! of it for a whole chain without a message. The node walks the same functions one hop a relay.

pub mod climb;
pub mod coarse;
pub mod coded;
pub mod ladder;
pub mod levels;
pub mod local;
pub mod pass;
pub mod plan;
pub mod promise;
pub mod retreat;
pub mod scan;
pub mod search;
pub mod single;
pub mod spacing;
pub mod verdict;
pub mod wave;

/// Up to one number a target: reaches, slacks or the targets themselves.
pub type PerTarget = heapless::Vec<f32, { ladder::TARGETS }>;
