//! What the methods of the crate are compared with: placements that know nothing of the interferer, scored as they are flown.
//!
//! | file | where the relays stand |
//! | --- | --- |
//! | [`random`] | anywhere, in order: the mean over many draws |
//! | [`blind`] | where every hop would have the best signal if there were no interference |
//! | [`equal`] | at equal distances |
//!
//! All of them are scored by [`Scene`](uav_relay_scenario::scene::Scene), in f64: the SIR of the worst hop at those places.

pub mod blind;
pub mod equal;
pub mod random;
