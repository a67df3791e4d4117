//! Reference f64 optimisers of placements that share no formula with `uav-relay`.
//!
//! The crate solves a quadratic for the longest hop that meets a target SIR. Here the SIR of a hop is computed from
//! received powers. The longest hop and the best target of a chain are found by bisection. A mistake in the crate's
//! algebra therefore cannot repeat itself here.
//!
//! The only analysis used is the *number* of extrema. Let d >= 0 be the distance beyond the sender. A hop's SIR is a
//! quotient of two quadratics in d with equal leading coefficients, so its derivative has the sign of a quadratic in d.
//! The product of that quadratic's roots is -(height difference)^2 <= 0, so at most one extremum is beyond the sender.
//! The SIR therefore only falls, only rises, has one minimum (interferer ahead) or one maximum (interferer behind), and
//! bisection is safe.
//!
//! With noise nu = N eta / P and s = (d - u)^2 + a^2, the derivative has the sign of u d^2 - (u^2 + a^2 - b^2) d - u
//! b^2 - nu d s^2. Here the interferer is u ahead of the sender and a sideways, and b is the difference in height.
//! Divided by d, this expression is concave for u > 0, so there are at most two extrema, a minimum and then a maximum.
//! For u < 0 each of its terms falls, so there is at most one.
//!
//! No relay is behind its predecessor (0 <= `x_1` <= ... <= `x_N` <= D). Only `Link::optimum_apart` and the brute-force search keep
//! the minimum separation.
//!
//! - `Link::feasible` extends the chain greedily, as the on-board protocol does. It is exact when all altitudes are equal.
//! - `Link::placement` computes the set of all possible positions of each node. It is exact for any altitudes. The
//!   greedy chain is not: a climb may be possible far from the interferer, but no longer close to it.
//! - `Link::optimum_apart` does the same with the minimum separation.
//!
//! [`mod@joint`] evaluates chains that also choose altitudes and lateral positions.
//!
//! Cost: the farthest position of a relay takes about 60 SIR evaluations, at most about 150 if a maximum has to be
//! found first. An optimum takes about 50 to 60 chains.

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
