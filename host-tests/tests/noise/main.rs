//! Receivers with noise of their own: SINR in place of SIR, against judges in f64 that know received powers alone.
//!
//! `COUNT` in the environment takes that many random chains or scenes in place of those of CI, `SEED` others.

mod chains;
mod field;
mod reach;
mod space;

use uav_relay::{Mission, Profile};

/// `COUNT`, or so many.
fn count(few: usize) -> usize {
    std::env::var("COUNT").map_or(few, |text| text.parse().unwrap())
}

/// What relay `index` holds.
fn profile_of(mission: &Mission, own: &[(u16, Profile)], index: u16) -> Profile {
    own.iter()
        .find(|(of, _)| *of == index)
        .map_or(mission.config().common, |(_, profile)| *profile)
}
