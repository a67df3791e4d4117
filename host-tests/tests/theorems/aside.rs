//! One relay with room beside the line, against searches in f64 that know of no theorem.

use std::collections::BTreeMap;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use uav_relay::planning::single::aside::{self, AsideCase};
use uav_relay::planning::single::{Found, free, given_altitude};
use uav_relay::{Band, Mission, MissionConfig};
use uav_relay_oracle::random::{self, log_uniform};
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{Corridor, Effort, Place, optimum, sir};

use super::ALLOWED;
use super::scene::Scene;

/// A scene with room beside the line.
struct Roomy {
    scene: Scene,
    lateral: (f64, f64),
}

impl Roomy {
    fn new(scene: Scene, lateral: (f64, f64)) -> Self {
        let lateral = (lateral.0 as f32, lateral.1 as f32);
        let config = MissionConfig {
            lateral: Band {
                least_m: lateral.0,
                most_m: lateral.1,
            },
            ..*scene.mission.config()
        };
        let mission = Mission::try_new(config).unwrap();
        Self {
            scene: Scene { mission, ..scene },
            lateral: (f64::from(lateral.0), f64::from(lateral.1)),
        }
    }

    /// The same with noise.
    fn noisy(rng: &mut impl Rng) -> Self {
        let silent = Self::random(rng);
        let link = random::in_noise(rng, &silent.scene.link);
        Self::new(Scene::new(&link, silent.scene.band), silent.lateral)
    }

    /// As [`Scene::random`], some on the line or next to Tx or Rx; room to both sides, to one, or none.
    fn random(rng: &mut impl Rng) -> Self {
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

    fn power_w(&self) -> f32 {
        self.scene.mission.config().common.power_w
    }

    fn sir(&self, [x_m, y_m, altitude_m]: [f64; 3]) -> f64 {
        let place = Place {
            x_m,
            y_m,
            altitude_m,
        };
        sir(&self.scene.link, &[place]).unwrap()
    }

    fn sir_of(&self, found: &Found) -> f64 {
        let place = found.place;
        self.sir([place.x_m, place.y_m, place.altitude_m].map(f64::from))
    }

    fn ranges(&self, band: (f64, f64)) -> [(f64, f64); 3] {
        [(0.0, self.scene.link.distance_m), self.lateral, band]
    }

    /// The best SIR over the box: a grid over all of it, even and ever closer to where a hop begins or ends, and from each of
    /// its best places that are well apart a search with random steps.
    fn brute(&self, ranges: [(f64, f64); 3]) -> f64 {
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

    /// The best SIR of a search from `at`: steps in random directions, each axis with its own length, shorter and shorter ones
    /// where none is better. Steps along the axes alone would stay on the ridges on which the best places lie.
    fn about(&self, mut at: [f64; 3], ranges: [(f64, f64); 3]) -> f64 {
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

/// Places over a range: its ends, evenly, and about each of `near` ever closer.
fn marks((low, high): (f64, f64), near: &[f64]) -> Vec<f64> {
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

/// The scenes of this file's tests: those of the theorems' own are cheaper to search.
fn count() -> u64 {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(10_000)
}

/// What a scene showed.
struct Seen {
    case: String,
    short: f64,
    told: f64,
}

/// Holds what `best` finds over `band` of each scene against brute force, and counts the cases.
fn no_worse_than_brute_force(
    seed: u64,
    count: u64,
    draw: impl Fn(&mut ChaCha8Rng) -> Roomy + Sync,
    band: impl Fn(&Scene) -> (f64, f64) + Sync,
    best: impl Fn(&Scene) -> (Found, AsideCase) + Sync,
) -> BTreeMap<String, u32> {
    let first = random::seed(seed) << 32;
    let look = |number: u64| {
        let roomy = draw(&mut ChaCha8Rng::seed_from_u64(first + number));
        let (found, case) = best(&roomy.scene);
        let ranges = roomy.ranges(band(&roomy.scene));
        let place = found.place;
        let place = [place.x_m, place.y_m, place.altitude_m].map(f64::from);
        for (value, (low, high)) in place.into_iter().zip(ranges) {
            assert!((low..=high).contains(&value), "{place:?} in {ranges:?}");
        }
        let (reached, most) = (roomy.sir_of(&found), roomy.brute(ranges));
        let case = format!("{case:?}");
        if !(most > 0.0) {
            assert_eq!(case, "Drowned");
            return Seen {
                case,
                short: 0.0,
                told: 0.0,
            };
        }
        let (short, told) = (1.0 - reached / most, f64::from(found.sir) / reached - 1.0);
        assert!(
            short <= ALLOWED && told.abs() <= 1e-5,
            "short by {short:e}, told {told:e} ({case}, {place:?}) in {ranges:?} {:?}",
            roomy.scene.link
        );
        Seen { case, short, told }
    };
    let seen: Vec<Seen> = (0..count).into_par_iter().map(look).collect();
    let mut cases = BTreeMap::new();
    for one in &seen {
        *cases.entry(one.case.clone()).or_insert(0) += 1;
    }
    let largest = |of: fn(&Seen) -> f64| seen.iter().map(of).fold(f64::MIN, f64::max);
    println!(
        "{} scenes: short of brute force by at most {:.1e}, told off by {:.1e}; brute force fell short by more than 1e-4 in {}, by at most {:.1e}; {cases:?}",
        seen.len(),
        largest(|one| one.short),
        largest(|one| one.told.abs()),
        seen.iter().filter(|one| one.short < -ALLOWED).count(),
        largest(|one| -one.short),
    );
    cases
}

const CASES: [&str; 8] = [
    "AboveRx",
    "Drowned",
    "Edge(Across)",
    "Edge(Along)",
    "Edge(Upward)",
    "Hilltop",
    "Level",
    "Touching",
];

#[test]
fn a_relay_aside_at_its_altitude_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        511,
        count(),
        Roomy::random,
        |scene| (scene.band.0, scene.band.0),
        |scene| aside::best_at(&scene.mission, scene.profile(scene.band.0)).unwrap(),
    );
    for case in CASES.iter().filter(|case| **case != "Edge(Upward)") {
        assert!(seen.contains_key(*case), "{case}: {seen:?}");
    }
}

#[test]
fn a_relay_aside_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        512,
        count(),
        Roomy::random,
        |scene| scene.band,
        |scene| {
            let power_w = scene.mission.config().common.power_w;
            aside::best_place(&scene.mission, power_w).unwrap()
        },
    );
    for case in CASES {
        assert!(seen.contains_key(case), "{case}: {seen:?}");
    }
}

#[test]
fn a_relay_aside_at_its_altitude_in_noise_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        531,
        count(),
        Roomy::noisy,
        |scene| (scene.band.0, scene.band.0),
        |scene| aside::best_at(&scene.mission, scene.profile(scene.band.0)).unwrap(),
    );
    for case in CASES
        .iter()
        .filter(|case| !matches!(**case, "Edge(Upward)" | "Level"))
    {
        assert!(seen.contains_key(*case), "{case}: {seen:?}");
    }
}

