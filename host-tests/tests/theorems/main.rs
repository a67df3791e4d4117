//! Single relay and interferer: theorems compared with brute force in `COUNT` scenes from `SEED`.

mod aside;
mod brute;
mod known;
mod lateral_scene;
mod lemmas;
mod optima;
mod scene;

/// Largest permitted shortfall of an SIR from the best SIR, as a fraction of the best SIR.
const ALLOWED: f64 = 1e-4;
