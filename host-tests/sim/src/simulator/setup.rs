//! What a simulated chain is run with.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::{
    Auth, ChannelLoad, Duration, Instant, Key, Mission, Profile, Settings, Side, Upload, Wiring,
};

use super::attack::Attack;
use super::deaf::Deaf;
use super::drones::FlightSpec;
use super::faults::Faults;
use super::fleet::spec::FleetSpec;
use super::link::LinkSpec;
use super::medium::access::{self, Access};
use super::sky::Sky;

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

/// What a link or a channel carries, and for how many.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Channel {
    /// Bits per second.
    pub baud: u32,
    /// Relays that share it at one place at most: all that one relay hears, and itself. One where a relay has a line of its own.
    pub in_range: usize,
    /// What a frame costs beside its bytes, in bytes.
    pub overhead: usize,
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
    /// The same with an autopilot each, in place of it.
    pub fleet: Option<FleetSpec>,
    /// On a shared channel: how many relays away a relay is heard.
    pub radio_reach: usize,
    /// On a shared channel: how the radios come by it.
    pub access: Access,
    /// Mean length of a run of losses, frames: 1 for losses that are independent, else at least
    /// [`Bursts::shortest`](super::bursts::Bursts::shortest) of `faults.loss`.
    pub burst: f64,
    /// Relays that do not hear another one for a time.
    pub deaf: Vec<Deaf>,
    /// What the relays hear, where they are to find it out.
    pub sky: Option<Sky>,
    /// The run goes on until then whatever has come of it before, and is judged all the time.
    pub soak: Option<Instant>,
    /// After this time frames get through, if there is one.
    pub faults_end: Option<Instant>,
    /// Whether the frames on the air are kept for [`Chain::frames`](super::chain::Chain::frames).
    pub record: bool,
    /// Whether what it looks like is kept, for [`Outcome::film`](super::outcome::Outcome::film).
    pub film: bool,
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
            seed: 1,
            deadline: Instant::from_millis(1_000 * 3_600 * 24 * 30),
        }
    }

    /// The same on one ideal channel: frames are in nobody's way ([`Access::Ideal`]).
    pub fn on_shared_channel(mission: Mission) -> Self {
        Self::on_air(mission, Access::Ideal)
    }

    /// The same on one channel that the radios come by as `access` says.
    pub fn on_air(mission: Mission, access: Access) -> Self {
        let mut setup = Self::new(mission);
        setup.settings.wiring = Wiring::Shared;
        setup.access = access;
        setup
    }

    /// Has the run go on until `until`, judged all the time.
    pub fn soaked(mut self, until: Instant) -> Self {
        self.soak = Some(until);
        self.deadline = until;
        self
    }

    /// What a timing has to be made of: what the link carries, and how many share it.
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
            _ => access::OVERHEAD,
        };
        Channel {
            baud: self.link.baud,
            in_range: near,
            overhead,
        }
    }

    /// What the relays that share a channel put on it; `None` where nobody is in another's way.
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

    /// How long a sweep takes from one relay to the next, and a millisecond for computing.
    pub fn hop_time(&self) -> Duration {
        let latency = Duration::from_micros(self.link.latency.as_micros() + 1_000);
        self.load().map_or(self.link.hop_time(), |load| {
            load.hop_time(self.link.baud, latency)
        })
    }

    /// How a relay that is switched on for the `start`th time, from 1, proves who it is.
    pub fn proof(&self, start: u32) -> Option<Auth> {
        self.secret().map(|secret| Auth {
            key: Key::new(secret),
            epoch: start,
        })
    }

    /// The bytes of the key, where frames carry tags.
    pub fn secret(&self) -> Option<[u8; 32]> {
        // Not the generator of the run: a chain with tags draws what one without them does.
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(KEYS);
        self.auth.then(|| rng.random())
    }
}
