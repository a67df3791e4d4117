//! Several interferers: chains placed against the true sum of their powers.
//!
//! Relays know a single interferer; several are replaced by a hypothetical one
//! ([`hypothetical`](uav_relay_scenario::hypothetical)). The SIR that this approximation costs is found by comparison with the
//! best chain against the true sum: [`optimum`] for relays at one fixed altitude (exact), [`best_common_altitude`] for a common
//! altitude that may be chosen, [`polish`] for relays with different altitudes or lateral room.
//!
//! All values are f64 in SI units, x along the ground from Tx (0) to Rx (D), y to the right; SIRs are linear. No relay is behind
//! its predecessor. All chains except polished ones are above the line (y = 0).

mod optimum;
mod polish;

pub use optimum::{Chain, best_common_altitude, optimum};
pub use polish::{Polished, polish};
