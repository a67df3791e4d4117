//! Placement algorithms on board: pure functions of the mission, without state.
//!
//! | purpose | files |
//! | --- | --- |
//! | reach of one hop for a target SIR | [`spacing`] toward Rx, [`retreat`] toward Tx in a field |
//! | the same with a way back | [`reverse`] |
//! | pass of targets at given altitudes | [`ladder`], [`pass`](mod@pass); [`search`] selects the next targets; [`plan`] runs all of it for a whole chain without messages |
//! | joint optimum of x, y and altitude | [`joint`] |
//! | one relay between its neighbours | [`local`]: Algorithm 2 |
//!
//! The node calls the same functions, one hop per relay.

pub mod from_rx;
pub mod joint;
pub mod ladder;
pub mod local;
pub mod noisy_hop;
pub mod pass;
pub mod plan;
pub mod retreat;
pub mod reverse;
pub mod search;
pub mod spacing;

/// List with one number for each target SIR of a pass along the chain. An example is a relay's farthest x for each
/// target, m.
pub type PerTarget = heapless::Vec<f32, { ladder::TARGETS }>;
