//! What the relays of a run hear: interferers that nobody tells them of.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Gamma, StandardNormal};
use uav_relay::sensing::belief::Told;
use uav_relay::{Duration, Instant, Placement, Sample};

use uav_relay_scenario::scene::{Place, Scene};

/// What is heard, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// The true interferers, where they are at time 0.
    pub scene: Scene,
    /// How fast all of them move, m/s along the line and to its right.
    pub velocity_mps: [f64; 2],
    /// Independent samples in one measurement.
    pub samples: u32,
    /// Standard deviation of a place's own error, dB.
    pub shadow_db: f64,
    /// How often every relay measures.
    pub period: Duration,
    /// Whether it measures once at a place, and then no more.
    pub once: bool,
    /// What relays are handed instead of what is heard where they are, once, at the first measurement: index from 1, and what.
    pub handed: Vec<(u16, Sample)>,
    /// Receivers that say something else.
    pub broken: Vec<Broken>,
    /// When the ends begin to measure, and when they stop.
    pub ends_during: [Instant; 2],
    /// Whether the transmitter and the receiver measure, too: with keys they say it on the air, without them the receiver has a wire to the
    /// last relay.
    pub ends: bool,
    /// The run goes on until then.
    pub until: Instant,
    /// Seed of the shadows.
    pub seed: u64,
}

/// A receiver that says something else than it hears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Broken {
    /// Whose: index from 1, 0 for the transmitter, one more than there are relays for the receiver.
    pub node: u16,
    /// What it says.
    pub says: Says,
    /// Since when.
    pub since: Instant,
}

/// What a broken receiver says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Says {
    /// So many times what it hears.
    Times(f64),
    /// Always this, W.
    Always(f64),
}

/// Places nearer than this have the same shadow, m.
const SHADOW_M: f64 = 5.0;

impl Sky {
    /// A thousand samples a second, without shadows, for ten minutes.
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

    /// The interferers as they are at `now`.
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

    /// What relay `index` (from 1) measures at `at`, W.
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

    /// What the receiver of `node` makes of an interference of `true_w`, W.
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
            Some(Says::Times(times)) => (true_w * times + scene.noise_w) * self.mean(rng),
            Some(Says::Always(power_w)) => power_w,
            None => (true_w + scene.noise_w) * self.mean(rng),
        }
    }

    /// What the receiver of a chain of `relays` measures, W.
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

    /// What the transmitter measures, W.
    pub(super) fn transmitter_w(&self, scene: &Scene, now: Instant, rng: &mut ChaCha8Rng) -> f64 {
        self.said_w(scene, 0, now, scene.interference_on_ground_w(0.0), rng)
    }

    /// Whether the ends measure now.
    pub(super) fn ends_measure(&self, now: Instant) -> bool {
        let [from, until] = self.ends_during;
        self.ends && now >= from && now < until
    }

    /// The mean of so many exponential samples with a mean of 1.
    fn mean(&self, rng: &mut impl Rng) -> f64 {
        let samples = f64::from(self.samples);
        Gamma::new(samples, 1.0 / samples).map_or(1.0, |shape| shape.sample(rng))
    }

    /// A standard normal number of the place's own.
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

/// Where the relays stand at some time.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand {
    /// When.
    pub at: Instant,
    /// The relays that are on, by index from 1. A relay that went silent is not among them.
    pub nodes: Vec<u16>,
    /// Of each of them that has a place: where its drone is, or where it was told to be where drones are not simulated.
    pub places: Vec<Placement>,
    /// Where they were told to be, if all were.
    pub goals: Option<Vec<Placement>>,
    /// What the first relay believes.
    pub believed: Told,
    /// How many agreements there have been on other places than before.
    pub agreements: u32,
}
