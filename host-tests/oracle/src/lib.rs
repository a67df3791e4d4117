//! Test oracles for placements. Independent f64 optimisers, recorded optima, values of an independent program, random scenarios.
//!
//! The optimisers share no formula with `uav-relay`. The random scenarios are often close to the values at which
//! formulas break. No product depends on this crate.
//!
//! | module | content |
//! | --- | --- |
//! | [`mod@reference`] | reference optimisers |
//! | [`recorded`] | recorded optima of the joint problem |
//! | [`cases`] | values of an independent program, as data |
//! | [`random`] | random scenarios |
//! | [`mission`] | the mission that relays fly for a reference link |

pub mod cases;
pub mod mission;
pub mod random;
pub mod recorded;
pub mod reference;
