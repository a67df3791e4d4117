//! Reference f64 optimisers of placements that share no formula with `uav-relay`.
//!
//! The crate solves a quadratic for the reach of a node. Here the SIR of a hop is computed from received powers, and derived
//! quantities (how far a node may be, the best target of a chain) are found by bisecting that function. A mistake in the crate's
//! algebra therefore cannot repeat itself here.
//!
//! The only analysis used is the *number* of turning points. With d >= 0 the distance beyond the sender, a hop's SIR is a
//! quotient of two quadratics with equal leading coefficients, so its derivative has the sign of a quadratic in d, and the
//! product of that quadratic's roots is -(height difference)^2 <= 0: at most one turning point is beyond the sender. So the SIR
//! only falls, only rises, forms one valley (interferer ahead) or one hill (interferer behind), and bisection is safe.
//!
//! With noise nu = N eta / P the derivative has the sign of u d^2 - (u^2 + a^2 - b^2) d - u b^2 - nu d s^2, s = (d - u)^2 + a^2:
//! the interferer is u ahead and a sideways, and b is the difference in height. Over d that is concave for u > 0, so there are at
//! most two turning points, a valley and then a hill; for u < 0 each of its terms falls, so there is at most one.
//!
//! No relay is behind its predecessor (0 <= `x_1` <= ... <= `x_N` <= D). Only `Link::optimum_apart` and the brute-force search keep
//! the minimum separation.
//!
//! - `Link::feasible` extends the chain greedily, as the on-board protocol does. It is exact when all altitudes are equal.
//! - `Link::placement` keeps the whole set of positions each node can reach. It is exact for any altitudes, which the greedy
//!   chain is not: close to the interferer a climb may be impossible that was possible earlier.
//! - `Link::optimum_apart` does the same with the minimum separation.
//!
//! [`mod@joint`] evaluates chains that also choose altitudes and lateral positions.
//!
//! Cost: a reach takes about 60 SIR evaluations if the node may start where the search starts, at most about 150 if a maximum has
//! to be found first. An optimum takes about 50 to 60 chains.

mod hop;
pub mod joint;
mod link;
mod optimum;
mod reach;
mod search;
mod sets;
mod sirs;
pub mod stochastic;

pub use link::{Link, Relay, path_loss_factor};
