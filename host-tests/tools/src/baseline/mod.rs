//! Baseline placements that ignore the interferer, for comparison with the crate's methods.
//!
//! | file | positions of the relays |
//! | --- | --- |
//! | [`random`] | uniformly random, in order; mean over many draws |
//! | [`blind`] | maximise the weakest received signal, without interference |
//! | [`equal`] | equal spacing |
//!
//! Each is scored in f64 by [`Scene`](uav_relay_scenario::scene::Scene): the SIR of the worst hop.

pub mod blind;
pub mod equal;
pub mod random;
