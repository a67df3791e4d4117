//! Several interferers: chains placed against the true sum of their powers.
//!
//! Relays know a single interferer; several are replaced by a hypothetical one
//! ([`hypothetical`](uav_relay_scenario::hypothetical)). The SIR that this approximation costs is found by comparison with the
//! best chain against the true sum: [`optimum`] for relays at one fixed altitude (exact), [`best_common_altitude`] for a common
//! altitude that may be chosen, [`polish`] for relays with different altitudes or lateral room.
//!
//! All values are f64 in SI units, x along the ground from Tx (0) to Rx (D), y to the right; SIRs are linear. No relay is behind
//! its predecessor. All chains except polished ones are above the line (y = 0).

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
