//! Hypothetical interferer in known cases: published values, one source, sources at one position.

use std::time::Instant;

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::SeedableRng;
use uav_relay_oracle::cases::{self, Case};
use uav_relay_oracle::random::seed;
use uav_relay_scenario::hypothetical::{Raster, fit, hypothetical};
use uav_relay_scenario::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Scenario, Source};

use super::above;
use super::scenes::{level, scene};

fn of_case(case: &Case) -> Scene {
    let p = &case.params;
    let sources: Vec<[f64; 3]> = serde_json::from_value(case.args["sources"].clone()).unwrap();
    let sources = sources
        .iter()
        .map(|&[x_m, y_m, power_w]| Source { power_w, x_m, y_m });
    let scenario = Scenario {
        distance_m: p.d,
        altitude_m: p.h,
        altitude_min_m: p.h_min,
        altitude_max_m: p.h_max,
        interference: Interference::Sources(sources.collect()),
        ..Scenario::default()
    };
    Scene::new(&scenario, 1).unwrap()
}

fn count(case: &Case, name: &str) -> u32 {
    case.args[name].as_u64().unwrap().try_into().unwrap()
}

/// Compares the single interferer that is fitted to several with the result of a separate program.
///
/// That program computes the error of the fit as a sum over a grid of nx times nh points.
#[test]
fn the_fit_agrees_with_the_reference_program() {
    let cases = cases::of("hyp_msi").unwrap();
    assert_eq!(cases.len(), 2);
    for case in cases {
        let scene = of_case(&case);
        let raster = Raster::even(&scene, count(&case, "nx"), count(&case, "nh"));
        let part = |name| case.part(name).unwrap();
        let theirs = raster.best_power(part("xH"), part("yH"));
        assert!(above(theirs.error, part("err")).abs() < 1e-12);
        assert!(above(theirs.power_w, part("pH")).abs() < 1e-12);
        assert!(above(theirs.error / raster.total(), part("rel_err")).abs() < 1e-12);
        let on_theirs = fit(&scene, &raster).unwrap();
        let ours = hypothetical(&scene).unwrap();
        let fine = Raster::graded(&scene, None, 500_000);
        let truly = |x, y| fine.best_power(x, y).error;
        let gained = above(truly(ours.x_m, ours.y_m), truly(part("xH"), part("yH")));
        let there = above(raster.best_power(ours.x_m, ours.y_m).error, part("err"));
        println!(
            "{}: on its raster {:.1e} above its error; by our raster {there:.1e}, and {gained:.1e} on a fine one; {ours:?}",
            case.id,
            above(on_theirs.best_power.error, part("err")),
        );
        assert!(above(on_theirs.best_power.error, part("err")) < 1e-9);
        assert!(there < 1e-5 && gained < 1e-7);
        assert!(above(ours.relative_error, part("rel_err")).abs() < case.rtol);
        let mean = part("err") / (case.params.d * (case.params.h_max - case.params.h_min));
        assert!(above(ours.mean_abs_error_w, mean / case.params.eta).abs() < case.rtol);
    }
}

#[test]
fn one_source_is_its_own_hypothetical_interferer() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(72));
    for _ in 0..12 {
        let scene = scene(&mut rng, 1..=1, 1..=1);
        let source = &scene.sources[0];
        let found = hypothetical(&scene).unwrap();
        assert!(found.relative_error < 1e-9, "{found:?} for {source:?}");
        assert!(above(found.power_w, source.power_w).abs() < 1e-6);
        assert!((found.x_m - source.x_m).abs() < 1e-6 * scene.distance_m);
        assert!((found.y_m - source.y_m.abs()).abs() < 1e-6 * scene.distance_m);
        assert_eq!(found.source().y_m, found.y_m);
    }
}

#[test]
fn equal_sources_at_one_position_are_one_of_their_sum() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(73));
    for copies in 2..=5_u32 {
        let mut scene = scene(&mut rng, 1..=1, 1..=1);
        let mut source = scene.sources[0].clone();
        for _ in 1..copies {
            // The other side of the line is at the same distance.
            source.y_m = -source.y_m;
            scene.sources.push(source.clone());
        }
        let found = hypothetical(&scene).unwrap();
        assert!(found.relative_error < 1e-9, "{found:?}");
        assert!(above(found.power_w, source.power_w * f64::from(copies)).abs() < 1e-6);
    }
}

