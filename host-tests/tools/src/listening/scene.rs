//! Random scenes and their simulation setups.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::{Duration, Instant, Interference, Listen, Mission, MissionConfig, Placement};
use uav_relay_scenario::mission::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference as Known, Scenario, Source};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::FlightSpec;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::true_interference::{Stand, TrueInterference};

use crate::figures::error::FigureError;
use crate::multi_interferer::optimum;

const NO_SCENE: FigureError = FigureError::Unsettled("a scene");

/// A random scene: 1 km, interferers of 1 to 100 W at X from -0.2 to 1.2 D and |Y| from 0.05 to 0.8 D.
#[derive(Clone, Debug)]
pub struct RandomScene {
    /// Geometry, powers and the true interferers.
    pub scenario: Scenario,
    /// Number of relays.
    pub relays: u16,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl RandomScene {
    /// Draws a scene with that many relays and sources.
    pub fn new(seed: u64, relays: u16, sources: usize) -> Self {
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

    /// Moves the first source to (`x_m`, `y_m`), m.
    pub fn place(&mut self, x_m: f64, y_m: f64) {
        if let Known::Sources(sources) = &mut self.scenario.interference
            && let Some(source) = sources.first_mut()
        {
            (source.x_m, source.y_m) = (x_m, y_m);
        }
    }

    /// Returns a copy with the sources of `scene`.
    pub fn with(&self, scene: &Scene) -> Self {
        let mut wild = self.clone();
        wild.scenario.interference = Known::Sources(scene.sources.clone());
        wild
    }

    /// Returns the true scene.
    ///
    /// # Errors
    /// [`FigureError::Unsettled`] if there are no sources.
    pub fn scene(&self) -> Result<Scene, FigureError> {
        Scene::new(&self.scenario, self.relays).ok_or(NO_SCENE)
    }

    /// Returns the mission of the relays, with `guess` as its interference.
    ///
    /// # Errors
    /// [`FigureError::Mission`].
    pub fn mission(&self, guess: Interference) -> Result<Mission, FigureError> {
        let (told, _) = mission(&self.scenario, self.relays, 1e-4)?;
        let config = MissionConfig {
            interference: guess,
            ..*told.config()
        };
        Mission::try_new(config).map_err(|_| NO_SCENE)
    }

    /// Returns the best SIR with the interferers known, linear.
    ///
    /// For one source it is the SIR of the chain that knows it, for several the exact optimum.
    ///
    /// # Errors
    /// [`FigureError`].
    pub fn optimum(&self) -> Result<f64, FigureError> {
        let scene = self.scene()?;
        if scene.sources.len() > 1 {
            return Ok(optimum(&scene).ok_or(NO_SCENE)?.sir);
        }
        Ok(scene.chain_sir(&self.told()?))
    }

    /// Returns the positions of a chain that knows the interferer. For several sources, the paper's hypothetical one.
    ///
    /// # Errors
    /// [`FigureError`].
    pub fn told(&self) -> Result<Vec<Placement>, FigureError> {
        let (told, _) = mission(&self.scenario, self.relays, 1e-6)?;
        let outcome = run(Setup::new(told))?;
        let places: Option<_> = outcome.relays.iter().map(|relay| relay.setpoint).collect();
        places.ok_or(FigureError::Unsettled("a chain that was told"))
    }

    /// Returns a simulation in which relays reach their positions instantly and measure every five seconds.
    ///
    /// # Errors
    /// [`FigureError`].
    pub fn setup(&self, guess: Interference) -> Result<Setup, FigureError> {
        let mut setup = Setup::new(self.mission(guess)?);
        setup.seed = self.seed;
        setup.settings.listen = Some(Listen::default());
        let mut sky = TrueInterference::of(self.scene()?);
        sky.seed = self.seed;
        sky.period = Duration::from_millis(5_000);
        sky.until = Instant::from_millis(120_000);
        setup.deadline = Instant::from_millis(200_000);
        setup.sky = Some(sky);
        Ok(setup)
    }

    /// Returns a simulation with drones of 10 m/s. They start beside the transmitter and measure every second in flight.
    ///
    /// # Errors
    /// [`FigureError`].
    pub fn flown(&self, guess: Interference) -> Result<Setup, FigureError> {
        let mut setup = self.setup(guess)?;
        let start = (1..=self.relays)
            .map(|index| [5.0 * f64::from(index), 0.0, 20.0])
            .collect();
        setup.flight = Some(FlightSpec::multicopters(start, 0.0, 0.0));
        if let Some(sky) = &mut setup.sky {
            sky.period = Duration::from_millis(1_000);
        }
        Ok(setup)
    }
}

/// Returns the SIR after each agreement, linear; the first element is the SIR before any measurement.
pub fn by_agreement(scene: &Scene, stands: &[Stand]) -> Vec<f64> {
    let mut sirs = Vec::new();
    for stand in stands {
        if stand.agreements as usize > sirs.len()
            && let Some(goals) = &stand.goals
        {
            sirs.push(scene.chain_sir(goals));
        }
    }
    sirs
}
