//! Interference that the relays of a run measure, from interferers that their mission does not contain.

use chacha20::ChaCha8Rng;
use rand::Rng;
use rand_distr::{Beta, Distribution as _, Gamma, StandardNormal};
use uav_relay::sensing::estimate::NumberedEstimate;
use uav_relay::{Duration, Instant, Placement, Sample};
use uav_relay_scenario::scene::{Place, Scene};

/// True interferers of a run, and parameters of the measurements that locate them.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueInterference {
    /// Relays, channel and true interferers, with the interferers' positions at time 0.
    pub scene: Scene,
    /// Velocity of all interferers along x (from Tx to Rx) and y (to the right as seen from Tx), m/s.
    pub velocity_mps: [f64; 2],
    /// Number of independent power samples that a relay averages for a measurement.
    pub samples: u32,
    /// Standard deviation, dB, of the shadowing: a random loss that depends on the position.
    pub shadow_db: f64,
    /// Time between two measurements of a relay.
    pub period: Duration,
    /// True if a relay measures only once at each of its positions.
    pub once: bool,
    /// Samples that relays get instead of measurements: the relay's number from 1, and the sample. Relays get these
    /// samples at the time of the first measurement.
    pub handed: Vec<(u16, Sample)>,
    /// Measuring receivers that report wrong powers.
    pub broken: Vec<BrokenReceiver>,
    /// Start and end of the period in which Tx and Rx measure the interference, too.
    pub ends_during: [Instant; 2],
    /// True if Tx and Rx measure the interference, too.
    ///
    /// With a network key, Tx and Rx send their results by radio. Without a key, only the result of Rx arrives: by a
    /// wire from Rx to the last relay.
    pub ends: bool,
    /// Time of the last measurement, which ends the run.
    pub until: Instant,
    /// Seed of the random shadowing at each position.
    pub seed: u64,
}

/// Measuring receiver that reports wrong powers from the time `since` on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrokenReceiver {
    /// Number of the node with the broken receiver: 0 for Tx, then the relays from 1, then Rx.
    pub node: u16,
    /// Power that the receiver reports instead of the true power.
    pub reading: BrokenReading,
    /// Time from which the reported powers are wrong.
    pub since: Instant,
}

/// Power that a broken receiver reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BrokenReading {
    /// The true interference power times this factor.
    Times(f64),
    /// A constant power, W, whatever the true interference.
    Always(f64),
}

/// Edge length of the cubes of constant shadowing, m. All positions in one cube have the same random loss.
const SHADOW_M: f64 = 5.0;

impl TrueInterference {
    /// Creates measurements of 1000 samples once a second for ten minutes, without shadowing.
    ///
    /// The interferers of `scene` do not move.
    pub const fn of(scene: Scene) -> Self {
        Self {
            scene,
            velocity_mps: [0.0; 2],
            samples: 1_000,
            shadow_db: 0.0,
            period: Duration::from_millis(1_000),
            once: false,
            handed: Vec::new(),
            broken: Vec::new(),
            ends_during: [Instant::ZERO, Instant::from_micros(u64::MAX)],
            ends: true,
            until: Instant::from_millis(600_000),
            seed: 1,
        }
    }

    /// Returns the scene with the interferers' positions at the virtual time `now`.
    pub fn scene_at(&self, now: Instant) -> Scene {
        let seconds = now.as_micros() as f64 * 1e-6;
        let mut scene = self.scene.clone();
        let [vx, vy] = self.velocity_mps;
        for source in &mut scene.sources {
            source.x_m += vx * seconds;
            source.y_m += vy * seconds;
        }
        scene
    }

    /// Draws the power, W, that relay `index` (from 1) measures at the position `at`, with shadowing.
    pub(super) fn relay_w(
        &self,
        scene: &Scene,
        index: u16,
        now: Instant,
        at: Placement,
        rng: &mut ChaCha8Rng,
    ) -> f64 {
        let true_w = scene.interference_w(at) * decibel(self.shadow_db * self.shadow(at.into()));
        self.reported_w(scene, index, now, true_w, rng)
    }

