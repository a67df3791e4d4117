//! A mission together with the profile of each relay.

use uav_relay::{Mission, Placement, Profile};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;
use uav_relay_sim::report::hop_sirs;

use super::found::{NoPlan, Plan};

/// Largest number of relays while the number is not yet known.
pub(super) const MOST_RELAYS: u16 = Mission::MAX_RELAYS;

/// A mission, the relays' own profiles and the indices of relays with a fixed altitude.
pub(super) struct ProfiledMission {
    pub(super) mission: Mission,
    pub(super) own: Vec<(u16, Profile)>,
    pub(super) held: Vec<u16>,
}

impl ProfiledMission {
    pub(super) fn new(scenario: &Scenario, relays: u16, tolerance: f64) -> Result<Self, NoPlan> {
        let (mission, own) = mission::mission(scenario, relays, tolerance)?;
        Ok(Self {
            mission,
            own,
            held: mission::held(scenario, relays),
        })
    }

    pub(super) fn profile(&self, index: u16) -> Profile {
        self.own
            .iter()
            .find(|(at, _)| *at == index)
            .map_or(self.mission.config().common, |(_, profile)| *profile)
    }

    pub(super) fn level(&self) -> bool {
        let common = self.mission.config().common;
        self.own
            .iter()
            .all(|(_, own)| !((own.altitude_m - common.altitude_m).abs() > 0.0))
    }

    /// Returns the plan with these positions; its SIRs are computed by the crate's own formulas.
    pub(super) fn plan(self, places: &[Placement], how: &'static str, proven: bool) -> Plan {
        let held: Vec<(Placement, Profile)> = (1..)
            .zip(places)
            .map(|(index, place)| {
                let profile = Profile {
                    altitude_m: place.altitude_m,
                    ..self.profile(index)
                };
                (*place, profile)
            })
            .collect();
        Plan {
            mission: self.mission,
            sirs: hop_sirs(&self.mission, &held),
            places: held,
            how,
            proven,
            theorem: None,
            most: None,
            fitted: None,
        }
    }
}

/// Returns true if there is no least separation, or `is_as_good` says that removing it gains nothing.
pub(super) fn is_free(scenario: &Scenario, is_as_good: impl Fn(&Scenario) -> Option<bool>) -> bool {
    let free = Scenario {
        min_separation_m: 0.0,
        ..scenario.clone()
    };
    !(scenario.min_separation_m > 0.0) || is_as_good(&free) == Some(true)
}
