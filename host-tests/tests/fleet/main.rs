//! How many relays a target needs: against counts that know nothing of the crate's reaches and ranges.
//!
//! `COUNT` and `SEED` in the environment take other scenarios.

mod field;
mod interferer;
mod known;

/// What rounding to f32 may take from a target, relative: half a step of x next to Rx is 6e-8 D, over the lowest altitude here,
/// 0.002 D; and along hundreds of hops each place is rounded toward its sender.
pub(crate) const ROUNDING: f64 = 1e-4;

pub(crate) fn count(default: usize) -> usize {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(default)
}

pub(crate) fn round(value: f64) -> f64 {
    f64::from(value as f32)
}
