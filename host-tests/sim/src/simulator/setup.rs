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
use super::rotation::RotationSpec;
use super::true_interference::TrueInterference;

/// Period in which relays 1 to `after` and relays `after` + 1 to N do not receive each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Partition {
    /// Number, from 1, of the relay after which the partition cuts the chain.
    pub after: u16,
    /// Time at which the partition begins.
    pub from: Instant,
    /// End of the partition; `None` if it is permanent.
    pub until: Option<Instant>,
}

impl Partition {
    /// Returns true if the partition separates the relays `one` and `other` (from 1) at the time `now`.
    pub fn parts(&self, one: u16, other: u16, now: Instant) -> bool {
        let during = now >= self.from && self.until.is_none_or(|until| now < until);
        during && (one <= self.after) != (other <= self.after)
    }
}

/// Upload of a mission by a ground station during a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UploadSpec {
    /// End of the chain that uploads: upstream for the transmitter Tx, downstream for the receiver Rx.
    pub end: Side,
    /// Time at which the upload begins.
    pub at: Instant,
    /// Mission that the ground station uploads.
    pub upload: Upload,
}

/// Data rate of a link or radio channel, the number of relays that share it, and a frame's overhead.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Channel {
    /// Data rate of the link or the channel, bit/s.
    pub baud: u32,
    /// Largest number of relays within radio range of one relay, including that relay itself.
    ///
    /// It is 1 if each pair of neighbours has a separate link.
    pub in_range: usize,
    /// Time on the air that a frame takes in addition to its bytes, as a number of bytes.
    pub overhead: usize,
}

/// Number of the random-number stream from which the network key is drawn.
const KEYS: u64 = 1;

/// Setup of a simulated run: mission, links, faults, events and records.
#[derive(Clone, Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
pub struct Setup {
    /// Mission that every relay has loaded at the start.
    pub mission: Mission,
    /// Relays without the mission's common altitude or power: number from 1, altitude and power.
    pub profiles: Vec<(u16, Profile)>,
    /// Numbers, from 1, of relays that keep their altitude even if the placement method chooses altitudes.
    pub held: Vec<u16>,
    /// Settings of every relay. The simulator sets `hop_time`, `hold_altitude` and `profile` for each relay.
    ///
    /// With `auth` it sets the key and the epoch, too.
    pub settings: Settings,
    /// Data rate and latency of the links.
    pub link: LinkSpec,
    /// Probabilities of faults (loss, corruption, duplication, delay) of a frame on any link.
    pub faults: Faults,
    /// Relays that are switched off: number from 1 and time.
    pub kills: Vec<(u16, Instant)>,
    /// Relays that reboot: number from 1 and time.
    ///
    /// A relay keeps only what it has stored: an uploaded mission, and its votes on views (memberships of the chain).
    pub boots: Vec<(u16, Instant)>,
    /// Relays that request to leave the chain: number from 1, time, and remaining endurance, s, if known.
    ///
    /// A relay is switched off once it has permission to leave.
    pub leaves: Vec<(u16, Instant, Option<u16>)>,
    /// Relays that cancel their departure: number from 1 and time.
    pub stays: Vec<(u16, Instant)>,
    /// Reserve of endurance at which relays request to leave by themselves; `None` if they do not.
    pub reserve: Option<Duration>,
    /// Values of a drone's remaining endurance after the way home, as given to its relay.
    ///
    /// Each entry has the relay's number from 1, the time, and the endurance, s.
    pub endurances: Vec<(u16, Instant, u16)>,
    /// Relays that wait outside of the chain from the start until the leader calls them, by number from 1.
    pub spares: Vec<u16>,
    /// Partitions: periods in which two parts of the chain do not receive each other.
    pub partitions: Vec<Partition>,
    /// True if relays sign frames, with a key drawn from the seed. The epoch counts the starts of a relay.
    pub auth: bool,
    /// Uploads of missions during the run. If `auth` is false, no upload takes place, because uploads must be signed.
    pub uploads: Vec<UploadSpec>,
    /// Ends of the chain whose ground stations request reports from the relays. Each has the time at which the requests
    /// begin. If `auth` is false, no station requests reports.
    pub watches: Vec<(Side, Instant)>,
    /// Numbers, from 1, of relays that lose an uploaded mission at a reboot.
    pub forgetful: Vec<u16>,
    /// Attack on the chain; `None` without an attacker.
    pub attack: Option<Attack>,
    /// Flight of simple drones without autopilots; `None` if it is not simulated.
    pub flight: Option<FlightSpec>,
    /// Flight of drones with simulated autopilots, in place of `flight`; `None` if it is not simulated.
    pub fleet: Option<FleetSpec>,
    /// Replacement of drones with nearly empty batteries; `None` if it is not simulated. It takes the place of `flight`
    /// and `fleet`.
    pub rotation: Option<RotationSpec>,
    /// Radio range on a shared channel, in relays. Relays receive each other if their numbers differ by at most this.
    pub radio_reach: usize,
    /// Access method of the radios on a shared channel.
    pub access: Access,
    /// Mean number of frames that a burst of losses lasts; 1 for independent losses.
    ///
    /// Otherwise it is at least [`Bursts::shortest`](super::faults::Bursts::shortest).
    pub burst: f64,
    /// One-way link failures: periods in which relay `by` does not receive relay `of`.
    pub deaf: Vec<OneWayFailure>,
    /// True interferers, which relays measure and have to locate; `None` if relays do not measure them.
    pub true_interference: Option<TrueInterference>,
    /// Fixed end of the run; `None` to end the run at its result, such as agreed positions of all relays.
    ///
    /// With a fixed end, the run measures the availability of the chain.
    pub soak: Option<Instant>,
    /// Time from which links cause no more faults; `None` if they cause faults to the end.
    pub faults_end: Option<Instant>,
    /// True to record all frames, for [`Chain::frames`](super::chain::Chain::frames).
    pub record: bool,
    /// True to record the run for an animation, as [`Outcome::film`](super::outcome::Outcome::film).
    pub film: bool,
    /// True to record the relays' states for data traffic. See [`Outcome::track`](super::outcome::Outcome::track).
    pub track: bool,
    /// Seed of all random draws of the run.
    pub seed: u64,
    /// Virtual time at which the run ends at the latest.
    pub deadline: Instant,
}

