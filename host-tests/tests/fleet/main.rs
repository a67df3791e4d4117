//! Number of relays for a target, compared with independent counts. `COUNT` and `SEED` select scenarios.

mod field;
mod interferer;
mod known;

/// Relative loss of a target by f32 rounding: half a step of x is 6e-8 D, over an altitude of 0.002 D.
pub(crate) const ROUNDING: f64 = 1e-4;

pub(crate) fn round(value: f64) -> f64 {
    f64::from(value as f32)
}
