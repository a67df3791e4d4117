//! Random scenes, and how much of the optimum a chain has that has to find its interferer.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::{Duration, Instant, Interference, Listen, Mission, MissionConfig};
use uav_relay_sim::scenario::{Interference as Known, Scenario, Source};
use uav_relay_sim::scene::Scene;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::FlightSpec;
use uav_relay_sim::simulator::outcome::Outcome;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::sky::{Sky, Stand};
use uav_relay_tools::multi_interferer::optimum;

/// How many scenes a row: `COUNT`, or `usual`.
pub(crate) fn count(usual: u64) -> u64 {
    std::env::var("COUNT")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(usual)
}

/// A scene: 1 km, interferers of 1 to 100 W at X from -0.2 to 1.2 D and |Y| from 0.05 to 0.8 D.
#[derive(Clone, Debug)]
pub(crate) struct Wild {
    pub(crate) scenario: Scenario,
    pub(crate) relays: u16,
    pub(crate) seed: u64,
}

impl Wild {
    pub(crate) fn new(seed: u64, relays: u16, sources: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut scenario = Scenario::default();
        let d = scenario.distance_m;
        let sources = (0..sources)
            .map(|_| {
                let side = if rng.random() { 1.0 } else { -1.0 };
                Source {
                    power_w: 10_f64.powf(rng.random_range(0.0..2.0)),
                    x_m: rng.random_range(-0.2..1.2) * d,
                    y_m: side * rng.random_range(0.05..0.8) * d,
                }
            })
            .collect();
        scenario.interference = Known::Sources(sources);
        Self {
            scenario,
            relays,
            seed,
        }
    }

    /// The one source is there, m.
    pub(crate) fn place(&mut self, x_m: f64, y_m: f64) {
        if let Known::Sources(sources) = &mut self.scenario.interference {
            (sources[0].x_m, sources[0].y_m) = (x_m, y_m);
        }
    }

    /// The same with the sources of `scene`.
    pub(crate) fn with(&self, scene: &Scene) -> Self {
        let mut wild = self.clone();
        wild.scenario.interference = Known::Sources(scene.sources.clone());
        wild
    }

    pub(crate) fn scene(&self) -> Scene {
        Scene::new(&self.scenario, self.relays).unwrap()
    }

    /// What the relays are told: nothing of the interference.
    pub(crate) fn mission(&self, guess: Interference) -> Mission {
        let (mission, _) =
            uav_relay_sim::mission::mission(&self.scenario, self.relays, 1e-4).unwrap();
        Mission::try_new(MissionConfig {
            interference: guess,
            ..*mission.config()
        })
        .unwrap()
    }

    /// The SIR of the chain that knows everything, linear: of one source the chain that was told, of several the exact optimum.
    pub(crate) fn optimum(&self) -> f64 {
        let scene = self.scene();
        if scene.sources.len() > 1 {
            return optimum(&scene).unwrap().sir;
        }
        self.told().0
    }

    /// The chain that was told of one source: its SIR, linear, and its places.
    pub(crate) fn told(&self) -> (f64, Vec<uav_relay::Placement>) {
        let (mission, _) =
            uav_relay_sim::mission::mission(&self.scenario, self.relays, 1e-6).unwrap();
        let told = places(&run(Setup::new(mission)).unwrap());
        (sir(&self.scene(), &told), told)
    }

    /// The same with drones of 10 m/s, which start beside the transmitter and measure once a second on their way.
    pub(crate) fn flown(&self, guess: Interference) -> Setup {
        let mut setup = self.setup(guess);
        let start = (1..=self.relays)
            .map(|index| [5.0 * f64::from(index), 0.0, 20.0])
            .collect();
        setup.flight = Some(FlightSpec::multicopters(start, 0.0, 0.0));
        setup.sky.as_mut().unwrap().period = seconds(1);
        setup
    }

    /// A run in which relays are at their places at once, and measure every five seconds.
    pub(crate) fn setup(&self, guess: Interference) -> Setup {
        let mut setup = Setup::new(self.mission(guess));
        setup.seed = self.seed;
        setup.settings.listen = Some(Listen::default());
        let mut sky = Sky::of(self.scene());
        sky.seed = self.seed;
        sky.period = seconds(5);
        sky.until = Instant::from_millis(120_000);
        setup.deadline = Instant::from_millis(200_000);
        setup.sky = Some(sky);
        setup
    }
}

fn places(outcome: &Outcome) -> Vec<uav_relay::Placement> {
    outcome
        .relays
        .iter()
        .map(|relay| relay.setpoint.unwrap())
        .collect()
}

/// The SIR of a chain there, linear.
pub(crate) fn sir(scene: &Scene, places: &[uav_relay::Placement]) -> f64 {
    scene.chain_sir(places)
}

/// The SIR after each agreement, the first is that before anything was heard; the last one stands for those that did not come.
pub(crate) fn by_agreement(scene: &Scene, stands: &[Stand]) -> Vec<f64> {
    let mut sirs = Vec::new();
    for stand in stands {
        let at = stand.agreements as usize;
        if at > sirs.len() {
            sirs.push(sir(scene, stand.goals.as_ref().unwrap()));
        }
    }
    sirs
}

/// The part-quantile of numbers.
pub(crate) fn quantile(numbers: &mut [f64], part: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[((numbers.len() - 1) as f64 * part).round() as usize]
}

pub(crate) fn seconds(s: u64) -> Duration {
    Duration::from_millis(s * 1_000)
}
