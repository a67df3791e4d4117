//! Missions of the model test. 2 to 6 relays, every method, drawn like those of the random placement tests.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::{
    Adjust, Identity, Instant, Local, Measure, Method, Mission, MissionConfig, Profile, Relay,
    Settings,
};
use uav_relay_oracle::mission::{as_relays_know_it, of_link, of_stochastic_link};
use uav_relay_oracle::random::joint::scenario as joint_scenario;
use uav_relay_oracle::random::{Chain, Style, link as random_link, log_uniform};
use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::Corridor;
use uav_relay_oracle::reference::stochastic::StochasticLink;

use super::chain::World;
use super::reference::Reference;

/// Number of samples that a relay averages at one position.
pub(crate) const SAMPLES: u32 = 100;

/// Range from which the minimum separation is drawn in half of the chains with free altitudes. The unit is the distance
/// of neighbours in an evenly spaced chain.
const TIGHT: (f64, f64) = (0.05, 0.95);

/// Number of scenes with free altitudes whose optima are recorded.
const SCENES: u64 = 400;

/// Kind of mission: the leader's optimisation method and its data.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Kind {
    /// Algorithm 1 (optimises x at given altitudes), where the leader predicts the target SIR.
    Predicted,
    /// Algorithm 1 (optimises x at given altitudes) without prediction of the target SIR. The leader tests target SIRs
    /// by messages along the chain. Relays may have their own altitudes and powers.
    Tried,
    /// Joint method, which optimises x, y and altitude together.
    Altitude,
    Adjust,
    /// Algorithm 4 (optimises x in a field of interference), in a configured field.
    Field,
    /// Algorithm 4 (optimises x in a field of interference), in a field that the relays measure.
    Measured,
}

impl Kind {
    pub(crate) const ALL: [Self; 6] = [
        Self::Predicted,
        Self::Tried,
        Self::Altitude,
        Self::Adjust,
        Self::Field,
        Self::Measured,
    ];
}

/// Agreement that a chain without faults reaches.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Calm {
    /// Agreed x, y and altitude of every relay, as f32 bits.
    pub(crate) places: Vec<[u32; 3]>,
    /// Target SIR on which the relays agreed, as f32 bits.
    pub(crate) target: u32,
    /// Virtual time until the relays agreed, µs.
    pub(crate) took_us: u64,
}

/// Mission for the model test, with its reference model and the agreement of a chain without faults.
#[derive(Debug)]
pub(crate) struct Scenario {
    pub(crate) kind: Kind,
    pub(crate) mission: Mission,
    pub(crate) settings: Vec<Settings>,
    pub(crate) reference: Reference,
    pub(crate) calm: Calm,
}

impl Scenario {
    /// Creates relay `at` (from 0), which has just been switched on.
    pub(crate) fn relay(&self, at: usize, seed: u32, epoch: u32, now: Instant) -> Relay {
        let mut settings = self.settings[at];
        if let Some(auth) = &mut settings.auth {
            auth.epoch = epoch;
        }
        let identity = Identity {
            network: 3,
            index: at as u16 + 1,
        };
        Relay::new(self.mission, identity, settings, seed, now).unwrap()
    }

    /// Returns true if the relays sign their frames.
    pub(crate) fn signs(&self) -> bool {
        self.settings.iter().all(|one| one.auth.is_some())
    }

    /// Returns the same mission with signed frames. Checks that its agreement equals that with unsigned frames.
    fn signed(mut self) -> Self {
        for one in &mut self.settings {
            one.auth = Some(make::auth([7; 32], 1));
        }
        let calm = World::new(&self, 1).unwrap().calm().unwrap();
        assert_eq!(calm.places, self.calm.places);
        assert_eq!(calm.target, self.calm.target);
        self.calm = calm;
        self
    }

    pub(crate) fn relays(&self) -> usize {
        self.settings.len()
    }

    pub(crate) fn leader(&self) -> usize {
        usize::from(self.mission.leader()) - 1
    }
}

/// Draws `count` missions of all kinds.
pub(crate) fn pool(seed: u64, count: u32) -> Vec<Scenario> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count as usize)
        .map(|at| {
            let kind = Kind::ALL[at % Kind::ALL.len()];
            loop {
                if let Some(scenario) = drawn(&mut rng, kind) {
                    // One in four of each kind is signed.
                    let signs = at / Kind::ALL.len() % 4 == 3;
                    break if signs { scenario.signed() } else { scenario };
                }
            }
        })
        .collect()
}

/// Draws a mission of a kind; `None` if no chain can carry out the drawn mission.
fn drawn(rng: &mut ChaCha8Rng, kind: Kind) -> Option<Scenario> {
    let (mission, settings, reference) = match kind {
        Kind::Predicted | Kind::Tried => aligned(rng, kind)?,
        Kind::Altitude | Kind::Adjust => joint(rng, kind)?,
        Kind::Field | Kind::Measured => in_a_field(rng, kind)?,
    };
    let mut scenario = Scenario {
        kind,
        mission,
        settings,
        reference,
        calm: Calm {
            places: Vec::new(),
            target: 0,
            took_us: u64::MAX,
        },
    };
    scenario.calm = World::new(&scenario, 1)
        .unwrap()
        .calm()
        .unwrap_or_else(|why| panic!("{kind:?}: {why:?}"));
    Some(scenario)
}

type Parts = (Mission, Vec<Settings>, Reference);

/// Returns the settings of each relay. A relay whose index is in `own` has its own altitude and power.
fn settings(relays: usize, common: Settings, own: &[(u16, Profile)]) -> Vec<Settings> {
    let mut all = vec![common; relays];
    for (index, profile) in own {
        all[usize::from(*index) - 1].profile = Some(*profile);
    }
    all
}

