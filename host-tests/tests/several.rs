//! Several interferers judged from outside: the true sum against the reference for one interferer, the fit of the hypothetical
//! one against values of a separate program and against random places, the best chain against brute force and against the
//! reference, the polishing against both, and what placing by the hypothetical interferer costs.
//!
//! Random tests draw from the environment variable `SEED`, which each of them prints.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::float_cmp,
    missing_docs
)]

#[path = "several/brute.rs"]
mod brute;
#[path = "several/fit.rs"]
mod fit;
#[path = "several/loss.rs"]
mod loss;
#[path = "several/optimum.rs"]
mod optimum;
#[path = "several/polish.rs"]
mod polish;
#[path = "several/random_fit.rs"]
mod random_fit;
#[path = "several/scenes.rs"]
mod scenes;
#[path = "several/sum.rs"]
mod sum;

/// How far `got` is above `want`, relative.
fn above(got: f64, want: f64) -> f64 {
    got / want - 1.0
}
