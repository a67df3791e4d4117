//! An f64 judge of placements that shares no formula with `uav-relay`.
//!
//! The crate solves a quadratic for the reach of a node. Here nothing is solved: the SIR of a hop is computed from received
//! powers, and whatever is asked about it (how far a node may stand, the best target of a chain) is found by bisecting that
//! function. A slip in the crate's algebra therefore cannot repeat itself here.
//!
//! The only analysis used is the *number* of turning points. With d >= 0 the distance past the sender, a hop's SIR is a
//! quotient of two quadratics with equal leading coefficients, so its derivative has the sign of a quadratic in d, and the
//! product of that quadratic's roots is -(height difference)^2 <= 0: at most one turning point lies beyond the sender. So the
//! SIR only falls, only rises, forms one valley (interferer ahead) or one hill (interferer behind), and bisection is safe.
//!
//! With noise nu = N eta / P it has the sign of u d^2 - (u^2 + a^2 - b^2) d - u b^2 - nu d s^2, s = (d - u)^2 + a^2, where u is how
//! far the interferer is ahead, a how far aside, b the difference in height. Over d that is concave for u > 0, so there are at most two
//! turning points, a valley and then a hill; for u < 0 each of its terms falls, so there is at most one.
//!
//! Order of travel: a relay never stands behind the one before it (0 <= `x_1` <= ... <= `x_N` <= D). The least separation is
//! carried for the tests that check it, and ignored by every search here but that of [`joint`].
//!
//! - `Link::feasible` extends the chain greedily, as the on-board protocol does. It is exact when all altitudes are equal.
//! - `Link::placement` keeps the whole set of places each node can reach. It is exact for any altitudes, which the greedy
//!   chain is not: close to the interferer a climb may be impossible that was possible earlier.
//! - [`joint::optimum`] chooses altitudes and offsets to the side too. It is a numerical search: no proof, and it does solve
//!   quadratics on the way, but what it reports is the SIR of the places it found.
//!
//! Cost: a reach takes about 60 SIR evaluations when the node may start from where the search starts, at most about 150 when
//! a hilltop has to be found first. An optimum takes about 50 to 60 chains.

mod hop;
pub mod joint;
mod link;
mod optimum;
mod reach;
mod search;
mod sets;
mod sirs;
pub mod stochastic;

pub use link::{Link, Station, path_loss_factor};
