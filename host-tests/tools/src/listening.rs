//! Chains that must locate their interferer, compared with chains that know it, in random scenes.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use uav_relay::{Duration, Instant, Interference, Listen, Mission, MissionConfig, Placement};
use uav_relay_scenario::mission::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference as Known, Scenario, Source};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::FlightSpec;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::true_interference::{Snapshot, TrueInterference};

use super::figures::sheet::FigureError;
use super::multi_interferer::optimum;

const NO_SCENE: FigureError = FigureError::Unsettled("a scene");

/// Random experiment: relays on a line of 1 km, and interferers. In some runs the relays must locate the interferers.
///
/// The interferers have 1 to 100 W. The interferers are at X from -0.2 to 1.2 D and |Y| from 0.05 to 0.8 D; D is the
/// distance from Tx to Rx.
#[derive(Clone, Debug)]
pub struct RandomScene {
    /// Geometry, powers and the true interferers.
    pub scenario: Scenario,
    /// Number of relays in the chain.
    pub relays: u16,
    /// Seed of the random numbers for the interferers and for the simulation.
    pub seed: u64,
}

impl RandomScene {
    /// Draws a random experiment with `relays` relays and `sources` interferers.
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

    /// Moves the first interferer of the experiment to (`x_m`, `y_m`), m.
    pub fn place(&mut self, x_m: f64, y_m: f64) {
        if let Known::Sources(sources) = &mut self.scenario.interference
            && let Some(source) = sources.first_mut()
        {
            (source.x_m, source.y_m) = (x_m, y_m);
        }
    }

    /// Returns a copy of this experiment with the interferers of `scene`.
    pub fn with(&self, scene: &Scene) -> Self {
        let mut wild = self.clone();
        wild.scenario.interference = Known::Sources(scene.sources.clone());
        wild
    }

    /// Returns the chain with its true interferers, from which exact SIRs are computed.
    pub fn scene(&self) -> Result<Scene, FigureError> {
        Scene::new(&self.scenario, self.relays).ok_or(NO_SCENE)
    }

    /// Returns the mission that relays load before flight. Its interference is `guess`.
    pub fn mission(&self, guess: Interference) -> Result<Mission, FigureError> {
        let (told, _) = mission(&self.scenario, self.relays, 1e-4)?;
        let config = MissionConfig {
            interference: guess,
            ..*told.config()
        };
        Mission::try_new(config).map_err(|_| NO_SCENE)
    }

    /// Returns the best SIR that relays can have if they know the interferers, linear.
    ///
    /// For one interferer it is the SIR of a simulated chain that knows the interferer, for several the exact optimum.
    pub fn optimum(&self) -> Result<f64, FigureError> {
        let scene = self.scene()?;
        if scene.sources.len() > 1 {
            return Ok(optimum(&scene).ok_or(NO_SCENE)?.sir);
        }
        Ok(scene.chain_sir(&self.known_positions()?))
    }

    /// Simulates a chain that knows the interferer, and returns the positions of its relays.
    ///
    /// Several interferers are replaced by the paper's hypothetical interferer.
    pub fn known_positions(&self) -> Result<Vec<Placement>, FigureError> {
        let (told, _) = mission(&self.scenario, self.relays, 1e-6)?;
        let outcome = run(Setup::new(told))?;
        let places: Option<_> = outcome.relays.iter().map(|relay| relay.setpoint).collect();
        places.ok_or(FigureError::Unsettled("a chain that knows the interferer"))
    }

    /// Returns a simulation whose relays measure the interference every 5 s, and move at once.
    ///
    /// `guess` is the interference that the relays assume before the first measurement.
    pub fn setup(&self, guess: Interference) -> Result<Setup, FigureError> {
        let mut setup = Setup::new(self.mission(guess)?);
        setup.seed = self.seed;
        setup.settings.listen = Some(Listen::default());
        let mut true_interference = TrueInterference::of(self.scene()?);
        true_interference.seed = self.seed;
        true_interference.period = Duration::from_millis(5_000);
        true_interference.until = Instant::from_millis(120_000);
        setup.deadline = Instant::from_millis(200_000);
        setup.true_interference = Some(true_interference);
        Ok(setup)
    }

    /// Returns a simulation of drones that fly at 10 m/s, and measure the interference every second.
    ///
    /// The drones start beside Tx. `guess` is the interference that the relays assume before the first measurement.
    pub fn flown(&self, guess: Interference) -> Result<Setup, FigureError> {
        let mut setup = self.setup(guess)?;
        let start = (1..=self.relays)
            .map(|index| [5.0 * f64::from(index), 0.0, 20.0])
            .collect();
        setup.flight = Some(FlightSpec::multicopters(start, 0.0, 0.0));
        if let Some(true_interference) = &mut setup.true_interference {
            true_interference.period = Duration::from_millis(1_000);
        }
        Ok(setup)
    }
}

