//! Hypothetical interferer compared with random positions at their best power.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::{log_uniform, seed};
use uav_relay_scenario::hypothetical::{Raster, fit};

use super::above;
use super::scenes::scene;

/// Number of random positions tried in each scene for the single interferer that stands for several.
const DRAWN: usize = 20_000;

/// Number of best drawn positions of the interferer whose error is computed again on the fine raster.
///
/// The first comparison of all drawn positions uses a coarse raster, because it is faster.
const WEIGHED: usize = 100;

#[test]
fn no_random_position_fits_better() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(75));
    let mut nearest = f64::INFINITY;
    for at in 0..20 {
        let scene = scene(&mut rng, 1..=1, 2..=5);
        let raster = Raster::graded(&scene, None, 2_000);
        let found = fit(&scene, &raster).unwrap();
        let rough = Raster::graded(&scene, None, 150);
        let d = scene.distance_m;
        let xs = || scene.sources.iter().map(|source| source.x_m);
        let (low, high) = (xs().fold(0.0, f64::min), xs().fold(d, f64::max));
        let mut drawn: Vec<(f64, f64, f64)> = (0..DRAWN)
            .map(|_| {
                let x = rng.random_range(low..=high);
                let y = log_uniform(&mut rng, 1e-3 * d, 10.0 * d);
                (rough.best_power(x, y).error, x, y)
            })
            .collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = drawn
            .iter()
            .take(WEIGHED)
            .map(|&(_, x, y)| raster.best_power(x, y).error)
            .fold(f64::INFINITY, f64::min);
        let margin = above(best, found.best_power.error);
        nearest = nearest.min(margin);
        assert!(
            margin > -1e-9,
            "scene {at}: {best} below {found:?} in {scene:?}"
        );
    }
    println!("the best of the random places came within {nearest:.1e} of the fit");
    assert!(nearest < 0.01, "the draw is too coarse to tell anything");
}
