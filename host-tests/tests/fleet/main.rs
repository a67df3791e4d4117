//! Number of relays for a target, compared with independent counts.
//!
//! The environment variables `COUNT` and `SEED` select other scenarios.

mod field;
mod interferer;
mod known;

/// Relative loss of a target by f32 rounding.
///
/// Half a step of x next to Rx is 6e-8 D, over the lowest altitude of 0.002 D; each position is rounded toward its sender.
pub(crate) const ROUNDING: f64 = 1e-4;

pub(crate) fn count(default: usize) -> usize {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(default)
}

pub(crate) fn round(value: f64) -> f64 {
    f64::from(value as f32)
}
