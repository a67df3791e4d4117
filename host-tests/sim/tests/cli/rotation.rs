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

/// Checks chains of two sizes for eight hours on channels that lose none, 30 % and half of the frames.
///
/// The seeds are fixed, so that the test cannot fail by chance.
#[test]
fn a_fleet_replaces_its_tired_drones_on_a_channel_that_loses_frames() {
    // Drones, flying drones, share of lost frames, and limits for two hours: share of the time with a low SIR, drones
    // without permission. A run changes with each frame, so the limits are about 1.5 to 2 times the present figures.
    let runs = [
        (6, 4, 0.0, 0.001, 0),
        (3, 2, 0.0, 0.001, 0),
        (6, 4, 0.3, 0.001, 0),
        (6, 4, 0.5, 0.002, 0),
        (12, 8, 0.3, 0.001, 0),
        (12, 8, 0.5, 0.018, 0),
    ];
    for (fleet, flying, loss, most_below, most_forced) in runs {
        let report = json(&format!(
            "--fly --fleet {fleet} --flying {flying} --soak 3600 --seed 1 --seeds 2 --loss {loss}"
        ));
        let (mut forced, mut below_sum) = (0, 0.0);
        let hours = report["runs"].as_array().unwrap();
        for run in hours {
            let figures = &run[1];
            let what = format!("{fleet}/{flying}, loss {loss}, seed {}", run[0]);
            assert_eq!(figures["chains"], 1, "{what}: {figures}");
            forced += figures["forced"].as_u64().unwrap();
            let below = figures["below"].as_f64().unwrap();
            below_sum += below;
            let nearest_m = figures["nearest_m"].as_f64().unwrap();
            assert!(
                nearest_m >= SEPARATION_M - 2.0 * ERROR_M,
                "{what}: {figures}"
            );
            // Each time with a low SIR is listed, with its causes.
            let spans = |of: &Value, key: &str| of[key].as_f64().unwrap();
            let dips = figures["dips"].as_array().unwrap();
            let listed_s: f64 = dips.iter().map(|dip| spans(dip, "span_s")).sum();
            let watched_s = spans(figures, "watched_s");
            assert!(
                (listed_s - below * watched_s).abs() < 1e-3,
                "{what}: {listed_s}"
            );
            for dip in dips {
                let causes = dip["causes"].as_object().unwrap().values();
                let caused_s: f64 = causes.map(|span_s| span_s.as_f64().unwrap()).sum();
                assert!(
                    (caused_s - spans(dip, "span_s")).abs() < 1e-3,
                    "{what}: {dip}"
                );
                assert!(spans(dip, "least") < 0.99, "{what}: {dip}");
            }
        }
        let below = below_sum / hours.len() as f64;
        let what = format!("{fleet}/{flying}, loss {loss}: {below}, {forced} without permission");
        assert!(below < most_below && forced <= most_forced, "{what}");
    }
}
