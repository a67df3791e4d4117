//! Places, sides and altitudes together: the chain whose worst hop is as good as it can be, by differential dynamic programming.
//!
//! For a target gamma every hop but the last is as long as it may be, and so each relay's place follows from that of the one before it
//! and from two numbers that are to be chosen within its room: where it flies across the line. What is to be made as large as can be
//! is the slack at the end, by how much the chain overshoots Rx; and gamma is raised until that is zero.
//!
//! | file | one idea |
//! | --- | --- |
//! | `hop` | how a hop's end moves with everything it depends on, with noise and without, and which coordinate of it follows from the other two |
//! | `outlook` | what the rest of the chain is worth, as the relay before it sees it |
//! | `policy` | a relay's step, and how it follows what changed before it |
//! | `site`, `weigh` | one relay and the hop into it: one relay's worth of the pass forward, and of the pass back; the room of a relay across the line |
//! | `ascent` | how far the target is raised, and what is taken of a step |
//! | `starts` | where an ascent begins, and at which target |
//! | [`solver`] | a whole chain without a message |

mod ascent;
mod hop;
mod outlook;
mod policy;
mod site;
pub mod solver;
mod starts;
mod weigh;

pub use site::Room;
pub use solver::{Seat, Solver};

/// The most relays of a chain that relays solve by the joint method; without the feature `altitude` they solve none.
pub const MOST_SOLVED: usize = if cfg!(feature = "altitude") { 100 } else { 0 };
