//! An f64 judge of plans against interference that is known by its distribution alone.
//!
//! Nothing of `uav-relay` is used. The expected SIR of a hop is its received signal power times Upsilon = E[1/I] where it
//! ends; [`upsilon_by_mgf`] finds Upsilon for any distribution, and [`StochasticLink`] judges whole chains, by the paper's
//! fixed-step algorithms and by brute force.

mod backward;
mod equals;
mod link;
mod own;
mod single;
mod upsilon;

pub use backward::Backward;
pub use link::StochasticLink;
pub use single::Single;
pub use upsilon::upsilon_by_mgf;
