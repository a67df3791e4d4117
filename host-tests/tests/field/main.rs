//! Stochastic interference judged from outside: the table of Upsilon, its closed form against the integral it stands for,
//! its estimation from samples, and the f64 judge of whole chains against values of a separate program.
//!
//! Random tests draw from the environment variable `SEED` (1 if unset), which each of them prints.

mod chains;
mod closed_forms;
mod estimation;
mod samples;
mod table;

/// The relative difference of `got` from `want`.
fn off(got: f64, want: f64) -> f64 {
    (got / want - 1.0).abs()
}
