//! Scene with room above and to the sides, and its optimum by brute force.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay::{Mission, MissionConfig};
use uav_relay_oracle::random::{self};
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{Place, sir};
use uav_relay_tools::single::Found;

use super::scene::Scene;

pub(crate) struct LateralScene {
    pub(crate) scene: Scene,
    pub(crate) lateral: (f64, f64),
}

impl LateralScene {
    pub(crate) fn new(scene: Scene, lateral: (f64, f64)) -> Self {
        let lateral = (lateral.0 as f32, lateral.1 as f32);
        let config = MissionConfig {
            lateral: make::band(lateral.0, lateral.1),
            ..*scene.mission.config()
        };
        let mission = Mission::try_new(config).unwrap();
        Self {
            scene: Scene { mission, ..scene },
            lateral: (f64::from(lateral.0), f64::from(lateral.1)),
        }
    }

    /// Draws a scene with a range of lateral offsets and with receiver noise.
    pub(crate) fn noisy(rng: &mut impl Rng) -> Self {
        let silent = Self::random(rng);
        let link = random::in_noise(rng, &silent.scene.link);
        Self::new(Scene::new(&link, silent.scene.band), silent.lateral)
    }

    /// Draws a scene with lateral offsets to both sides, to one side, or none. Some interferers are on the line or at
    /// one of its ends.
    pub(crate) fn random(rng: &mut impl Rng) -> Self {
        let mut scene = Scene::random(rng);
        let d = scene.link.distance_m;
        let near = |rng: &mut dyn FnMut() -> f64| d * (rng() - 0.5) * 0.02;
        let mut draw = || rng.random_range(0.0..1.0);
        let kind = draw();
        let link = match kind {
            _ if kind < 0.1 => Link {
                y_i: 0.0,
                ..scene.link.clone()
            },
            _ if kind < 0.2 => Link {
                x_i: near(&mut draw),
                y_i: near(&mut draw),
                ..scene.link.clone()
            },
            _ if kind < 0.3 => Link {
                x_i: d + near(&mut draw),
                y_i: near(&mut draw),
                ..scene.link.clone()
            },
            _ => scene.link.clone(),
        };
        scene = Scene::new(&link, scene.band);
        let room = |rng: &mut dyn FnMut() -> f64| (d * 10_f64.powf(3.0 * rng() - 2.5)).min(1e5);
        let lateral = match draw() {
            kind if kind < 0.25 => (-room(&mut draw), 0.0),
            kind if kind < 0.5 => (0.0, room(&mut draw)),
            kind if kind < 0.55 => (0.0, 0.0),
            _ => (-room(&mut draw), room(&mut draw)),
        };
        Self::new(scene, lateral)
    }

    pub(crate) fn power_w(&self) -> f32 {
        self.scene.mission.config().common.power_w
    }

    pub(crate) fn sir(&self, [x_m, y_m, altitude_m]: [f64; 3]) -> f64 {
        let place = Place {
            x_m,
            y_m,
            altitude_m,
        };
        sir(&self.scene.link, &[place]).unwrap()
    }

    pub(crate) fn sir_of(&self, found: &Found) -> f64 {
        let place = found.place;
        self.sir([place.x_m, place.y_m, place.altitude_m].map(f64::from))
    }

    pub(crate) fn ranges(&self, band: (f64, f64)) -> [(f64, f64); 3] {
        [(0.0, self.scene.link.distance_m), self.lateral, band]
    }

    /// Returns the best SIR in ranges of x, y and altitude, by brute force: a grid, then random searches. The random searches begin at the
    /// best points of the grid that are far from each other.
    pub(crate) fn brute(&self, ranges: [(f64, f64); 3]) -> f64 {
        let link = &self.scene.link;
        let of = [
            marks(ranges[0], &[0.0, link.distance_m, link.x_i]),
            marks(ranges[1], &[0.0, link.y_i]),
            marks(ranges[2], &[ranges[2].0]),
        ];
        let mut seen: Vec<(f64, [f64; 3])> = Vec::new();
        for &x in &of[0] {
            for &y in &of[1] {
                let over = |h: &f64| (self.sir([x, y, *h]), [x, y, *h]);
                seen.extend(of[2].iter().map(over));
            }
        }
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut starts: Vec<[f64; 3]> = Vec::new();
        let apart = |a: &[f64; 3], b: &[f64; 3]| {
            (0..3).any(|axis| {
                let (low, high) = ranges[axis];
                (a[axis] - b[axis]).abs() > 0.1 * (high - low)
            })
        };
        for (_, at) in seen {
            if starts.len() < 5 && starts.iter().all(|start| apart(start, &at)) {
                starts.push(at);
            }
        }
        starts
            .into_iter()
            .map(|at| self.about(at, ranges))
            .fold(0.0, f64::max)
    }

    /// Returns the best SIR that a random search from `at` finds. The search moves along all axes at the same time,
    /// because a search along one axis at a time would not get along a ridge.
    pub(crate) fn about(&self, mut at: [f64; 3], ranges: [(f64, f64); 3]) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut most = self.sir(at);
        let mut reach = 0.2;
        for _ in 0..300 {
            let before = most;
            for _ in 0..20 {
                let mut to = at;
                for (value, (low, high)) in to.iter_mut().zip(ranges) {
                    if low < high {
                        let part = rng.random_range(-1.0..1.0_f64);
                        let part = part * part.abs() * part.abs();
                        *value = (*value + (high - low) * reach * part).clamp(low, high);
                    }
                }
                let here = self.sir(to);
                if here > most {
                    (most, at) = (here, to);
                }
            }
            reach *= if most > before { 1.1 } else { 0.8 };
        }
        most
    }
}

/// Returns sample points of the range `low` to `high`. They are its ends, equidistant points, and denser points around each value of
/// `near`.
pub(crate) fn marks((low, high): (f64, f64), near: &[f64]) -> Vec<f64> {
    let mut at = vec![low, high];
    for step in 1..12 {
        at.push(low + (high - low) * f64::from(step) / 12.0);
    }
    for middle in near {
        for step in 1..=4 {
            let off = (high - low) * 10_f64.powf(-0.9 * f64::from(step));
            at.extend([middle - off, middle + off]);
        }
    }
    at.retain(|value| (low..=high).contains(value));
    at.sort_by(f64::total_cmp);
    at.dedup();
    at
}
