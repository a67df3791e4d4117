//! Closed forms of one relay for both directions, compared with an independent scan in f64.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::scene::{Relay, Scene};
use uav_relay_scenario::{Scenario, Source};
use uav_relay_tools::plan::one_both_ways::best;

/// Returns the smallest of the four linear SIRs of a relay at `x`: of both hops in both directions.
///
/// An SIR toward Tx is first divided by `reverse`.
fn worst(scene: &Scene, reverse: f64, x: f64) -> f64 {
    let places = [(x, scene.relays[0].altitude_m)];
    let least = |sirs: Vec<f64>| sirs.into_iter().fold(f64::INFINITY, f64::min);
    least(scene.hop_sirs(&places)).min(least(scene.hop_sirs_back(&places)) / reverse)
}

#[test]
fn one_relay_both_ways() {
    let mut rng = ChaCha8Rng::seed_from_u64(3351);
    let mut cases = [0; 4];
    for round in 0..super::number("COUNT", 30) * 10 {
        let log =
            |rng: &mut ChaCha8Rng, low: f64, high: f64| rng.random_range(low.ln()..high.ln()).exp();
        let reverse = if round % 2 == 0 {
            1.0
        } else {
            log(&mut rng, 0.01, 1.0)
        };
        let mut scene = Scene::new(&Scenario::default(), 1).unwrap();
        scene.tx_w = log(&mut rng, 0.1, 100.0);
        scene.rx_w = log(&mut rng, 0.1, 100.0);
        scene.relays = vec![Relay {
            altitude_m: log(&mut rng, 2.0, 300.0),
            power_w: log(&mut rng, 0.1, 10.0),
            holds: false,
        }];
        scene.sources = vec![Source {
            power_w: log(&mut rng, 0.1, 100.0),
            x_m: rng.random_range(-300.0..1300.0),
            y_m: log(&mut rng, 1.0, 800.0),
        }];
        if round % 3 == 0 {
            let heard_w = scene.interference_w((500.0, 20.0));
            scene.noise_w = heard_w * log(&mut rng, 1e-3, 1e2);
        }
        let found = best(&scene, reverse).unwrap();
        let sir = worst(&scene, reverse, found.x_m);
        let scanned = (0..=4_000)
            .map(|i| worst(&scene, reverse, f64::from(i) * 0.25))
            .fold(0.0, f64::max);
        assert!(
            sir >= scanned * (1.0 - 1e-9),
            "{found:?}: {sir} {scanned} in {scene:?}"
        );
        assert!(sir <= scanned * 1.01, "{found:?}: {sir} {scanned}");
        assert!(found.words.starts_with("the drone "));
        cases[usize::from(found.case) - 1] += 1;
    }
    println!("cases {cases:?}");
    assert!(cases.iter().all(|count| *count > 0), "{cases:?}");
}
