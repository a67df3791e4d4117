//! Equal hops, extrema of SIR_1, and power ratios at which the cases change.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random;
use uav_relay_tools::single::extrema::{Extremum, first_hop_turn};
use uav_relay_tools::single::theorems;

use super::scene::Scene;

#[test]
fn the_locus_is_where_the_hops_are_equal() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(504));
    let mut roots = [0_u32; 3];
    for draw in 0..30_000 {
        let mut scene = if draw % 3 > 0 {
            Scene::random(&mut rng)
        } else {
            Scene::noisy(&mut rng)
        };
        let x = f64::from(rng.random_range(0.0..=scene.link.distance_m) as f32);
        let power_w = scene.mission.config().common.power_w;
        let found = theorems::equal_altitudes(&scene.mission, x as f32, power_w);
        let difference = |scene: &mut Scene, h: f64| {
            scene.link.relays[0].altitude_m = h;
            let first = scene.link.sir_relay(1, 0.0, x).unwrap();
            first / scene.link.sir_rx(x).unwrap() - 1.0
        };
        for h in found.into_iter().flatten() {
            let here = difference(&mut scene, f64::from(h));
            let beside = difference(&mut scene, f64::from(h) * (1.0 + 3e-7))
                - difference(&mut scene, f64::from(h) * (1.0 - 3e-7));
            // At a double root the difference touches zero, and f64 has half its digits there.
            assert!(
                here.abs() <= beside.abs() + 1e-6,
                "{x} {h}: {here:e} in {:?}",
                scene.link
            );
        }
        // The difference changes its sign at no other position.
        let found: Vec<f64> = found.into_iter().flatten().map(f64::from).collect();
        roots[found.len()] += 1;
        let mut before: Option<(f64, f64)> = None;
        for step in 0..200 {
            let h = scene.link.distance_m * 10_f64.powf(f64::from(step) * 0.05 - 6.0);
            let here = difference(&mut scene, h);
            if !here.is_finite() {
                continue;
            }
            if let Some((low, old)) = before
                && (old > 0.0) != (here > 0.0)
            {
                let between = |root: &&f64| (low * 0.999_999..=h * 1.000_001).contains(*root);
                assert!(
                    found.iter().any(|root| between(&root)),
                    "{x}: a root in {low} to {h}"
                );
            }
            before = Some((h, here));
        }
    }
    println!("places with 0, 1 and 2 altitudes: {roots:?}");
    assert!(roots.iter().all(|&seen| seen > 100), "{roots:?}");
}

#[test]
fn turns_agree_with_a_scan() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(505));
    let mut seen = [0_u32; 5];
    for draw in 0..40_000 {
        let scene = if draw % 2 == 0 {
            Scene::random(&mut rng)
        } else {
            Scene::noisy(&mut rng)
        };
        let (link, h) = (&scene.link, scene.band.0);
        let sir = |x: f64| link.sir_relay(1, 0.0, x).unwrap();
        // The tolerance is f64 rounding: next to Tx an interferer leaves SIR_1 almost constant.
        let rises = |x: f64, by: f64| sir(x * (1.0 + by)) > sir(x * (1.0 - by)) * (1.0 + 1e-14);
        match first_hop_turn(
            &scene.mission,
            scene.mission.interferer().unwrap(),
            h as f32,
        ) {
            // The minimum is too far away for f64 to resolve it.
            Extremum::Valley(x) if f64::from(x) > 100.0 * link.distance_m => {
                for part in [0.01, 0.3, 1.0, 3.0] {
                    assert!(!rises(link.distance_m * part, 1e-3), "{link:?}");
                }
            }
            Extremum::Valley(x) => {
                let x = f64::from(x);
                assert!(
                    sir(x) <= sir(x * 0.999) && sir(x) <= sir(x * 1.001),
                    "{link:?}"
                );
                assert!(!rises(x * 0.9, 1e-3), "{link:?}");
                assert!(rises(x * 1.1, 1e-3) || x > link.distance_m, "{link:?}");
                seen[0] += 1;
            }
            Extremum::Hill(x) => {
                let x = f64::from(x);
                // With the interferer almost beside Tx the maximum is flatter than f64 resolves.
                let top = sir(x) * (1.0 + 1e-14);
                assert!(top >= sir(x * 0.999) && top >= sir(x * 1.001), "{link:?}");
                seen[1] += 1;
            }
            Extremum::ValleyAndHill(low, high) => {
                let (low, high) = (f64::from(low), f64::from(high));
                let bottom = sir(low) * (1.0 - 1e-14);
                assert!(low < high, "{link:?}");
                assert!(
                    bottom <= sir(low * 0.999) && bottom <= sir(low * 1.001),
                    "{link:?}"
                );
                let top = sir(high) * (1.0 + 1e-14);
                assert!(
                    top >= sir(high * 0.999) && top >= sir(high * 1.001),
                    "{link:?}"
                );
                assert!(
                    !rises(low * 0.9, 1e-3) && !rises(high * 1.1, 1e-3),
                    "{link:?}"
                );
                seen[4] += 1;
            }
            Extremum::Falls => {
                for part in [0.01, 0.3, 1.0, 3.0] {
                    assert!(!rises(link.distance_m * part, 1e-3), "{link:?}");
                }
                seen[2] += 1;
            }
            Extremum::Level => {
                assert!((sir(0.0) / sir(link.distance_m) - 1.0).abs() < 1e-12);
                seen[3] += 1;
            }
        }
    }
    assert!(seen.iter().all(|&seen| seen > 50), "{seen:?}");
}

