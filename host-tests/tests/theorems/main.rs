//! One relay and one interferer: Lemmas 1 and 2, Corollary 1, Theorems 1 to 3 and one relay aside against brute force in f64.
//!
//! `COUNT` and `SEED` in the environment take other scenarios.

mod aside;
mod brute;
mod known;
mod lemmas;
mod optima;
mod roomy;
mod scene;

/// How far below the best SIR a place may be, relative.
const ALLOWED: f64 = 1e-4;

/// The scenarios of each theorem's test.
fn count() -> usize {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(100_000)
}
