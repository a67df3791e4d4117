//! Number of relays for a target, compared with independent counts. `COUNT` and `SEED` select scenarios.

mod field;
mod interferer;
mod known;

use host_tests::placing::xs;
use uav_relay::{Mission, Profile};
use uav_relay_tools::fewest;

/// Relative loss of SIR that is tolerated because relays' positions are rounded to f32.
pub(crate) const ROUNDING: f64 = 1e-4;

pub(crate) fn round(value: f64) -> f64 {
    f64::from(value as f32)
}

/// Returns x, m along the line from Tx to Rx, of `relays` relays that meet the SIR `target`.
pub(crate) fn chain(
    mission: &Mission,
    relays: u16,
    target: f64,
    profile_of: impl Fn(u16) -> Profile,
) -> Vec<f64> {
    let mission = mission.with_relays(relays).unwrap();
    let places = fewest::places(&mission, target as f32, profile_of);
    xs(&places.unwrap_or_else(|| panic!("{target} {mission:?}")))
}
