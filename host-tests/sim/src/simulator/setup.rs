//! Setup of a simulated chain.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{
    Auth, ChannelLoad, Duration, Instant, Key, Mission, Profile, Settings, Side, Upload, Wiring,
};

use super::attack::Attack;
use super::drones::FlightSpec;
use super::faults::{Faults, LinkSpec, OneWayFailure};
use super::fleet::FleetSpec;
use super::medium;
use super::medium::Access;
use super::true_interference::TrueInterference;

/// Period in which relays 1 to `after` and the others do not receive each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Partition {
    /// Last relay of the first part, from 1.
    pub after: u16,
    /// Start time.
    pub from: Instant,
    /// End time; `None` if the partition is permanent.
    pub until: Option<Instant>,
}

impl Partition {
    /// Returns true if relays `one` and `other` (from 1) are on different sides at `now`.
    pub fn parts(&self, one: u16, other: u16, now: Instant) -> bool {
        let during = now >= self.from && self.until.is_none_or(|until| now < until);
        during && (one <= self.after) != (other <= self.after)
    }
}

/// Mission upload during the run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UploadSpec {
    /// Sending end: upstream for the transmitter, downstream for the receiver.
    pub end: Side,
    /// Start time.
    pub at: Instant,
    /// Uploaded mission.
    pub upload: Upload,
}

/// Capacity and sharing of a link or channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Channel {
    /// Bits per second.
    pub baud: u32,
    /// Largest number of relays within range at one point, including the relay itself. 1 for separate lines.
    pub in_range: usize,
    /// Overhead of a frame, bytes.
    pub overhead: usize,
}

/// Random-number stream of the keys.
const KEYS: u64 = 1;

/// Setup of a run.
#[derive(Clone, Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
pub struct Setup {
    /// Mission of every relay.
    pub mission: Mission,
    /// Individual profiles, by index from 1.
    pub profiles: Vec<(u16, Profile)>,
    /// Relays that keep their altitude when altitudes are planned.
    pub held: Vec<u16>,
    /// Settings of every relay. `hop_time`, `hold_altitude`, `profile` and, with `auth`, the key and the epoch are filled in.
    pub settings: Settings,
    /// Parameters of the links.
    pub link: LinkSpec,
    /// Frame faults.
    pub faults: Faults,
    /// Relays that go silent: index from 1 and time.
    pub kills: Vec<(u16, Instant)>,
    /// Relays that reboot: index from 1 and time. They keep only persisted state: uploads and the acceptor record.
    pub boots: Vec<(u16, Instant)>,
    /// Partitions of the chain.
    pub partitions: Vec<Partition>,
    /// True to sign frames, with a key drawn from the seed and an epoch that counts a relay's starts.
    pub auth: bool,
    /// Mission uploads during the run; none take place without `auth`.
    pub uploads: Vec<UploadSpec>,
    /// Relays that do not persist uploads across a reboot: index from 1.
    pub forgetful: Vec<u16>,
    /// Attack on the chain, if any.
    pub attack: Option<Attack>,
    /// Flight of simple drones, if simulated.
    pub flight: Option<FlightSpec>,
    /// Flight of drones with autopilots; replaces `flight`.
    pub fleet: Option<FleetSpec>,
    /// Radio range in relays, on a shared channel.
    pub radio_reach: usize,
    /// Channel access of the radios, on a shared channel.
    pub access: Access,
    /// Mean burst of losses, frames. 1 if independent, else at least [`Bursts::shortest`](super::faults::Bursts::shortest).
    pub burst: f64,
    /// Failures of single link directions.
    pub deaf: Vec<OneWayFailure>,
    /// Interference that the relays measure, if they have to find it.
    pub sky: Option<TrueInterference>,
    /// Fixed end of the run; the chain is judged all the time.
    pub soak: Option<Instant>,
    /// Time from which frames are no longer lost or damaged.
    pub faults_end: Option<Instant>,
    /// True to record frames for [`Chain::frames`](super::chain::Chain::frames).
    pub record: bool,
    /// True to record [`Outcome::film`](super::outcome::Outcome::film).
    pub film: bool,
    /// True to record [`Outcome::track`](super::outcome::Outcome::track).
    pub track: bool,
    /// Seed of every random draw.
    pub seed: u64,
    /// Latest end of the run.
    pub deadline: Instant,
}

impl Setup {
    /// Default radio range in relays, on a shared channel.
    pub const RADIO_REACH: usize = 4;

    /// Fault-free run of `mission` with default settings, default links and seed 1.
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
            fleet: None,
            radio_reach: Self::RADIO_REACH,
            access: Access::Ideal,
            burst: 1.0,
            deaf: Vec::new(),
            sky: None,
            soak: None,
            faults_end: None,
            record: false,
            film: false,
            track: false,
            seed: 1,
            deadline: Instant::from_millis(1_000 * 3_600 * 24 * 30),
        }
    }

    /// Creates the setup of a run on one ideal channel without collisions ([`Access::Ideal`]).
    pub fn on_shared_channel(mission: Mission) -> Self {
        Self::on_air(mission, Access::Ideal)
    }

    /// Creates the setup of a run on one shared channel with the given access method.
    pub fn on_air(mission: Mission, access: Access) -> Self {
        let mut setup = Self::new(mission);
        setup.settings.wiring = Wiring::Shared;
        setup.access = access;
        setup
    }

    /// Runs until `until` and judges the chain all the time.
    pub fn soaked(mut self, until: Instant) -> Self {
        self.soak = Some(until);
        self.deadline = until;
        self
    }

    /// Returns the channel parameters from which timings are derived.
    pub fn channel(&self) -> Channel {
        let near = match self.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => {
                let relays = usize::from(self.mission.relays());
                relays.min(2 * self.radio_reach + 1)
            }
        };
        let overhead = match (self.settings.wiring, self.access) {
            (Wiring::Pair, _) | (_, Access::Ideal) => 0,
            _ => medium::OVERHEAD,
        };
        Channel {
            baud: self.link.baud,
            in_range: near,
            overhead,
        }
    }

    /// Returns the load of the shared channel; `None` if senders do not interfere with each other.
    pub fn load(&self) -> Option<ChannelLoad> {
        let shared = self.settings.wiring == Wiring::Shared && self.access != Access::Ideal;
        let Channel {
            in_range, overhead, ..
        } = self.channel();
        shared.then_some(ChannelLoad {
            in_range: u16::try_from(in_range).unwrap_or(u16::MAX),
            overhead: u16::try_from(overhead).unwrap_or(u16::MAX),
        })
    }

    /// Returns the longest time of a sweep message per hop, with 1 ms for computing.
    pub fn hop_time(&self) -> Duration {
        let latency = Duration::from_micros(self.link.latency.as_micros() + 1_000);
        self.load().map_or(self.link.hop_time(), |load| {
            load.hop_time(self.link.baud, latency)
        })
    }

    /// Returns the key and the epoch of a relay at its `start`th start, from 1; `None` without `auth`.
    pub fn proof(&self, start: u32) -> Option<Auth> {
        self.secret().map(|secret| Auth {
            key: Key::new(secret),
            epoch: start,
        })
    }

    /// Returns the key's bytes; `None` without `auth`.
    pub fn secret(&self) -> Option<[u8; 32]> {
        // Separate generator, so that signing does not change the run's other draws.
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(KEYS);
        self.auth.then(|| rng.random())
    }
}
