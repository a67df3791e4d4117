//! Single relay and interferer: lemmas and theorems compared with brute force; `COUNT` and `SEED` select scenarios.

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
