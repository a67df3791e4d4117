//! Interference that the relays of a run measure, from interferers that their mission does not contain.

use chacha20::ChaCha8Rng;
use rand::Rng;
use rand_distr::{Beta, Distribution as _, Gamma, StandardNormal};
use uav_relay::sensing::estimate::NumberedEstimate;
use uav_relay::{Duration, Instant, Placement, Sample};
use uav_relay_scenario::scene::{Place, Scene};

/// Interferers and measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueInterference {
    /// True interferers at time 0.
    pub scene: Scene,
    /// Common velocity of the interferers, m/s along the line and to its right.
    pub velocity_mps: [f64; 2],
    /// Independent samples per measurement.
    pub samples: u32,
    /// Standard deviation of the shadowing at a position, dB.
    pub shadow_db: f64,
    /// Time between two measurements of a relay.
    pub period: Duration,
    /// True to measure only once at each position.
    pub once: bool,
    /// Samples that replace all measurements, handed over at the first one: relay index from 1, sample.
    pub handed: Vec<(u16, Sample)>,
    /// Broken receivers.
    pub broken: Vec<Broken>,
    /// Start and end of the measurements at the transmitter and the receiver.
    pub ends_during: [Instant; 2],
    /// True if both ends measure, too. With keys they send the result by radio; without, the last relay has a wire to the
    /// receiver.
    pub ends: bool,
    /// End of the run.
    pub until: Instant,
    /// Seed of the shadowing.
    pub seed: u64,
}

/// Broken receiver that reports wrong powers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Broken {
    /// Node number: relay index from 1, 0 for the transmitter, N + 1 for the receiver.
    pub node: u16,
    /// Kind of the error.
    pub says: SensorReading,
    /// Start of the error.
    pub since: Instant,
}

/// Error of a broken receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorReading {
    /// Factor on the true power.
    Times(f64),
    /// Constant power, W.
    Always(f64),
}

/// Size of a cell with common shadowing, m.
const SHADOW_M: f64 = 5.0;

impl TrueInterference {
    /// Measurements of 1000 samples once a second, without shadowing, for ten minutes.
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

    /// Returns the scene with the interferers' positions at `now`.
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

    /// Draws the power that relay `index` (from 1) measures at `at`, W.
    pub(super) fn heard_w(
        &self,
        scene: &Scene,
        index: u16,
        now: Instant,
        at: Placement,
        rng: &mut ChaCha8Rng,
    ) -> f64 {
        let true_w = scene.interference_w(at) * decibel(self.shadow_db * self.shadow(at.into()));
        self.said_w(scene, index, now, true_w, rng)
    }

    /// Draws the power that `node` reports for a true interference of `true_w`, W.
    fn said_w(
        &self,
        scene: &Scene,
        node: u16,
        now: Instant,
        true_w: f64,
        rng: &mut ChaCha8Rng,
    ) -> f64 {
        let mut broken = self.broken.iter();
        let broken = broken.find(|broken| broken.node == node && now >= broken.since);
        match broken.map(|broken| broken.says) {
            Some(SensorReading::Times(times)) => (true_w * times + scene.noise_w) * self.mean(rng),
            Some(SensorReading::Always(power_w)) => power_w,
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
        self.said_w(scene, relays + 1, now, true_w, rng)
    }

    pub(super) fn transmitter_w(&self, scene: &Scene, now: Instant, rng: &mut ChaCha8Rng) -> f64 {
        self.said_w(scene, 0, now, scene.interference_on_ground_w(0.0), rng)
    }

    pub(super) fn ends_measure(&self, now: Instant) -> bool {
        let [from, until] = self.ends_during;
        self.ends && now >= from && now < until
    }

    /// Draws the mean of `samples` exponential variables with mean 1.
    fn mean(&self, rng: &mut impl Rng) -> f64 {
        let samples = f64::from(self.samples);
        Gamma::new(samples, 1.0 / samples).map_or(1.0, |shape| shape.sample(rng))
    }

    /// Returns the standard normal shadowing value of the cell of `at`.
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

/// Snapshot of the relays at a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand {
    /// Time of the snapshot.
    pub at: Instant,
    /// Indices of the living relays, from 1.
    pub nodes: Vec<u16>,
    /// Position of each living relay that has one. Its drone's, or its setpoint if drones are not simulated.
    pub places: Vec<Placement>,
    /// Setpoints; `None` unless every relay has one.
    pub goals: Option<Vec<Placement>>,
    /// Interference estimate of relay 1.
    pub believed: NumberedEstimate,
    /// Number of agreements on new positions until this time.
    pub agreements: u32,
}

/// Draws an interference power, W: `i_max_w` times a Beta variable. NaN if a shape parameter is not above 0.
#[expect(clippy::cast_possible_truncation, reason = "samples on board are f32")]
pub fn beta_w(rng: &mut impl Rng, alpha: f64, beta: f64, i_max_w: f32) -> f32 {
    let part = Beta::new(alpha, beta).map_or(f64::NAN, |shape| shape.sample(rng));
    (part * f64::from(i_max_w)) as f32
}