/// Checks that the ratio of Tx's power to the relay's, p_t / p_u, predicts the case of Corollary 1. The ratio is
/// compared with the limits C_1 to C_3. The interferer's x is between Tx and Rx.
#[test]
fn the_guide_agrees_with_the_cases() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(506));
    let mut seen = [0_u32; 6];
    for _ in 0..50_000 {
        let scene = Scene::random(&mut rng);
        let link = &scene.link;
        if !(link.x_i > 0.0 && link.x_i < link.distance_m) {
            continue;
        }
        let (low, d) = (scene.band.0, link.distance_m);
        let guide = theorems::power_ratios(&scene.mission, low as f32).unwrap();
        let (x, y2, h2) = (link.x_i, link.y_i * link.y_i, low * low);
        // Formulas as printed in the paper.
        let kappa = link.mu_nlos / link.eta;
        let at_rx = y2 + (d - x) * (d - x);
        let c1 = kappa * at_rx * h2 / ((x * x + y2 + h2) * (d * d + h2));
        let c2 = kappa * at_rx * (d * d + h2) / (h2 * (at_rx + h2));
        let q = x * x + y2;
        let psi = (q + (q * q + 4.0 * x * x * h2).sqrt()) / (2.0 * x);
        let c3 = kappa * (psi * psi + h2) * at_rx
            / (((psi - x) * (psi - x) + y2 + h2) * ((d - psi) * (d - psi) + h2));
        let c3_told = f64::from(guide.c3.unwrap());
        let told = [f64::from(guide.c1), f64::from(guide.c2), c3_told];
        for (told, printed) in told.into_iter().zip([c1, c2, c3]) {
            assert!(
                (told / printed - 1.0).abs() < 1e-4,
                "{told} {printed} {link:?}"
            );
        }
        let ratio = link.tx_w / link.relays[0].power_w;
        // On the border of two cases f32 may choose either; their positions are equal there.
        let border = [psi / d, ratio / c1, ratio / c2, ratio / c3];
        if border.iter().any(|at| (at - 1.0).abs() < 1e-4) {
            continue;
        }
        let case = match (psi >= d, ratio) {
            (_, ratio) if ratio < c1 => 1,
            (true, ratio) if ratio <= c2 => 2,
            (true, _) => 3,
            (false, ratio) if ratio <= c3 => 4,
            (false, _) => 5,
        };
        let (_, found) = theorems::best_at_altitude(&scene.mission, scene.profile(low)).unwrap();
        assert_eq!(found.printed(), case, "{link:?}");
        seen[usize::from(case)] += 1;
    }
    assert!(seen[1..].iter().all(|&seen| seen > 100), "{seen:?}");
}
