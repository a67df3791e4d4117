//! Solver of a whole chain by the joint method, from the mission alone and without messages.
//!
//! Differential dynamic programming stores a policy for every relay between the backward and the forward pass. To need only six
//! bytes per relay, the chain is cut into segments: only the value function at the end of each is stored, and the policies of a
//! segment are computed again in the forward pass.
//!
//! A start is dropped as soon as it will end no higher than the best one, or has diverged. The remaining starts are skipped once
//! a chain meets the ceiling of its first or last hop.
//!
//! | file | content |
//! | --- | --- |
//! | `state` | the state of a solver, and one portion of its work |
//! | `work` | the current work and its purpose |
//! | `passes` | the backward and the forward pass of an ascent, a pass without changes, and the sweep's rules |
//! | `judge` | the steps after a target is found: the next start, or the polish |
//! | `chain` | data shared by the passes; a segment of the chain; the profile of one relay |

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