/// Returns the chain's SIR with the true interferers after each agreement on positions, linear.
///
/// At the first agreement the relays have no measurements. `stands` are the states of the simulated chain in order.
pub fn by_agreement(scene: &Scene, stands: &[Snapshot]) -> Vec<f64> {
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

/// Largest number of agreements with measurements in the figure.
pub const LAST: usize = 8;

/// Fractions of the best possible SIR that chains reach. List k is for k agreements with measurements.
///
/// Each list has one value for each random experiment.
pub type Shares = [Vec<f64>; LAST + 1];

/// Simulates `scenes` random experiments. Returns the fractions of the best possible SIR.
///
/// There is a value after each agreement on positions. `setup` returns the simulation of an experiment.
pub fn shares(
    scenes: u64,
    relays: u16,
    sources: usize,
    setup: impl Fn(&RandomScene) -> Result<Setup, FigureError> + Sync,
) -> Result<Shares, FigureError> {
    let one = |seed| {
        let wild = RandomScene::new(seed, relays, sources);
        let outcome = run(setup(&wild)?)?;
        let best = wild.optimum()?;
        let sirs = by_agreement(&wild.scene()?, &outcome.snapshots);
        let last = *sirs.last().ok_or(FigureError::Unsettled(
            "a chain that measures the interferer",
        ))?;
        let share = |at: usize| sirs.get(at).unwrap_or(&last) / best;
        Ok((0..=LAST).map(share).collect())
    };
    let each: Result<Vec<Vec<f64>>, FigureError> = (0..scenes).into_par_iter().map(one).collect();
    let each = each?;
    Ok(std::array::from_fn(|at| {
        each.iter().filter_map(|one| one.get(at).copied()).collect()
    }))
}

/// Returns a simulation whose relays know nothing about the interference at first, and measure it.
pub fn unknown(wild: &RandomScene) -> Result<Setup, FigureError> {
    wild.setup(Interference::Unknown)
}

/// Returns the simulation of [`unknown`] with 1 dB of shadowing, independent at each position.
pub fn shadowed(wild: &RandomScene) -> Result<Setup, FigureError> {
    let mut setup = unknown(wild)?;
    if let Some(true_interference) = &mut setup.true_interference {
        true_interference.shadow_db = 1.0;
    }
    Ok(setup)
}

/// Returns a simulation without measurements, whose relays know the interferer.
///
/// Several interferers are replaced by the paper's hypothetical interferer.
pub fn hypothetical(wild: &RandomScene) -> Result<Setup, FigureError> {
    let mut setup = unknown(wild)?;
    (setup.mission, _) = mission(&wild.scenario, wild.relays, 1e-4)?;
    setup.settings.listen = None;
    Ok(setup)
}

/// Returns the quantile of `numbers` at the fraction `part`, 0 to 1; 0.5 is the median.
///
/// NaN if `numbers` is empty.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "an index"
)]
pub fn quantile(numbers: &mut [f64], part: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let at = (numbers.len().saturating_sub(1) as f64 * part).round() as usize;
    numbers.get(at).copied().unwrap_or(f64::NAN)
}

/// Time after the start of a run, s, from which on the run's SIRs count for the mean.
const BEGUN_S: u32 = 60;

/// Means over time of SIR / best possible SIR, one mean for each experiment.
///
/// The interferer moves. The first minute of a run does not count.
#[derive(Clone, Debug, Default)]
pub struct MovingShares {
    /// Mean fractions of chains that follow the interferer, one for each experiment.
    pub followed: Vec<f64>,
    /// Mean fractions of chains that do not move, one for each experiment.
    ///
    /// They keep the positions that were best after the first minute.
    pub stayed: Vec<f64>,
}

/// Simulates `scenes` experiments with an interferer that moves parallel to the line Tx-Rx.
///
/// The interferer is 300 m from this line. Returns the mean fractions of the best possible SIR, for chains that follow
/// the interferer and for chains that do not move.
pub fn moving_shares(
    scenes: u64,
    relays: u16,
    speed_mps: f64,
) -> Result<MovingShares, FigureError> {
    let each: Result<Vec<(f64, f64)>, FigureError> = (0..scenes)
        .into_par_iter()
        .map(|seed| one(seed, relays, speed_mps))
        .collect();
    let (followed, stayed) = each?.into_iter().unzip();
    Ok(MovingShares { followed, stayed })
}

fn one(seed: u64, relays: u16, speed_mps: f64) -> Result<(f64, f64), FigureError> {
    let mut wild = RandomScene::new(seed, relays, 1);
    // Halfway through the run, the interferer is beside the middle of the line Tx-Rx.
    let span_s = 600.0 / speed_mps.max(3.0) + f64::from(BEGUN_S);
    let half_s = 0.5 * (span_s + f64::from(BEGUN_S));
    wild.place(500.0 - speed_mps * half_s, 300.0);
    let mut setup = wild.flown(Interference::Unknown)?;
    setup.settings.listen = Some(Listen::following(relays));
    let none = FigureError::Unsettled("a chain that tracks a moving interferer");
    let Some(true_interference) = &mut setup.true_interference else {
        return Err(none);
    };
    true_interference.velocity_mps = [speed_mps, 0.0];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some minutes"
    )]
    let span_ms = (span_s * 1e3) as u64;
    true_interference.until = Instant::from_millis(span_ms);
    let true_interference = true_interference.clone();
    let outcome = run(setup)?;
    let begun = Instant::from_millis(u64::from(BEGUN_S) * 1_000);
    let (mut followed, mut stayed, mut moments) = (0.0, 0.0, 0.0);
    let mut first = None;
    for stand in outcome.snapshots.iter().filter(|stand| stand.at >= begun) {
        let scene = true_interference.scene_at(stand.at);
        let places = wild.with(&scene).known_positions()?;
        let best = scene.chain_sir(&places);
        let first = first.get_or_insert(places);
        followed += scene.chain_sir(&stand.places) / best;
        stayed += scene.chain_sir(first) / best;
        moments += 1.0;
    }
    // At least a minute of samples, one per second.
    if moments > 50.0 {
        Ok((followed / moments, stayed / moments))
    } else {
        Err(none)
    }
}

/// Returns the mean of `shares`, fractions of the best possible SIR. NaN if `shares` is empty.
#[expect(clippy::cast_precision_loss, reason = "a few")]
pub fn mean(shares: &[f64]) -> f64 {
    shares.iter().sum::<f64>() / shares.len() as f64
}
