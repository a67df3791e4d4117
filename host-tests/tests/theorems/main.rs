//! Single relay and interferer: Lemmas 1 and 2, Corollary 1, Theorems 1 to 3 and lateral room, compared with brute force.
//!
//! The environment variables `COUNT` and `SEED` select other scenarios.

mod aside;
mod brute;
mod known;
mod lemmas;
mod optima;
mod roomy;
mod scene;

/// Largest relative shortfall from the best SIR.
const ALLOWED: f64 = 1e-4;

fn count() -> usize {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(100_000)
}
