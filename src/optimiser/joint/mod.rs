//! Joint optimum of x, y and altitude for the worst SIR, by differential dynamic programming.
//!
//! For a target gamma every hop but the last has its maximum length. So each relay's position follows from that of the
//! previous relay and from two free coordinates within the relay's room. The objective is the slack at the end, by
//! which the chain overshoots Rx; gamma is raised until the slack is zero.
//!
//! | file | content |
//! | --- | --- |
//! | `hop` | the reach of a hop with its derivatives, with and without noise, and the choice of the dependent coordinate |
//! | `outlook` | the value function: the slack as a quadratic in a relay's position; a relay's step, and its feedback |
//! | `site` | one relay and the hop to it, in the forward and the backward pass; its permitted offsets and altitudes |
//! | `ascent` | step control: the increase of the target, and the accepted fraction of the step |
//! | `chain` | data shared by both solvers: the chain, a segment of it, the profile of one relay |
//! | `interior` | data in both directions: the interior-point method |
//! | `fitted` | fitted slots: the largest data rate by dynamic programming over small moves |
//! | `starts` | initial chains and initial targets of the ascents |
//! | [`solver`] | the solution of a whole chain without messages |

use crate::features::ALTITUDE;
mod ascent;
mod chain;
pub mod fitted;
mod hop;
mod interior;
mod line;
mod outlook;
mod site;
pub mod solver;
mod starts;

pub use chain::Seat;
pub use site::Room;
pub use solver::Solver;

/// Maximum number of relays for the joint method, which optimises x, y and altitude together. 0 without the feature
/// `altitude`.
pub const MOST_SOLVED: usize = if ALTITUDE { 100 } else { 0 };
