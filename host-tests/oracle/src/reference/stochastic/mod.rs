//! Reference f64 optimisers for interference known only by its distribution.
//!
//! Independent of `uav-relay`. The expected SIR of a hop is its received signal power times Upsilon = E[1/I] at the receiver.
//! [`upsilon_by_mgf`] computes Upsilon for any distribution, and [`StochasticLink`] evaluates whole chains, by the paper's
//! fixed-step algorithms and by brute force.

mod backward;
mod equals;
mod link;
mod single;
mod upsilon;
mod with_separation;

pub use backward::Backward;
pub use link::StochasticLink;
pub use single::Single;
pub use upsilon::upsilon_by_mgf;
