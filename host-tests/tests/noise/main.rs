//! Receiver noise: SINR in place of SIR, compared with references. `COUNT` and `SEED` select chains or scenes.

mod chains;
mod field;
mod reach;
mod space;

use uav_relay::{Mission, Profile};

fn count(few: usize) -> usize {
    std::env::var("COUNT").map_or(few, |text| text.parse().unwrap())
}

fn profile_of(mission: &Mission, own: &[(u16, Profile)], index: u16) -> Profile {
    own.iter()
        .find(|(of, _)| *of == index)
        .map_or(mission.config().common, |(_, profile)| *profile)
}