impl Setup {
    /// Default of [`Self::radio_reach`]: a relay receives four relays toward Tx and four toward Rx.
    pub const RADIO_REACH: usize = 4;

    /// Creates the setup of a fault-free run of `mission`, with default settings, default links and seed 1.
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
            leaves: Vec::new(),
            stays: Vec::new(),
            reserve: None,
            endurances: Vec::new(),
            spares: Vec::new(),
            partitions: Vec::new(),
            auth: false,
            uploads: Vec::new(),
            watches: Vec::new(),
            forgetful: Vec::new(),
            attack: None,
            flight: None,
            fleet: None,
            rotation: None,
            radio_reach: Self::RADIO_REACH,
            access: Access::Ideal,
            burst: 1.0,
            deaf: Vec::new(),
            true_interference: None,
            soak: None,
            faults_end: None,
            record: false,
            film: false,
            track: false,
            seed: 1,
            deadline: Instant::from_millis(1_000 * 3_600 * 24 * 30),
        }
    }

    /// Creates the setup of a run with a shared radio channel without collisions ([`Access::Ideal`]).
    pub fn on_shared_channel(mission: Mission) -> Self {
        Self::on_air(mission, Access::Ideal)
    }

    /// Creates the setup of a run with a shared radio channel and this access method.
    pub fn on_air(mission: Mission, access: Access) -> Self {
        let mut setup = Self::new(mission);
        setup.settings.wiring = Wiring::Shared;
        setup.access = access;
        setup
    }

    /// Changes the setup so that the run ends at `until` and the availability of the chain is measured.
    pub fn soaked(mut self, until: Instant) -> Self {
        self.soak = Some(until);
        self.deadline = until;
        self
    }

    /// Returns the data rate, relays in range, and frame overhead of the run's links or shared channel.
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

    /// Returns the load of the shared channel: the number of relays in radio range, and a frame's overhead.
    ///
    /// `None` if senders do not interfere with each other: on separate links between neighbours, and on an ideal
    /// channel.
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

    /// Returns the longest time that a message needs for one hop along the chain. The time includes 1 ms for computing.
    pub fn hop_time(&self) -> Duration {
        let latency = Duration::from_micros(self.link.latency.as_micros() + 1_000);
        self.load().map_or(self.link.hop_time(), |load| {
            load.hop_time(self.link.baud, latency)
        })
    }

    /// Returns the network key and the epoch of a relay at its `start`-th start. `None` if `auth` is false.
    pub fn proof(&self, start: u32) -> Option<Auth> {
        self.secret().map(|secret| Auth {
            key: Key::new(secret),
            epoch: start,
        })
    }

    /// Returns the bytes of the network key, drawn from the seed; `None` without `auth`.
    pub fn secret(&self) -> Option<[u8; 32]> {
        // Separate generator, so that signing does not change the run's other draws.
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(KEYS);
        self.auth.then(|| rng.random())
    }
}
