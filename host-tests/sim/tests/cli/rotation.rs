//! Replacement of drones whose batteries run low.

use super::json;

/// Minimum separation of the default scenario, m.
const SEPARATION_M: f64 = 4.0;
/// Bound on the error of a reported position per axis, m: sum of the constant and the random part.
const ERROR_M: f64 = 0.8;

#[test]
fn a_fleet_of_twelve_replaces_its_tired_drones() {
    for seed in 1..=3 {
        let report = json(&format!(
            "--fly --fleet 12 --flying 8 --endurance 1500 --ground-time 180 --soak 1800 --seed {seed}"
        ));
        let figures = &report["rotation"];
        println!("seed {seed}: {figures:#}");
        for kind in ["announced", "unannounced"] {
            assert_eq!(figures[kind]["chains"], 1, "{kind}: {figures}");
            let replaced = figures[kind]["replaced"].as_u64().unwrap();
            assert!(replaced >= 8, "{kind}: {figures}");
        }
        let announced = &figures["announced"];
        assert_eq!(announced["forced"], 0, "{figures}");
        assert!(announced["below"].as_f64().unwrap() < 0.02, "{figures}");
        let nearest_m = announced["nearest_m"].as_f64().unwrap();
        assert!(nearest_m >= SEPARATION_M - 2.0 * ERROR_M, "{figures}");
    }
}
