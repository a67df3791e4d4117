//! What a simulated chain is run with.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::{Auth, Instant, Key, Mission, Profile, Settings, Side, Upload, Wiring};

use super::attack::Attack;
use super::drones::FlightSpec;
use super::faults::Faults;
use super::link::LinkSpec;

/// A time in which relays 1 to `after` and the others do not hear each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Partition {
    /// The last relay of the first part, from 1.
    pub after: u16,
    /// When it begins.
    pub from: Instant,
    /// When it ends, if it does.
    pub until: Option<Instant>,
}

impl Partition {
    /// Whether relays `one` and `other` (from 1) cannot hear each other at `now`.
    pub fn parts(&self, one: u16, other: u16, now: Instant) -> bool {
        let during = now >= self.from && self.until.is_none_or(|until| now < until);
        during && (one <= self.after) != (other <= self.after)
    }
}

/// A mission that is uploaded in the run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UploadSpec {
    /// Where: the transmitter is upstream of the chain, the receiver downstream.
    pub end: Side,
    /// When.
    pub at: Instant,
    /// What.
    pub upload: Upload,
}

/// The stream of random numbers that keys are drawn from.
const KEYS: u64 = 1;

/// What to run.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The mission of every relay.
    pub mission: Mission,
    /// What relays hold of their own, by index from 1.
    pub profiles: Vec<(u16, Profile)>,
    /// Relays that keep to their altitude when altitudes are chosen.
    pub held: Vec<u16>,
    /// What every relay is set to; `hop_time`, `hold_altitude`, `profile` and, with `auth`, the key and the epoch are filled in.
    pub settings: Settings,
    /// The links.
    pub link: LinkSpec,
    /// What happens to frames on them.
    pub faults: Faults,
    /// Relays that go silent: index from 1, and when.
    pub kills: Vec<(u16, Instant)>,
    /// Relays that are switched on again, with nothing left of what they knew but an upload: index from 1, and when.
    pub boots: Vec<(u16, Instant)>,
    /// Times in which one part of the chain does not hear the other.
    pub partitions: Vec<Partition>,
    /// Whether frames carry tags: with a key drawn from the seed, and an epoch that counts the starts of a relay.
    pub auth: bool,
    /// Missions that are uploaded in flight; without `auth` nothing is.
    pub uploads: Vec<UploadSpec>,
    /// Relays that do not keep what was uploaded when they are switched off: index from 1.
    pub forgetful: Vec<u16>,
    /// What an attacker does, if there is one.
    pub attack: Option<Attack>,
    /// How the drones fly, where that is simulated, too.
    pub flight: Option<FlightSpec>,
    /// On a shared channel: how many relays away a relay is heard.
    pub radio_reach: usize,
    /// After this time frames get through, if there is one.
    pub faults_end: Option<Instant>,
    /// Seed of every random draw.
    pub seed: u64,
    /// The run ends at this time at the latest.
    pub deadline: Instant,
}

impl Setup {
    /// How many relays away a relay is heard on a shared channel, unless a run says otherwise.
    pub const RADIO_REACH: usize = 4;

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
            boots: Vec::new(),
            partitions: Vec::new(),
            auth: false,
            uploads: Vec::new(),
            forgetful: Vec::new(),
            attack: None,
            flight: None,
            radio_reach: Self::RADIO_REACH,
            faults_end: None,
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

    /// How a relay that is switched on for the `start`th time, from 1, proves who it is.
    pub fn proof(&self, start: u32) -> Option<Auth> {
        // Not the generator of the run: a chain with tags draws what one without them does.
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(KEYS);
        self.auth.then(|| Auth {
            key: Key::new(rng.random()),
            epoch: start,
        })
    }
}
