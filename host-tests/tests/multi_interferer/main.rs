//! Several interferers judged from outside: the true sum against the reference for one interferer, the fit of the hypothetical
//! one against values of a separate program and against random places, the best chain against brute force and against the
//! reference, the polishing against both, and what placing by the hypothetical interferer costs.
//!
//! Random tests draw from the environment variable `SEED`, which each of them prints.

mod brute;
mod fit;
mod loss;
mod optimum;
mod polish;
mod random_fit;
mod scenes;
mod sum;

/// How far `got` is above `want`, relative.
fn above(got: f64, want: f64) -> f64 {
    got / want - 1.0
}