    /// Draws the power, W, that `node` reports if the true interference is `true_w`, W.
    ///
    /// It includes the noise, the random error of the samples' mean, and the error of a broken receiver.
    fn reported_w(
        &self,
        scene: &Scene,
        node: u16,
        now: Instant,
        true_w: f64,
        rng: &mut ChaCha8Rng,
    ) -> f64 {
        let mut broken = self.broken.iter();
        let broken = broken.find(|broken| broken.node == node && now >= broken.since);
        match broken.map(|broken| broken.reading) {
            Some(BrokenReading::Times(times)) => (true_w * times + scene.noise_w) * self.mean(rng),
            Some(BrokenReading::Always(power_w)) => power_w,
            None => (true_w + scene.noise_w) * self.mean(rng),
        }
    }

    pub(super) fn receiver_w(
        &self,
        scene: &Scene,
        now: Instant,
        relays: u16,
        rng: &mut ChaCha8Rng,
    ) -> f64 {
        let true_w = scene.interference_on_ground_w(scene.distance_m);
        self.reported_w(scene, relays + 1, now, true_w, rng)
    }

    pub(super) fn transmitter_w(&self, scene: &Scene, now: Instant, rng: &mut ChaCha8Rng) -> f64 {
        self.reported_w(scene, 0, now, scene.interference_on_ground_w(0.0), rng)
    }

    pub(super) fn ends_measure(&self, now: Instant) -> bool {
        let [from, until] = self.ends_during;
        self.ends && now >= from && now < until
    }

    /// Draws the random factor of a measured power. It is the mean of `samples` exponential random variables of mean
    /// 1.
    fn mean(&self, rng: &mut impl Rng) -> f64 {
        let samples = f64::from(self.samples);
        Gamma::new(samples, 1.0 / samples).map_or(1.0, |shape| shape.sample(rng))
    }

    /// Returns the shadowing of the interference at `at`, as a multiple of its standard deviation. All points of a cube
    /// of edge [`SHADOW_M`] have the same value.
    #[expect(clippy::cast_possible_truncation, reason = "a number of a cell")]
    fn shadow(&self, at: Place) -> f64 {
        use rand::SeedableRng as _;
        let cell = [at.x, at.y, at.h].map(|m| (m / SHADOW_M).round() as i64);
        let key = cell.iter().fold(self.seed, |key, part| {
            (key.rotate_left(17) ^ part.cast_unsigned()).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        });
        StandardNormal.sample(&mut ChaCha8Rng::seed_from_u64(key))
    }
}

fn decibel(db: f64) -> f64 {
    libm::pow(10.0, db / 10.0)
}

/// Snapshot of the relays' positions and estimate at the time of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Time of the measurement.
    pub at: Instant,
    /// Numbers of the relays that are on, from 1.
    pub nodes: Vec<u16>,
    /// Positions of the relays that are on and have a position. Each is the position of the drone or, without drones,
    /// the setpoint.
    pub places: Vec<Placement>,
    /// Setpoints of all relays; `None` unless every relay has one.
    pub goals: Option<Vec<Placement>>,
    /// Estimate of the interference by relay 1.
    pub believed: NumberedEstimate,
    /// Number of times that the relays have agreed on new positions until this time.
    pub agreements: u32,
}

/// Draws an interference power, W: `i_max_w` times a variable with a Beta distribution.
///
/// NaN if a shape parameter, `alpha` or `beta`, is not above 0.
#[expect(clippy::cast_possible_truncation, reason = "samples on board are f32")]
pub fn beta_w(rng: &mut impl Rng, alpha: f64, beta: f64, i_max_w: f32) -> f32 {
    let part = Beta::new(alpha, beta).map_or(f64::NAN, |shape| shape.sample(rng));
    (part * f64::from(i_max_w)) as f32
}
