//! Places, sides and altitudes together: the chain whose worst hop is as good as it can be, by differential dynamic programming.
//!
//! For a target gamma every hop but the last is as long as it may be, and so each relay's place follows from that of the one before it
//! and from two numbers that are to be chosen within its room: where it flies across the line. What is to be made as large as can be
//! is the slack at the end, by how much the chain overshoots Rx; and gamma is raised until that is zero.
//!
//! | file | one idea |
//! | --- | --- |
//! | `axis` | which coordinate of a place follows from the other two |
//! | `hop` | how a hop's end moves with everything it depends on |
//! | `tangent` | with noise, a hop that looks like one without |
//! | `outlook` | what the rest of the chain is worth, as the relay before it sees it |
//! | `policy` | a relay's step, and how it follows what changed before it |
//! | `room` | where a relay may fly across the line |
//! | `site`, `weigh` | one relay and the hop into it: one relay's worth of the pass forward, and of the pass back |
//! | `ends` | what the first and the last hop can meet |
//! | `ascent` | how far the target is raised, and what is taken of a step |
//! | `starts`, `seek`, `cells` | where an ascent begins; the target of a chain that does not change; a place in six bytes |
//! | [`solver`] | a whole chain without a message |

mod ascent;
mod axis;
mod cells;
mod ends;
mod hop;
mod outlook;
mod policy;
mod room;
mod seek;
mod site;
pub mod solver;
mod starts;
mod tangent;
mod weigh;

pub use room::Room;
pub use solver::{Seat, Solver};

/// The most relays of a chain that relays solve by the joint method; without the feature `altitude` they solve none.
pub const MOST_SOLVED: usize = if cfg!(feature = "altitude") { 100 } else { 0 };
