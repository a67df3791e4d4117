//! Single relay and interferer: theorems compared with brute force in `COUNT` scenes from `SEED`.

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
