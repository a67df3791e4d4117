//! What placements are judged by: f64 optimisers that share no formula with `uav-relay`, values of an independent program, and random
//! scenarios weighted toward where formulas break. No product depends on it.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`mod@reference`] | the judges |
//! | [`cases`] | values of an independent program, as data |
//! | [`random`] | random scenarios |
//! | [`mission`] | from a judge's link to the mission that relays fly |

pub mod cases;
pub mod mission;
pub mod random;
pub mod reference;
