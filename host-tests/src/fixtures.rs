//! What many tests begin with: the paper's chain, and one relay of a chain.

use uav_relay::{Identity, Instant, Mission, MissionConfig, Relay, Settings, ViewRecord};
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::reference::Link;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;

/// The network of [`relay`].
pub const NETWORK: u16 = 7;

/// The paper's chain of `relays` as the judges know it: with their path losses, and no least separation.
///
/// # Panics
/// For a number of relays that no mission has.
pub fn mission(relays: u16) -> Mission {
    of_link(&Link::paper(usize::from(relays)), 1e-4).unwrap().0
}

/// The paper's chain of `relays` as a scenario file has it: neighbours are 4 m apart at least.
///
/// # Panics
/// For a number of relays that no mission has.
pub fn paper(relays: u16) -> MissionConfig {
    let (mission, _) = mission::mission(&Scenario::default(), relays, 1e-4).unwrap();
    *mission.config()
}

/// Relay `index` of `mission`, switched on at time 0.
///
/// # Panics
/// Where the mission has no such relay, or it refuses the settings.
pub fn relay(mission: Mission, index: u16, settings: Settings) -> Relay {
    let identity = Identity {
        network: NETWORK,
        index,
    };
    Relay::new(mission, identity, settings, u32::from(index), Instant::ZERO).unwrap()
}

/// What a relay that was loaded with the mission of digest `base` has said when all know that view `number` is agreed on, of `relays`
/// relays and proposed by relay 1; `member` tells whether it is one of them.
///
/// # Panics
/// For what no relay can have said.
pub fn voted(base: u16, relays: u16, number: u32, member: bool) -> ViewRecord {
    let id = (number << 10 | 1).to_le_bytes();
    let relays = relays.to_le_bytes();
    // Promised, and nothing accepted since: as the format has it, no proposal, and the view agreed on.
    let mut bytes = [&[1][..], &base.to_le_bytes(), &id, &relays].concat();
    bytes.push(u8::from(member));
    bytes.extend([&id[..], &[0], &[0; 4], &id, &relays].concat());
    bytes.resize(ViewRecord::LENGTH, 0);
    ViewRecord::from_bytes(&bytes).unwrap()
}
