//! Single relay with lateral room, compared with searches in f64 without theorems.

use std::collections::BTreeMap;

use chacha20::ChaCha8Rng;
use rand::SeedableRng;
use rayon::prelude::*;
use uav_relay_oracle::random::{self, count, log_uniform};
use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::joint::Corridor;
use uav_relay_tools::single::aside::{self, AsideCase};
use uav_relay_tools::single::{Found, theorems};

use super::ALLOWED;
use super::lateral_scene::LateralScene;
use super::scene::Scene;

/// Position of one relay by the theorems for one scene, compared with brute force.
struct SceneResult {
    /// Name of the theorem's case by which the solution was found.
    case: String,
    /// Fraction by which the solution's SIR is below the best SIR that brute force finds.
    short: f64,
    /// Relative error of the SIR that the solution states for its position.
    told: f64,
}

/// Checks in random scenes that the solutions of `best` are as good as brute force.
///
/// Returns how often each case of the solution occurred. `band` gives the range of altitudes, m, that brute force
/// searches.
fn no_worse_than_brute_force(
    seed: u64,
    draw: impl Fn(&mut ChaCha8Rng) -> LateralScene + Sync,
    band: impl Fn(&Scene) -> (f64, f64) + Sync,
    best: impl Fn(&Scene) -> (Found, AsideCase) + Sync,
) -> BTreeMap<String, u32> {
    let first = random::seed(seed) << 32;
    let look = |number: u64| {
        let drawn = draw(&mut ChaCha8Rng::seed_from_u64(first + number));
        let (found, case) = best(&drawn.scene);
        let ranges = drawn.ranges(band(&drawn.scene));
        let place = found.place;
        let place = [place.x_m, place.y_m, place.altitude_m].map(f64::from);
        for (value, (low, high)) in place.into_iter().zip(ranges) {
            assert!((low..=high).contains(&value), "{place:?} in {ranges:?}");
        }
        let (reached, most) = (drawn.sir_of(&found), drawn.brute(ranges));
        let case = format!("{case:?}");
        if !(most > 0.0) {
            assert_eq!(case, "Drowned");
            return SceneResult {
                case,
                short: 0.0,
                told: 0.0,
            };
        }
        let (short, told) = (1.0 - reached / most, f64::from(found.sir) / reached - 1.0);
        assert!(
            short <= ALLOWED && told.abs() <= 1e-5,
            "short by {short:e}, told {told:e} ({case}, {place:?}) in {ranges:?} {:?}",
            drawn.scene.link
        );
        SceneResult { case, short, told }
    };
    // Fewer scenes than in the theorems' tests, because the search is expensive.
    let seen: Vec<SceneResult> = (0..count(3_000) as u64).into_par_iter().map(look).collect();
    let mut cases = BTreeMap::new();
    for one in &seen {
        *cases.entry(one.case.clone()).or_insert(0) += 1;
    }
    let largest = |of: fn(&SceneResult) -> f64| seen.iter().map(of).fold(f64::MIN, f64::max);
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

type Draw = fn(&mut ChaCha8Rng) -> LateralScene;

/// Checks that the best position of a relay at a given altitude, with lateral offsets, is found.
///
/// The position is compared with brute force in random scenes. Every case of the solution must occur, except the
/// cases in `absent`.
fn at_its_altitude(seed: u64, draw: Draw, absent: &[&str]) {
    let seen = no_worse_than_brute_force(
        seed,
        draw,
        |scene| (scene.band.0, scene.band.0),
        |scene| aside::best_at(&scene.mission, scene.profile(scene.band.0)).unwrap(),
    );
    for case in CASES.iter().filter(|case| !absent.contains(case)) {
        assert!(seen.contains_key(*case), "{case}: {seen:?}");
    }
}

/// Checks that the best position of a relay at any altitude, with lateral offsets, is found.
///
/// The position is compared with brute force in random scenes. The cases of the solution in `cases` must occur.
fn anywhere(seed: u64, draw: Draw, cases: &[&str]) {
    let seen = no_worse_than_brute_force(
        seed,
        draw,
        |scene| scene.band,
        |scene| {
            let power_w = scene.mission.config().common.power_w;
            aside::best_place(&scene.mission, power_w).unwrap()
        },
    );
    for case in cases {
        assert!(seen.contains_key(*case), "{case}: {seen:?}");
    }
}

#[test]
fn a_relay_at_its_altitude_beats_brute_force() {
    at_its_altitude(511, LateralScene::random, &["Edge(Upward)"]);
}

#[test]
fn a_relay_at_its_altitude_in_noise_beats_brute_force() {
    at_its_altitude(531, LateralScene::noisy, &["Edge(Upward)", "Level"]);
}

#[test]
fn a_relay_aside_is_no_worse_than_brute_force() {
    anywhere(512, LateralScene::random, &CASES);
}

#[test]
fn a_relay_aside_in_noise_is_no_worse_than_brute_force() {
    let cases = CASES.into_iter().filter(|case| *case != "Level");
    let cases: Vec<&str> = cases.chain(["Wall", "Inside"]).collect();
    anywhere(532, LateralScene::noisy, &cases);
}

#[test]
fn one_relay_aside_has_the_recorded_optimum() {
    let (mut worst, mut best, mut below) = (0.0_f64, 0.0_f64, 0);
    let first = 513 << 32;
    for number in 0..300 {
        let drawn = LateralScene::random(&mut ChaCha8Rng::seed_from_u64(first + number));
        let (found, case) = aside::best_place(&drawn.scene.mission, drawn.power_w()).unwrap();
        let corridor = Corridor {
            least_m: drawn.scene.band.0,
            most_m: drawn.scene.band.1,
            left_m: drawn.lateral.0,
            right_m: drawn.lateral.1,
        };
        let Some(judged) = optimum(&drawn.scene.link, corridor, &[]).unwrap() else {
            assert_eq!(case, AsideCase::Drowned);
            continue;
        };
        let short = 1.0 - drawn.sir_of(&found) / judged.sir;
        assert!(
            short <= ALLOWED,
            "{short:e} ({case:?}) {:?}",
            drawn.scene.link
        );
        (worst, best) = (worst.max(short), best.max(-short));
        below += u32::from(short < -1e-6);
    }
    println!(
        "short of the judge by at most {worst:.1e}; the judge short {below} times, by at most {best:.1e}"
    );
}

/// Checks that the solution without lateral offsets agrees with Theorems 1 and 3. With lateral offsets its SIR must be at least as high.
#[test]
fn without_lateral_range_it_is_theorems_1_and_3() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(514));
    for _ in 0..10_000 {
        let scene = Scene::random(&mut rng);
        let d = scene.link.distance_m;
        let room = log_uniform(&mut rng, 1e-3, 1.0) * d;
        let none = LateralScene::new(scene, (0.0, 0.0));
        let profile = none.scene.profile(none.scene.band.0);
        let pairs = [
            (
                aside::best_at(&none.scene.mission, profile).unwrap().0,
                theorems::best_at_altitude(&none.scene.mission, profile)
                    .unwrap()
                    .0,
            ),
            (
                aside::best_place(&none.scene.mission, none.power_w())
                    .unwrap()
                    .0,
                theorems::best_free(&none.scene.mission, none.power_w())
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
        let more = LateralScene::new(none.scene, (-room, room));
        let (found, _) = aside::best_place(&more.scene.mission, more.power_w()).unwrap();
        assert!(more.sir_of(&found) >= least * (1.0 - ALLOWED));
    }
}
