//! What a simulated chain is run with.

use uav_relay::{Instant, Mission, Profile, Settings, Wiring};

use super::faults::Faults;
use super::link::LinkSpec;

/// What to run.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The mission of every relay.
    pub mission: Mission,
    /// What relays hold of their own, by index from 1.
    pub profiles: Vec<(u16, Profile)>,
    /// Relays that keep to their altitude when altitudes are chosen.
    pub held: Vec<u16>,
    /// What every relay is set to; `hop_time`, `hold_altitude` and `profile` are filled in.
    pub settings: Settings,
    /// The links.
    pub link: LinkSpec,
    /// What happens to frames on them.
    pub faults: Faults,
    /// Relays that go silent: index from 1, and when.
    pub kills: Vec<(u16, Instant)>,
    /// Seed of every random draw.
    pub seed: u64,
    /// The run ends at this time at the latest.
    pub deadline: Instant,
}

impl Setup {
    /// A faultless run of `mission` with the default settings, links and seed 1.
    pub fn new(mission: Mission) -> Self {
        Self {
            mission,
            profiles: Vec::new(),
            held: Vec::new(),
            settings: Settings::default(),
            link: LinkSpec::default(),
            faults: Faults::default(),
            kills: Vec::new(),
            seed: 1,
            deadline: Instant::from_millis(1_000 * 3_600 * 24 * 30),
        }
    }

    /// The same on one channel that all hear.
    pub fn on_shared_channel(mission: Mission) -> Self {
        let mut setup = Self::new(mission);
        setup.settings.wiring = Wiring::Shared;
        setup
    }
}