#[test]
fn a_relay_aside_in_noise_is_no_worse_than_brute_force() {
    let seen = no_worse_than_brute_force(
        532,
        count(),
        Roomy::noisy,
        |scene| scene.band,
        |scene| {
            let power_w = scene.mission.config().common.power_w;
            aside::best_place(&scene.mission, power_w).unwrap()
        },
    );
    for case in CASES
        .iter()
        .copied()
        .chain(["Wall", "Inside"])
        .filter(|case| *case != "Level")
    {
        assert!(seen.contains_key(case), "{case}: {seen:?}");
    }
}

#[test]
fn the_judge_of_three_dimensions_agrees() {
    let (mut worst, mut best, mut below) = (0.0_f64, 0.0_f64, 0);
    let first = random::seed(513) << 32;
    for number in 0..300 {
        let roomy = Roomy::random(&mut ChaCha8Rng::seed_from_u64(first + number));
        let (found, case) = aside::best_place(&roomy.scene.mission, roomy.power_w()).unwrap();
        let corridor = Corridor {
            least_m: roomy.scene.band.0,
            most_m: roomy.scene.band.1,
            left_m: roomy.lateral.0,
            right_m: roomy.lateral.1,
        };
        let Some(judged) = optimum(&roomy.scene.link, corridor, &[], Effort::usual(number)) else {
            assert_eq!(case, AsideCase::Drowned);
            continue;
        };
        let short = 1.0 - roomy.sir_of(&found) / judged.sir;
        assert!(
            short <= ALLOWED,
            "{short:e} ({case:?}) {:?}",
            roomy.scene.link
        );
        (worst, best) = (worst.max(short), best.max(-short));
        below += u32::from(short < -1e-6);
    }
    println!(
        "short of the judge by at most {worst:.1e}; the judge short {below} times, by at most {best:.1e}"
    );
}

/// Without room it is Theorem 1, and Theorem 3; with room it is never worse.
#[test]
fn without_room_it_is_theorems_1_and_3() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(514));
    for _ in 0..10_000 {
        let scene = Scene::random(&mut rng);
        let d = scene.link.distance_m;
        let room = log_uniform(&mut rng, 1e-3, 1.0) * d;
        let none = Roomy::new(scene, (0.0, 0.0));
        let profile = none.scene.profile(none.scene.band.0);
        let pairs = [
            (
                aside::best_at(&none.scene.mission, profile).unwrap().0,
                given_altitude::best_place(&none.scene.mission, profile)
                    .unwrap()
                    .0,
            ),
            (
                aside::best_place(&none.scene.mission, none.power_w())
                    .unwrap()
                    .0,
                free::best_place(&none.scene.mission, none.power_w())
                    .unwrap()
                    .0,
            ),
        ];
        let near = |one: f64, other: f64| (one - other).abs() <= ALLOWED * other;
        let mut least = 0.0_f64;
        for (aside, theorem) in pairs {
            assert!(aside.place.y_m.abs() <= 0.0);
            let (aside, theorem) = (none.sir_of(&aside), none.sir_of(&theorem));
            assert!(
                near(aside, theorem),
                "{aside} {theorem} {:?}",
                none.scene.link
            );
            least = least.max(theorem);
        }
        let more = Roomy::new(none.scene, (-room, room));
        let (found, _) = aside::best_place(&more.scene.mission, more.power_w()).unwrap();
        assert!(more.sir_of(&found) >= least * (1.0 - ALLOWED));
    }
}
