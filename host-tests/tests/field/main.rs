//! Stochastic interference: Upsilon's table and closed form, its estimation, and reference chains.
//!
//! Random tests use the environment variable `SEED` (1 if unset), which each prints.

mod chains;
mod closed_forms;
mod estimation;
mod samples;
mod table;

fn off(got: f64, want: f64) -> f64 {
    (got / want - 1.0).abs()
}
