//! What came of a simulated chain.

use std::collections::BTreeMap;

use uav_relay::sensing::belief::Told;
use uav_relay::{Duration, Instant, Placement, Profile, Side, Sites, Stats};

use super::attack::Struck;
use super::drones::{Nearest, Point};
use super::faults::Injected;
use super::film::Film;
use super::flying::Seen;
use super::medium::AirCounts;
use super::sky::Stand;

/// Something worth a line in the story of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Turning {
    /// A relay went silent.
    Silent,
    /// It was switched on again.
    Booted,
    /// It lost its neighbour at that side.
    Lost(Side),
    /// It heard a neighbour at that side again, or another one.
    Found(Side),
    /// It agreed to a new view: its number, its place there, how many relays there are, and what they fly.
    Reformed {
        /// Number of the view.
        view: u32,
        /// The relay's place, from 1 at Tx.
        index: u16,
        /// How many relays.
        relays: u16,
        /// Version of the mission that they fly.
        version: u16,
    },
    /// Its part of the chain is too small to go on.
    Cut,
    /// It is not certain any more that all hold what was agreed on.
    Lapsed,
    /// The other one says that it does not hear it.
    Unheard,
    /// The other one flies another mission.
    Stranger,
    /// The other one signs with another key.
    OtherKey,
    /// The other one's epoch went back.
    OldEpoch,
    /// The number of the other one, or its own, is used twice.
    Namesake,
    /// It took its place in an agreement.
    Converged,
    /// No target can be met.
    Infeasible,
    /// From here on it and those before it do not hear those after it.
    Parted,
    /// They hear each other again.
    Healed,
    /// From here on it does not hear the other one.
    Deaf,
    /// It hears it again.
    Hears,
    /// The ground begins to upload a mission of this version: the transmitter as relay 0, the receiver as the one after the last.
    Offered(u16),
    /// It holds a newer mission, of this version.
    Uploaded(u16),
    /// It flies it, with all others that were counted.
    Adopted(u16),
    /// Its autopilot flies to its places from now on.
    Engaged,
    /// Its pilot flies, or its autopilot by itself.
    Released,
    /// Nobody knows where its drone is.
    Blind,
    /// Its autopilot was switched off and on.
    Restarted,
    /// It believes something else of the interference than before.
    Believes,
    /// What is heard is not of one source.
    Unclear,
    /// The other one hears something else than all the others.
    Off,
}

/// A turning and whose it was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// When.
    pub at: Instant,
    /// Which relay, from 1.
    pub relay: u16,
    /// What.
    pub what: Turning,
    /// The neighbour that was lost or found, the relay that is not heard, or the one that is told of, from 1.
    pub other: Option<u16>,
    /// The target that the relay holds its place for, linear.
    pub target: Option<f32>,
    /// Passes that it has begun so far.
    pub sweeps: u32,
}

/// How a run ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ending {
    /// Every relay holds its place, for the same target.
    Settled,
    /// The leader found that no target can be met.
    Infeasible,
    /// Relays went silent, and every neighbour of theirs has noticed.
    Broken,
    /// No part of the chain is large enough to go on without the others.
    Cut,
    /// It went on for as long as it was meant to ([`Setup::soak`](super::setup::Setup::soak)).
    Soaked,
    /// The deadline, or the limit on the work of a run.
    OutOfTime,
}

/// One relay when the run has ended.
#[derive(Clone, Debug)]
pub struct RelayEnd {
    /// Where it was told to fly, if anywhere.
    pub setpoint: Option<Placement>,
    /// The target it holds that place for.
    pub target: Option<f32>,
    /// What no chain has, as the leader found.
    pub bound: Option<f32>,
    /// What it brought along.
    pub profile: Profile,
    /// Its counters.
    pub stats: Stats,
    /// When it went silent, if it did and was not switched on again.
    pub killed: Option<Instant>,
    /// Its place in the chain as it knows it, from 1 at Tx, of how many, and the number of that view.
    pub index: u16,
    /// How many relays there are.
    pub relays: u16,
    /// Number of the view.
    pub view: u32,
    /// Version of the mission that it flies.
    pub version: u16,
    /// What it believes of the interference.
    pub believed: Told,
    /// Between which sites it flies that, if not between those that it was loaded with.
    pub sites: Option<Sites>,
    /// What it showed.
    pub seen: Seen,
}