/// Checks that a fitted interferer and its stated error hardly change on a much finer raster. Prints the computing time
/// of each fit.
#[test]
fn the_rasters_are_fine_enough() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(74));
    let (mut search, mut report) = (0.0_f64, 0.0_f64);
    for at in 0..8 {
        let scene = scene(&mut rng, 1..=1, 2..=5);
        let scene = if at % 3 == 0 { level(scene) } else { scene };
        let started = Instant::now();
        let found = hypothetical(&scene).unwrap();
        println!("{} sources: {:?}", scene.sources.len(), started.elapsed());
        let error = |most, also| {
            let raster = Raster::graded(&scene, also, most);
            raster.best_power(found.x_m, found.y_m).error / raster.total()
        };
        let best = error(600_000, Some((found.x_m, found.y_m)));
        search = search.max(above(error(4_000, None), best).abs());
        report = report.max(above(found.relative_error, best).abs());
    }
    println!(
        "largest relative error of the search's raster {search:.1e}, of what is reported {report:.1e}"
    );
    assert!(search < 1e-3 && report < 3e-5);
}

/// Checks that an interferer can be fitted in scenarios at the limits of the permitted ranges.
#[test]
fn extreme_scenes_have_a_finite_fit() {
    let of = |d: f64, h: (f64, f64), sources: &[(f64, f64, f64)]| {
        let sources = sources
            .iter()
            .map(|&(x_m, y_m, power_w)| Source { power_w, x_m, y_m });
        let scenario = Scenario {
            distance_m: d,
            altitude_m: h.0,
            altitude_min_m: h.0,
            altitude_max_m: h.1,
            interference: Interference::Sources(sources.collect()),
            ..Scenario::default()
        };
        Scene::new(&scenario, 1).unwrap()
    };
    let crowd: Vec<(f64, f64, f64)> = (0..60)
        .map(|i| (f64::from(i) * 17.0, 0.0, 1.0 + f64::from(i)))
        .collect();
    let scenes = [
        of(1e6, (0.1, 1e5), &[(1e3, 0.0, 1e9), (9e5, 0.0, 1e-6)]),
        of(1e6, (0.1, 0.1), &[(1e3, 0.0, 1.0), (9e5, 0.0, 1.0)]),
        of(1.0, (0.1, 1e5), &[(-1e7, 0.0, 1.0), (1e7, 1e7, 1.0)]),
        of(1.0, (1e5, 1e5), &[(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)]),
        of(
            1000.0,
            (20.0, 300.0),
            &[(-500.0, 0.0, 1.0), (1500.0, 0.0, 1.0)],
        ),
        of(1000.0, (20.0, 300.0), &crowd),
    ];
    for scene in scenes {
        let started = Instant::now();
        let found = hypothetical(&scene).unwrap();
        println!("{:?}: {found:?}", started.elapsed());
        assert!((0.0..1.0).contains(&found.relative_error), "{found:?}");
        assert!(found.power_w > 0.0 && found.power_w.is_finite());
        assert!(found.mean_abs_error_w.is_finite());
        let xs = || scene.sources.iter().map(|source| source.x_m);
        let (low, high) = (
            xs().fold(0.0, f64::min),
            xs().fold(scene.distance_m, f64::max),
        );
        assert!((low..=high).contains(&found.x_m));
        assert!((0.0..=1e9).contains(&found.y_m));
    }
    let nobody = Scene {
        sources: Vec::new(),
        ..of(1.0, (0.1, 0.1), &[(0.0, 0.0, 1.0)])
    };
    assert_eq!(hypothetical(&nobody), None);
}

/// Checks that the fitted interferer is on the same side of the line as the true interferers. Lateral offsets are
/// permitted here. If no lateral offsets were permitted, the y of the fitted interferer would always be positive.
#[test]
fn with_lateral_range_the_fit_is_on_the_right_side() {
    let source = |x_m: f64, y_m: f64| make::source(50.0, x_m, y_m);
    for side in [-1.0, 1.0] {
        let scenario = Scenario {
            lateral_min_m: -200.0,
            lateral_max_m: 150.0,
            interference: Interference::Sources(vec![
                source(300.0, side * 250.0),
                source(700.0, side * 120.0),
                source(500.0, side * -900.0),
            ]),
            ..Scenario::default()
        };
        let one = mission::hypothetical(&scenario).unwrap();
        assert!(one.y_m * side > 50.0, "{one:?}");
        let (mission, _) = mission::mission(&scenario, 4, 1e-4).unwrap();
        let told = f64::from(mission.interferer().unwrap().y_m);
        assert!((told / one.y_m - 1.0).abs() < 1e-6, "{told} {one:?}");
        let level = Scenario {
            lateral_min_m: 0.0,
            lateral_max_m: 0.0,
            ..scenario
        };
        assert!(mission::hypothetical(&level).unwrap().y_m > 0.0);
    }
}