fn aligned(rng: &mut ChaCha8Rng, kind: Kind) -> Option<Parts> {
    let style = Style {
        relays: 2..=6,
        chain: if kind == Kind::Tried {
            Chain::Any
        } else {
            Chain::Alike
        },
    };
    let mut link = random_link(rng, &style);
    if rng.random() {
        link.min_separation_m =
            link.distance_m / (link.len() + 1) as f64 * log_uniform(rng, 0.03, 1.0);
    }
    let link = as_relays_know_it(&link);
    let (mission, own) = of_link(&link, 1e-4)?;
    let common = Settings {
        predict: kind == Kind::Predicted,
        ..Settings::default()
    };
    let optimum = link.optimum()?;
    let settings = settings(link.len(), common, &own);
    Some((mission, settings, Reference::Source { link, optimum }))
}

/// Returns the link and altitude limits of random scene `number`, below [`SCENES`]. Its optimum is recorded.
fn numbered(number: u64) -> (Link, Corridor) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    rng.set_stream(number);
    let drawn = joint_scenario(&mut rng, &(2..=6), TIGHT);
    let narrow = make::band(drawn.corridor.least_m as f32, drawn.corridor.most_m as f32);
    let corridor = Corridor::plane(f64::from(narrow.least_m), f64::from(narrow.most_m));
    let mut link = drawn.link;
    // All relays start at one altitude, except single ones.
    let common_m = log_uniform(&mut rng, corridor.least_m, corridor.most_m);
    for relay in &mut link.relays {
        let own = rng.random_bool(0.2);
        relay.altitude_m = if own {
            log_uniform(&mut rng, corridor.least_m, corridor.most_m)
        } else {
            common_m
        };
        relay.power_w *= if rng.random_bool(0.1) {
            log_uniform(&mut rng, 0.3, 3.0)
        } else {
            1.0
        };
    }
    (as_relays_know_it(&link), corridor)
}

fn joint(rng: &mut ChaCha8Rng, kind: Kind) -> Option<Parts> {
    let (link, corridor) = numbered(rng.random_range(0..SCENES));
    let narrow = make::band(corridor.least_m as f32, corridor.most_m as f32);
    let (mission, own) = of_link(&link, 1e-4)?;
    let config = MissionConfig {
        band: narrow,
        ..*mission.config()
    };
    let mission = Mission::try_new(config).ok()?;
    let common = Settings {
        predict: rng.random_bool(0.8),
        method: if kind == Kind::Altitude {
            Method::Joint
        } else {
            Method::Adjust(turns(rng, narrow.most_m))
        },
        ..Settings::default()
    };
    let mut settings = settings(link.len(), common, &own);
    for one in &mut settings {
        one.hold_altitude = rng.random_bool(0.1);
    }
    // The optimum is without the separation. It is not below the optimum with it, and a search finds it reliably.
    let unseparated = Link {
        min_separation_m: 0.0,
        ..link.clone()
    };
    let optimum = optimum(&unseparated, corridor, &[]).unwrap()?.sir;
    Some((mission, settings, Reference::Source { link, optimum }))
}

/// Draws the parameters of Algorithm 2. The limit of a relay's change of altitude in one round is 0.02 to 0.5 of
/// `most_m`, the highest altitude.
fn turns(rng: &mut ChaCha8Rng, most_m: f32) -> Adjust {
    Adjust {
        rounds: rng.random_range(1..=6),
        explore_m: most_m * rng.random_range(0.02..0.5),
        local: if rng.random() {
            Local::Fine
        } else {
            Local::Grid {
                columns: 9,
                rows: 5,
            }
        },
    }
}

fn in_a_field(rng: &mut ChaCha8Rng, kind: Kind) -> Option<Parts> {
    let round = |value: f64| f64::from(value as f32);
    let relays = rng.random_range(2..=6_u8);
    let points = rng.random_range(1..=4_u8);
    let distance_m = round(log_uniform(rng, 100.0, 1e4));
    let relay = make::reference_relay(
        round(distance_m * log_uniform(rng, 0.005, 0.1)),
        round(log_uniform(rng, 0.1, 10.0)),
    );
    let mu_los = log_uniform(rng, 1.0, 1e4);
    // This unit of Upsilon makes the SIRs about 1.
    let unit = mu_los * (distance_m / f64::from(relays)).powi(2) / relay.power_w;
    let upsilon: Vec<(f64, f64)> = (0..points)
        .map(|at| {
            let x = distance_m * f64::from(at) / f64::from(points);
            (round(x), round(unit * log_uniform(rng, 0.3, 3.0)))
        })
        .collect();
    let least = upsilon
        .iter()
        .map(|(_, upsilon)| *upsilon)
        .fold(f64::INFINITY, f64::min);
    let link = StochasticLink {
        distance_m,
        tx_w: round(relay.power_w * log_uniform(rng, 0.5, 100.0)),
        mu_los,
        eta: mu_los * log_uniform(rng, 1.0, 1.9),
        upsilon,
        relays: vec![relay; usize::from(relays)],
    };
    // In an uneven field the separation may prevent a target that would be met without it.
    let apart = if points == 1 && rng.random() {
        0.1 * distance_m / f64::from(relays)
    } else {
        0.0
    };
    let mission = of_stochastic_link(&link, apart as f32)?;
    let common = Settings {
        predict: rng.random_bool(0.8),
        measure: (kind == Kind::Measured).then_some(Measure {
            i_max_w: (10.0 / least) as f32,
            samples: SAMPLES,
        }),
        ..Settings::default()
    };
    let settings = vec![common; usize::from(relays)];
    Some((mission, settings, Reference::Field(link)))
}
