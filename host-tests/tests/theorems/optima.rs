//! Theorems 1 to 3, and the noise-limited case, compared with brute force.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::{self, count, log_uniform};
use uav_relay_tools::single::{Found, theorems, without_interferer};

use super::ALLOWED;
use super::scene::Scene;

/// Checks in random scenes that the solutions of `best` are as good as brute force.
///
/// Returns how often each case of the solution occurred. `over` gives the ranges of x and altitude, m, that brute
/// force searches.
fn no_worse_than_brute_force(
    seed: u64,
    draw: impl Fn(&mut ChaCha8Rng) -> Scene,
    over: impl Fn(&mut ChaCha8Rng, &Scene) -> ((f64, f64), (f64, f64)),
    best: impl Fn(&Scene, (f64, f64), (f64, f64)) -> (Found, String),
) -> std::collections::BTreeMap<String, u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(seed));
    let mut seen = std::collections::BTreeMap::new();
    let (mut worst, mut above, mut missed) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..count(100_000) {
        let mut scene = draw(&mut rng);
        let (x, h) = over(&mut rng, &scene);
        let (found, case) = best(&scene, x, h);
        let place = found.place;
        assert!((x.0..=x.1).contains(&f64::from(place.x_m)), "{place:?}");
        assert!(
            (h.0..=h.1).contains(&f64::from(place.altitude_m)),
            "{place:?}"
        );
        let reached = scene.sir_of(&found);
        let most = scene.brute(x, h);
        let short = 1.0 - reached / most;
        assert!(
            most <= 0.0 || short <= ALLOWED,
            "short by {short:e} ({case}) in {:?} {:?}",
            scene.link,
            scene.band
        );
        let told = (f64::from(found.sir) / reached - 1.0).abs();
        assert!(
            most <= 0.0 || told <= 1e-5,
            "told {told:e} in {:?}",
            scene.link
        );
        if most > 0.0 {
            worst = worst.max(short);
            above = above.max(-short);
            missed += u32::from(short < -1e-6);
        }
        *seen.entry(case).or_insert(0) += 1;
    }
    println!(
        "short of brute force by at most {worst:.1e}; brute force fell short {missed} times, by at most {above:.1e}; {seen:?}"
    );
    seen
}

type Draw = fn(&mut ChaCha8Rng) -> Scene;
type Cases = std::collections::BTreeMap<String, u32>;

fn theorem_1(seed: u64, draw: Draw) -> Cases {
    no_worse_than_brute_force(
        seed,
        draw,
        |_, scene| ((0.0, scene.link.distance_m), (scene.band.0, scene.band.0)),
        |scene, _, h| {
            let profile = scene.profile(h.0);
            let (found, case) = theorems::best_at_altitude(&scene.mission, profile).unwrap();
            (found, format!("{case:?}"))
        },
    )
}

fn theorem_2(seed: u64, draw: Draw) -> Cases {
    no_worse_than_brute_force(
        seed,
        draw,
        |rng, scene| {
            let d = scene.link.distance_m;
            let x = match rng.random_range(0..8) {
                0 => 0.0,
                1 => d,
                _ => f64::from(rng.random_range(0.0..=d) as f32).min(d),
            };
            ((x, x), scene.band)
        },
        |scene, x, _| {
            let power_w = scene.mission.config().common.power_w;
            let (found, case) = theorems::best_at_x(&scene.mission, x.0 as f32, power_w).unwrap();
            (found, format!("{case:?}"))
        },
    )
}

/// Checks that Theorem 3 gives the best position of a relay, by brute force in random scenes.
///
/// The theorem's cases in `edges` must occur.
fn theorem_3(seed: u64, draw: Draw, edges: &[&str]) {
    let seen = no_worse_than_brute_force(
        seed,
        draw,
        |_, scene| ((0.0, scene.link.distance_m), scene.band),
        |scene, _, _| {
            let power_w = scene.mission.config().common.power_w;
            let (found, case) = theorems::best_free(&scene.mission, power_w).unwrap();
            (found, format!("{case:?}"))
        },
    );
    for edge in edges {
        let is_seen = seen.keys().any(|case| case.starts_with(edge));
        assert!(is_seen, "{edge}: {seen:?}");
    }
}

#[test]
fn theorem_1_is_no_worse_than_brute_force() {
    let seen = theorem_1(501, Scene::random);
    assert_eq!(seen.len(), 10, "every case: {seen:?}");
}

#[test]
fn theorem_1_in_noise_is_no_worse_than_brute_force() {
    let seen = theorem_1(521, Scene::noisy);
    // Every case occurs but a constant SIR_1, and the one that noise adds.
    assert_eq!(seen.len(), 10, "every case: {seen:?}");
    assert!(!seen.contains_key("Level") && seen.contains_key("SecondHill"));
}

#[test]
fn theorem_2_is_no_worse_than_brute_force() {
    let seen = theorem_2(502, Scene::random);
    assert_eq!(seen.len(), 4, "every case: {seen:?}");
}

#[test]
fn theorem_2_in_noise_is_no_worse_than_brute_force() {
    let seen = theorem_2(522, Scene::noisy);
    assert_eq!(seen.len(), 4, "every case: {seen:?}");
}

#[test]
fn theorem_3_is_no_worse_than_brute_force() {
    theorem_3(503, Scene::random, &["Lowest", "Highest", "AboveRx"]);
}

#[test]
fn theorem_3_in_noise_is_no_worse_than_brute_force() {
    let edges = ["Lowest", "Highest", "AboveRx", "Touching"];
    theorem_3(523, Scene::noisy, &edges);
}

#[test]
fn one_relay_in_noise_is_no_worse_than_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(507));
    let (mut worst, mut middle) = (0.0_f64, 0);
    for _ in 0..20_000 {
        let scene = Scene::random(&mut rng);
        let noise = without_interferer::Noise {
            relay_w: log_uniform(&mut rng, 1e-16, 1e-10) as f32,
            receiver_w: log_uniform(&mut rng, 1e-16, 1e-10) as f32,
        };
        let found =
            without_interferer::best_in_noise(&scene.mission, scene.profile(scene.band.0), noise);
        let link = &scene.link;
        let snr = |x: f64| {
            let h2 = scene.band.0 * scene.band.0;
            let gap = link.distance_m - x;
            let first = link.tx_w / (link.eta * (x * x + h2) * f64::from(noise.relay_w));
            let power_w = link.relays[0].power_w;
            first.min(power_w / (link.eta * (gap * gap + h2) * f64::from(noise.receiver_w)))
        };
        // One SNR falls and the other rises: their minimum has a single maximum, which ternary search finds.
        let (mut low, mut high) = (0.0, link.distance_m);
        for _ in 0..120 {
            let third = (high - low) / 3.0;
            if snr(low + third) < snr(high - third) {
                low += third;
            } else {
                high -= third;
            }
        }
        let reached = snr(f64::from(found.place.x_m));
        worst = worst.max(1.0 - reached / snr(low));
        assert!((f64::from(found.sir) / reached - 1.0).abs() < 1e-5);
        let end = link.distance_m as f32;
        middle += u32::from(found.place.x_m > 0.0 && found.place.x_m < end);
    }
    println!("short by at most {worst:.1e}; {middle} between Tx and Rx");
    assert!(worst < ALLOWED && middle > 2000);
}
