//! Common fixtures of tests: the paper's chain, and one relay of a chain.

use crate::make;
pub use crate::make::NETWORK;
use uav_relay::{Instant, Mission, MissionConfig, Relay, Settings, ViewRecord, Wiring};
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::reference::Link;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;

/// Returns the mission of the paper's chain with `relays` relays and no minimum separation.
///
/// Its path losses are those of the f64 reference model.
///
/// # Panics
/// No mission has this number of relays.
pub fn mission(relays: u16) -> Mission {
    of_link(&Link::paper(usize::from(relays)), 1e-4).unwrap().0
}

/// Returns the mission of the default scenario file, the paper's chain, with `relays` relays.
///
/// Its minimum separation is 4 m.
///
/// # Panics
/// No mission has this number of relays.
pub fn paper(relays: u16) -> MissionConfig {
    let (mission, _) = mission::mission(&Scenario::default(), relays, 1e-4).unwrap();
    *mission.config()
}

/// Creates relay `index` of `mission`, started at time 0. The index is also its random seed.
///
/// # Panics
/// The mission has no such relay, or the relay rejects the settings.
pub fn relay(mission: Mission, index: u16, settings: Settings) -> Relay {
    let identity = make::identity(index);
    Relay::new(mission, identity, settings, u32::from(index), Instant::ZERO).unwrap()
}

/// Creates relay `index` of `relays` in the paper's scenario, with default settings but the `wiring`.
///
/// # Panics
/// The chain has no such relay.
pub fn wired(relays: u16, index: u16, wiring: Wiring) -> Relay {
    let mission = Mission::try_new(paper(relays)).unwrap();
    let settings = Settings {
        wiring,
        ..Settings::default()
    };
    relay(mission, index, settings)
}

/// Returns the stored votes of a relay that has agreed on view `number`, proposed by relay 1.
///
/// The view (membership of the chain) has `relays` relays; `member` is true if the voting relay is one of them. `base`
/// is the digest of the mission loaded before flight.
///
/// # Panics
/// No relay can have such a record.
pub fn voted(base: u16, relays: u16, number: u32, member: bool) -> ViewRecord {
    let id = (number << 10 | 1).to_le_bytes();
    let relays = relays.to_le_bytes();
    // Promised, but nothing accepted since: no proposal, and the agreed view.
    let mut bytes = [&[1][..], &base.to_le_bytes(), &id, &relays].concat();
    bytes.push(u8::from(member));
    bytes.extend([&id[..], &[0], &[0; 4], &id, &relays].concat());
    bytes.resize(ViewRecord::LENGTH, 0);
    ViewRecord::from_bytes(&bytes).unwrap()
}
