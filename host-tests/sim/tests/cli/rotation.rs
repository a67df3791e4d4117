//! Replacement of drones whose batteries run low.

use serde_json::Value;

use super::{json, refusal};

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
        assert!(announced["below"].as_f64().unwrap() < 0.002, "{figures}");
        let nearest_m = announced["nearest_m"].as_f64().unwrap();
        assert!(nearest_m >= SEPARATION_M - 2.0 * ERROR_M, "{figures}");
    }
}

/// Checks that `fleet.flying` of a scenario has the effect of `--flying`, and an error names it.
#[test]
fn a_scenario_says_how_many_relays_fly() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = uav_relay_scenario::DEFAULT;
    let sections = "\n[network]\nrelays = 3\n[fleet]\nflying = 2\n";
    std::fs::write(file.path(), format!("{text}{sections}")).unwrap();
    let path = file.path().display();
    let run = format!("--scenario {path} --fly --fleet 3 --soak 60");
    let by_file = json(&run);
    assert_eq!(by_file, json(&format!("{run} --flying 2")));
    assert_ne!(by_file, json(&format!("{run} --flying 3")));
    let (status, line) = refusal(&format!("--scenario {path} --fly --fleet 5 --soak 60"));
    let wanted =
        "fleet.flying = 2: must be within 3 to 5, more than half of --fleet 5; or give --flying";
    assert!(status == 2 && line.contains(wanted), "{line}");
}

/// Simulates the share `part` of `HOURS` (100) virtual hours with a fleet, and prints a table.
///
/// One third of the time the channel loses no frame, one third 30 %, and one third half of the frames.
/// `most_below` has the largest share of the time with a low SIR, for each loss. The seeds are fixed, so that the test
/// cannot fail by chance. A run changes with each frame, so the limits are about twice the present figures.
fn soak(fleet: u16, flying: u16, part: f64, most_below: [f64; 3]) {
    let hours = std::env::var("HOURS").map_or(100.0, |it| it.parse().unwrap());
    let seeds = (hours * part / 3.0).ceil();
    for (loss, most_below) in [0.0, 0.3, 0.5].into_iter().zip(most_below) {
        let report = json(&format!(
            "--fly --fleet {fleet} --flying {flying} --soak 3600 --seed 1001 --seeds {seeds} --loss {loss}"
        ));
        let (mut forced, mut left, mut below_s, mut watched_s) = (0, 0, 0.0, 0.0);
        let (mut wanted, mut least_s, mut near_m) = (0.0, f64::INFINITY, f64::INFINITY);
        for run in report["runs"].as_array().unwrap() {
            let figures = &run[1];
            let what = format!("{fleet}/{flying}, loss {loss}, seed {}", run[0]);
            let number = |of: &Value, key: &str| of[key].as_f64().unwrap();
            assert_eq!(figures["chains"], 1, "{what}: {figures}");
            forced += figures["forced"].as_u64().unwrap();
            left += figures["replaced"].as_u64().unwrap();
            let span_s = number(figures, "watched_s");
            watched_s += span_s;
            below_s += number(figures, "below") * span_s;
            wanted += number(figures, "arithmetic_per_hour") * span_s / 3_600.0;
            least_s = least_s.min(number(figures, "least_left_s"));
            near_m = near_m.min(number(figures, "nearest_m"));
            // Each time with a low SIR is listed, with its causes.
            let dips = figures["dips"].as_array().unwrap();
            let listed_s: f64 = dips.iter().map(|dip| number(dip, "span_s")).sum();
            let counted_s = number(figures, "below") * span_s;
            assert!((listed_s - counted_s).abs() < 1e-3, "{what}: {listed_s}");
            for dip in dips {
                let causes = dip["causes"].as_object().unwrap().values();
                let caused_s: f64 = causes.map(|span_s| span_s.as_f64().unwrap()).sum();
                let dip_s = number(dip, "span_s");
                assert!((caused_s - dip_s).abs() < 1e-3, "{what}: {dip}");
                assert!(number(dip, "least") < 0.99, "{what}: {dip}");
            }
        }
        let below = below_s / watched_s;
        let line = format!(
            "| {fleet}/{flying} | {loss} | {seeds} | {:.4} % | {left}, {wanted:.0} | {forced} | {least_s:.0} s | {near_m:.2} m |",
            100.0 * below
        );
        println!("{line}");
        assert!(near_m >= SEPARATION_M - 2.0 * ERROR_M, "{line}");
        assert!(below < most_below && forced == 0, "{line}");
    }
}

#[test]
fn twelve_drones_of_which_eight_fly_replace_each_other() {
    soak(12, 8, 0.2, [0.001, 0.002, 0.018]);
}

#[test]
fn six_drones_of_which_four_fly_replace_each_other() {
    soak(6, 4, 0.35, [0.001, 0.001, 0.004]);
}

#[test]
fn three_drones_of_which_two_fly_replace_each_other() {
    soak(3, 2, 0.45, [0.001, 0.001, 0.002]);
}
