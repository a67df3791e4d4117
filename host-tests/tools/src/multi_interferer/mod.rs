//! Several interferers at once: the true sum of what they do, the one hypothetical interferer that comes closest to it, and
//! chains that are placed against the true sum.
//!
//! The relays know one interferer. Several are replaced by one for them ([`hypothetical`](uav_relay_scenario::hypothetical)), which is an approximation; how
//! much SIR it costs is known only by comparing with the best chain against the true sum: [`optimum`] for relays that hold
//! one altitude (exact), [`best_common_altitude`] where that altitude may be chosen, [`polish`] for relays that differ, and for
//! places to the side.
//!
//! Everything is f64, in SI units, with x along the ground from Tx (0) to Rx (D), y to the right of it; SIRs are linear. As
//! everywhere, a relay never stands behind the one before it. All chains but polished ones stand above the line (y = 0).

mod altitude;
mod crossing;
mod line;
mod optimum;
mod polish;
mod spans;
mod stages;

pub use altitude::best_common_altitude;
pub use optimum::{Chain, optimum};
pub use polish::{Polished, polish};
