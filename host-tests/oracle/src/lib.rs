//! Test oracles for placements. Independent f64 optimisers, values of an independent program, and random scenarios.
//!
//! The optimisers share no formula with `uav-relay`; the scenarios are weighted toward where formulas break. No product depends
//! on this crate.
//!
//! | module | content |
//! | --- | --- |
//! | [`mod@reference`] | reference optimisers |
//! | [`cases`] | values of an independent program, as data |
//! | [`random`] | random scenarios |
//! | [`mission`] | the mission that relays fly for a reference link |

pub mod cases;
pub mod mission;
pub mod random;
pub mod reference;