/// What a run was like over its whole time.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Watched {
    /// When all relays of a view held their places for the first time.
    pub first_agreement: Option<Instant>,
    /// The share of the time since then in which all relays that can be in one chain (a longest one) held its optimum; 0 without an
    /// agreement.
    pub availability: Option<f64>,
    /// The longest time since then in which they did not.
    pub longest_wrong: Option<Duration>,
    /// The most separate groups that flew an agreement of their own at once.
    pub most_flying: usize,
    /// The least distance that two relays ever had, m.
    pub least_separation_m: Option<f64>,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// The relays, from relay 1 on.
    pub relays: Vec<RelayEnd>,
    /// SIR of the chain after each round of Algorithm 2, linear; the first is that before any.
    pub rounds: Vec<f32>,
    /// Forward passes along the chain.
    pub sweeps: u32,
    /// Frames put on any link.
    pub messages: u64,
    /// Bytes put on any link.
    pub bytes: u64,
    /// When the run ended.
    pub ended: Instant,
    /// What was done to frames.
    pub injected: Injected,
    /// What became of an attacker's frames.
    pub struck: Struck,
    /// Who misses whom: by the index from 1 of the one that noticed and the side, since when.
    pub noticed: BTreeMap<(u16, Side), Instant>,
    /// The story of the run.
    pub moments: Vec<Moment>,
    /// When two drones were nearest to each other, where their flight was simulated.
    pub nearest: Option<Nearest>,
    /// The same of drones with an autopilot that no pilot had.
    pub nearest_lent: Option<Nearest>,
    /// Least of the distance of two drones with an autopilot that no pilot had, less the lesser of the separation and their distance when
    /// both were handed over last, m; infinite where there were none.
    pub margin_m: f64,
    /// When that was.
    pub margin_at: Option<Nearest>,
    /// Targets that an autopilot was told for more than a second after it had said that none may be sent. Anything but 0 is a bug.
    pub stray_targets: u64,
    /// Where the drones with an autopilot are in the end, along the line of the mission that their relays fly, and whether these fly them.
    pub fleet: Vec<(Point, bool)>,
    /// Setpoints that were outside their limits, ever. Anything but 0 is a bug.
    pub unsafe_setpoints: u64,
    /// What happened on the air, where relays shared it.
    pub air: AirCounts,
    /// What the run was like over its whole time; of a soak, and of relays on a shared channel.
    pub watched: Option<Watched>,
    /// Where the relays were, each time that they measured.
    pub stands: Vec<Stand>,
    /// What it looked like, where [`Setup::film`](super::setup::Setup::film) was set.
    pub film: Option<Film>,
}

impl Outcome {
    /// The least distance that two drones ever had, m; infinite where their flight was not simulated.
    pub fn nearest_m(&self) -> f64 {
        self.nearest
            .map_or(f64::INFINITY, |nearest| nearest.apart_m)
    }

    /// Where the relays were told to fly, to the bit: x, y and altitude; `None` for one that was told nothing.
    pub fn bits(&self) -> Vec<Option<[u32; 3]>> {
        let bits = |place: Placement| [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits);
        let places = self.relays.iter().map(|relay| relay.setpoint);
        places.map(|place| place.map(bits)).collect()
    }

    /// The newest mission that the ground has begun to upload, by its version.
    pub fn offered(&self) -> Option<u16> {
        let versions = self.moments.iter().filter_map(|moment| match moment.what {
            Turning::Offered(version) => Some(version),
            _ => None,
        });
        versions.max()
    }
}
