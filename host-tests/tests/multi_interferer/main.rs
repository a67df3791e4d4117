//! Several interferers. Sum, hypothetical interferer, best chain and polishing, compared with references.
//!
//! Random tests use the environment variable `SEED`, which each prints.

mod brute;
mod fit;
mod loss;
mod optimum;
mod polish;
mod random_fit;
mod scenes;
mod sum;

/// Returns the relative excess of `got` over `want`: 0 if both are equal.
fn above(got: f64, want: f64) -> f64 {
    got / want - 1.0
}
