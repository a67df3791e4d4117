//! A whole chain by the joint method, without a message: what every relay that holds the mission works out by itself.
//!
//! Differential dynamic programming keeps a policy for every relay between the pass back and the pass forward. Here a relay takes six
//! bytes: the chain is cut into segments, of each of which only the outlook at its end is kept, and the policies of one segment are
//! worked out again when the pass forward comes to it.
//!
//! A start is given up as soon as it is about to end no higher than the best one, or its target has left the chain behind; all others are
//! once a chain meets what its first or last hop can have.
//!
//! | file | one idea |
//! | --- | --- |
//! | `state` | what a solver keeps, and one portion of its work |
//! | `work` | what it is at, and what for |
//! | `passes` | the pass back and the pass forward of an ascent, a pass that changes nothing, and the rules of the sweep |
//! | `judge` | what comes after a target is found: the next start, or the polish |
//! | `chain` | what the passes have in common; ten relays of a chain; what one brings along |

mod chain;
mod judge;
#[cfg(all(test, feature = "altitude"))]
#[expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test"
)]
mod kept;
mod passes;
mod state;
mod work;

pub use chain::Seat;
pub use state::Solver;
