//! Several interferers: chains placed against the true sum of their powers.
//!
//! Relays know a single interferer. Several are replaced by a hypothetical one
//! ([`hypothetical`](uav_relay_scenario::hypothetical)), which costs some SIR. This cost is found by comparison with
//! the best chain against the true sum: [`optimum`] for relays at one fixed altitude (exact), [`best_common_altitude`]
//! for a common altitude to be chosen, [`polish`] for relays with different altitudes or lateral positions.
//!
//! All values are f64 in SI units. x is the distance from Tx (0) toward Rx (D), and y the offset to the right as seen
//! from Tx. SIRs are linear. The x of the relays never fall from Tx to Rx. All chains except polished ones have y = 0.

mod optimum;
mod polish;

pub use optimum::{Chain, best_common_altitude, optimum};
pub use polish::{Polished, polish};
