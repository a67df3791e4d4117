//! `cargo chain` as a person and a program meet it: its options, its JSON, its exit statuses.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::float_cmp,
    missing_docs
)]

mod air;
mod capture;
mod hostile;
mod listen;
mod upload;
mod words;

use std::process::{Command, Output};

use serde_json::Value;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;

fn chain(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chain"))
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let mut all = vec!["--json"];
    all.extend(arguments);
    let output = chain(&all);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The exit status and the one line on standard error.
fn refusal(arguments: &[&str]) -> (i32, String) {
    let output = chain(arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
    (output.status.code().unwrap(), text)
}

#[test]
fn the_json_has_every_field_of_the_contract() {
    let report = json(&["--uavs", "3", "--seed", "5"]);
    for key in [
        "sir",
        "sir_db",
        "rx_sir",
        "sweeps",
        "messages",
        "bytes",
        "virtual_s",
    ] {
        assert!(report[key].is_number(), "{key} in {report}");
    }
    assert_eq!(
        (
            report["method"].as_str(),
            report["uavs"].as_u64(),
            report["seed"].as_u64()
        ),
        (Some("align"), Some(3), Some(5))
    );
    for key in ["lost", "corrupted", "duplicated", "reordered", "rejected"] {
        assert_eq!(report["faults"][key].as_u64(), Some(0), "{key}");
    }
    let relays = report["relays"].as_array().unwrap();
    assert_eq!(relays.len(), 3);
    for (index, relay) in (1..).zip(relays) {
        assert_eq!(relay["index"].as_u64(), Some(index));
        for key in ["x_m", "y_m", "h_m", "sir", "sir_db"] {
            assert!(relay[key].is_number(), "{key} in {relay}");
        }
    }
    let worst = relays
        .iter()
        .map(|relay| &relay["sir"])
        .chain([&report["rx_sir"]])
        .map(|sir| sir.as_f64().unwrap());
    assert_eq!(
        worst.fold(f64::INFINITY, f64::min),
        report["sir"].as_f64().unwrap()
    );
    let db = 10.0 * report["sir"].as_f64().unwrap().log10();
    assert!((report["sir_db"].as_f64().unwrap() - db).abs() < 1e-9);
}

#[test]
fn the_default_is_eight_relays_by_align_and_a_table() {
    let output = chain(&[]);
    assert!(output.status.success() && output.stderr.is_empty());
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("worst hop: SIR 2.4655") && table.contains("8 relays by `align`"),
        "{table}"
    );
    assert!(table.contains("cost: 1 sweeps, 14 messages"), "{table}");
    assert_eq!(table.lines().count(), 1 + 8 + 1 + 2, "{table}");
}

/// Where there is room beside the line the table says y, and `altitude` is another name for `joint`.
#[test]
fn the_table_has_y_where_there_is_room_beside_the_line() {
    let side = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/side.toml");
    let table = |arguments: &[&str]| String::from_utf8(chain(arguments).stdout).unwrap();
    let beside = table(&["--scenario", side, "--uavs", "2", "--method", "altitude"]);
    assert!(
        beside.contains("y [m]") && beside.contains("by `joint`"),
        "{beside}"
    );
    assert!(!table(&["--uavs", "2"]).contains("y [m]"));
}

#[test]
fn the_same_seed_prints_the_same_bytes() {
    let bad_day = [
        "--json",
        "--loss",
        "0.3",
        "--corrupt",
        "0.15",
        "--duplicate",
        "0.1",
        "--reorder",
        "0.1",
        "--seed",
    ];
    let go = |seed| chain(&[&bad_day[..], &[seed]].concat()).stdout;
    assert_eq!(go("3"), go("3"));
    assert_ne!(go("3"), go("4"));
    let report: Value = serde_json::from_slice(&go("3")).unwrap();
    assert!(report["faults"]["lost"].as_u64().unwrap() > 0);
}

#[test]
fn the_fixed_step_reports_the_papers_sweeps() {
    let report = json(&["--uavs", "2", "--method", "align-step", "--epsilon", "0.1"]);
    assert_eq!(report["sweeps"].as_u64(), Some(10_245));
    assert!((report["sir"].as_f64().unwrap() - 1.6).abs() < 1e-5);
}

#[test]
fn wrong_options_are_named_with_their_value_and_range() {
    for (arguments, parts) in [
        (&["--uavs", "0"][..], &["--uavs", "'0'", "1 to 1000"][..]),
        (&["--uavs", "1001"], &["--uavs", "'1001'", "1 to 1000"]),
        (&["--uavs", "many"], &["--uavs", "many"]),
        (&["--loss", "0.95"], &["--loss", "0.95", "0.0 to 0.9"]),
        (&["--corrupt", "NaN"], &["--corrupt", "NaN", "0.0 to 0.9"]),
        (&["--duplicate", "-1"], &["-1"]),
        (&["--duplicate=-1"], &["--duplicate", "-1", "0.0 to 0.9"]),
        (&["--reorder", "x"], &["--reorder", "x", "0.0 to 0.9"]),
        (
            &["--tolerance", "0"],
            &["--tolerance", "'0'", "1e-6 to 0.1"],
        ),
        (
            &["--epsilon", "inf"],
            &["--epsilon", "inf", "1e-6 to 1000000.0"],
        ),
        (&["--kill", "3"], &["--kill", "3", "I@S"]),
        (&["--kill", "9@1"], &["--kill 9@", "1 to 8"]),
        (&["--kill", "0@1"], &["--kill 0@", "1 to 8"]),
        (&["--kill", "3@-1"], &["--kill", "3@-1", "0 to 1e6"]),
        (&["--boot", "3"], &["--boot", "'3'", "I@S"]),
        (&["--boot", "9@1"], &["--boot 9@", "1 to 8"]),
        (&["--partition", "3"], &["--partition", "'3'", "K@S-T"]),
        (&["--partition", "8@1"], &["--partition 8@", "1 to 7"]),
        (&["--partition", "0@1-2"], &["--partition 0@", "1 to 7"]),
        (
            &["--partition", "3@5-5"],
            &["--partition", "3@5-5", "T after S"],
        ),
        (
            &["--uavs", "1", "--partition", "1@1"],
            &["--partition 1@", "one relay"],
        ),
        (
            &["--partition", "3@1", "--wires"],
            &["--partition", "--wires"],
        ),
        (&["--forge", "0"], &["--forge", "'0'", "1 to 100000"]),
        (&["--replay", "100001"], &["--replay", "1 to 100000"]),
        (&["--auth", "--no-auth"], &["--auth", "--no-auth"]),
        (&["--shared", "--wires"], &["--shared", "--wires"]),
        (&["--seed", "-3"], &["-3"]),
        (&["--method", "magic"], &["--method", "magic"]),
        (&["--nonsense"], &["--nonsense"]),
        (&["--scenario", "no/such/file.toml"], &["no/such/file.toml"]),
        (
            &["--svg", "no/such/folder/a.svg"],
            &["no/such/folder/a.svg"],
        ),
    ] {
        let (status, line) = refusal(arguments);
        assert_eq!(status, 2, "{arguments:?}: {line}");
        for part in parts {
            assert!(line.contains(part), "{arguments:?}: {part} not in {line}");
        }
    }
}

/// A scenario of the repository.
fn example(name: &str) -> String {
    format!("{}/../../examples/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_method_says_what_scenario_it_needs() {
    for method in ["stochastic", "stochastic-step"] {
        let (status, line) = refusal(&["--method", method]);
        assert_eq!(status, 2);
        assert!(line.contains(method) && line.contains("[field]"), "{line}");
    }
    for method in ["align", "align-step", "adjust", "joint"] {
        let (status, line) = refusal(&["--scenario", &example("field.toml"), "--method", method]);
        assert_eq!(status, 2);
        assert!(
            line.contains(method) && line.contains("[[interferer]]"),
            "{line}"
        );
    }
    let (status, line) = refusal(&["--closed-loop", "2"]);
    assert_eq!(status, 2);
    assert!(line.contains("--closed-loop"), "{line}");
    for (option, value) in [
        ("--rounds", "0"),
        ("--explore", "-1"),
        ("--grid", "41"),
        ("--grid", "1x5"),
        ("--closed-loop", "101"),
    ] {
        let (status, line) = refusal(&["--method", "adjust", option, value]);
        assert_eq!(status, 2);
        assert!(line.contains(option), "{line}");
    }
}

/// What is asked of `joint` and `adjust`, through the tool itself.
#[test]
fn the_joint_figures_hold() {
    let file = example("altitudes.toml");
    for (uavs, least, best) in [
        ("2", 0.881_45, 0.881_533_9),
        ("5", 1.047_36, 1.047_463_5),
        ("8", 1.235_66, 1.235_783_8),
        ("50", 6.497_73, 6.498_377_7),
    ] {
        let report = json(&["--scenario", &file, "--uavs", uavs, "--method", "joint"]);
        let sir = report["sir"].as_f64().unwrap();
        assert!(sir >= least && sir <= best * (1.0 + 1e-6), "{uavs}: {sir}");
        assert!(report["sweeps"].as_u64().unwrap() <= 17, "{report}");
        let heights = report["relays"].as_array().unwrap().iter();
        assert!(
            heights
                .map(|relay| relay["h_m"].as_f64().unwrap())
                .all(|h| (20.0..=300.0).contains(&h))
        );
    }
    let report = json(&["--scenario", &file, "--uavs", "50", "--method", "adjust"]);
    let rounds: Vec<f64> = report["rounds"]
        .as_array()
        .unwrap()
        .iter()
        .map(|sir| sir.as_f64().unwrap())
        .collect();
    assert_eq!(rounds.len(), 501);
    assert!(rounds.windows(2).all(|pair| pair[1] >= pair[0]));
    assert!(report["sir"].as_f64().unwrap() >= 6.40, "{}", report["sir"]);
    let grid = json(&[
        "--scenario",
        &file,
        "--uavs",
        "50",
        "--method",
        "adjust",
        "--grid",
        "41x21",
    ]);
    let gain = grid["sir"].as_f64().unwrap() / rounds[0];
    assert!((gain - 1.0).abs() < 1e-6, "{gain}");
}

#[test]
fn a_field_is_flown_by_what_was_agreed_or_by_what_is_measured() {
    let file = example("field.toml");
    let agreed = json(&["--scenario", &file, "--method", "stochastic"]);
    assert_eq!(agreed["sweeps"].as_u64(), Some(1));
    assert!(agreed["promised"].is_boolean());
    let sir = agreed["sir"].as_f64().unwrap();
    let step = json(&[
        "--scenario",
        &file,
        "--method",
        "stochastic-step",
        "--epsilon",
        "0.01",
    ]);
    assert!(step["sweeps"].as_u64().unwrap() > 10);
    assert!(sir >= step["sir"].as_f64().unwrap() - 0.01);
    let measured = |rounds: &str| {
        let report = json(&[
            "--scenario",
            &file,
            "--method",
            "stochastic",
            "--closed-loop",
            rounds,
        ]);
        report["sir"].as_f64().unwrap()
    };
    assert!(measured("6") > 0.97 * sir, "{} {sir}", measured("6"));
}

/// A step that is larger than the best there is steps over it, which is no proof that there is nothing.
#[test]
fn a_step_that_is_too_large_says_so() {
    let output = chain(&[
        "--json",
        "--scenario",
        &example("field.toml"),
        "--method",
        "stochastic-step",
        "--epsilon",
        "0.2",
    ]);
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(
        report["error"].as_str().unwrap().contains("fixed step"),
        "{report}"
    );
    assert!(report.get("best_sir").is_none());
}

/// With one interferer `adjust` and `joint` draw the chain they choose; a field is drawn without an interferer.
#[test]
fn every_method_can_be_drawn() {
    let folder = tempfile::tempdir().unwrap();
    for (scenario, method) in [
        ("altitudes.toml", "joint"),
        ("side.toml", "joint"),
        ("altitudes.toml", "adjust"),
        ("field.toml", "stochastic"),
    ] {
        let file = folder.path().join(format!("{method}.svg"));
        let path = file.to_str().unwrap();
        json(&[
            "--scenario",
            &example(scenario),
            "--method",
            method,
            "--svg",
            path,
        ]);
        let svg = std::fs::read_to_string(&file).unwrap();
        roxmltree::Document::parse(&svg).unwrap();
        assert!(svg.contains(method) && !svg.contains("NaN"));
    }
}

#[test]
fn what_cannot_be_placed_is_status_1_with_the_reason_in_the_json() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("on-top.toml");
    let text = "[geometry]\ndistance_m = 1000\naltitude_m = 20\n[power]\ntx_w = 80\nuav_w = 1\n[[interferer]]\npower_w = 80\nx_m = 1000\ny_m = 0\n";
    std::fs::write(&file, text).unwrap();
    let output = chain(&["--json", "--scenario", file.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(
        report["error"].as_str().unwrap().contains("no placement"),
        "{report}"
    );
    assert_eq!(report["best_sir"].as_f64(), Some(0.0));

    // Without a scenario the option is what is wrong, and the JSON says so all the same.
    let output = chain(&["--json", "--uavs", "1000"]);
    assert_eq!(output.status.code(), Some(2));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let error = report["error"].as_str().unwrap();
    assert!(
        error.starts_with("--uavs 1000: must be within 1 to 250 "),
        "{report}"
    );
}

#[test]
fn on_wires_a_killed_relay_breaks_the_chain_and_the_report_says_who_noticed() {
    let output = chain(&["--json", "--uavs", "4", "--kill", "2@0.01", "--wires"]);
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(
        report["error"]
            .as_str()
            .unwrap()
            .contains("relay 2 went silent"),
        "{report}"
    );
    let silences = report["silences"].as_array().unwrap();
    assert_eq!(silences.len(), 2);
    // By the first question after 15 s: they are at most 10 s / 16 apart, and an eighth more.
    let latest_s = 15.0 + 10.0 / 16.0 * 1.125;
    assert!(
        silences
            .iter()
            .all(|silence| silence["silent"] == 2 && silence["at_s"].as_f64().unwrap() <= latest_s),
        "{silences:?}"
    );
}

#[test]
fn relays_of_a_scenario_keep_what_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mixed.toml");
    let text = "[geometry]\ndistance_m = 1000.0\naltitude_m = 20.0\n[power]\ntx_w = 80.0\nuav_w = 1.0\n[[interferer]]\npower_w = 80.0\nx_m = 500.0\ny_m = 400.0\n[[relay]]\nindex = 3\naltitude_m = 30.0\npower_w = 0.5\n";
    std::fs::write(&file, text).unwrap();
    let picture = folder.path().join("mixed.svg");
    let report = json(&[
        "--uavs",
        "4",
        "--scenario",
        file.to_str().unwrap(),
        "--svg",
        picture.to_str().unwrap(),
    ]);
    let heights: Vec<f64> = report["relays"]
        .as_array()
        .unwrap()
        .iter()
        .map(|relay| relay["h_m"].as_f64().unwrap())
        .collect();
    assert_eq!(heights, [20.0, 20.0, 30.0, 20.0]);
    let drawing = std::fs::read_to_string(picture).unwrap();
    let drawing = roxmltree::Document::parse(&drawing).unwrap();
    assert_eq!(
        drawing
            .descendants()
            .filter(|node| node.has_tag_name("circle"))
            .count(),
        4
    );
}

/// One interferer stands for several; what that does to the places is the planner's to say.
#[test]
fn several_interferers_are_flown_as_one_and_a_note_says_so() {
    let several = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/several.toml");
    let output = chain(&["--json", "--uavs", "3", "--scenario", several]);
    assert!(output.status.success());
    let note = String::from_utf8(output.stderr).unwrap();
    assert!(
        note.starts_with("note: one interferer of 79.4") && note.lines().count() == 1,
        "{note}"
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["sir"].as_f64().unwrap() > 0.1, "{report}");
    // Held against both, it is another SIR: that of a scene with both.
    let scenario = Scenario::load(std::path::Path::new(several)).unwrap();
    let scene = Scene::new(&scenario, 3).unwrap();
    let relays = report["relays"].as_array().unwrap();
    let of = |relay: &Value, key: &str| relay[key].as_f64().unwrap();
    let places: Vec<(f64, f64)> = relays
        .iter()
        .map(|relay| (of(relay, "x_m"), of(relay, "h_m")))
        .collect();
    let all = report["all_sir"].as_f64().unwrap();
    assert!(
        (all / scene.chain_sir(&places) - 1.0).abs() < 1e-9,
        "{report}"
    );
    let lost = 1.0 - all / report["sir"].as_f64().unwrap();
    assert!(
        (report["all_loss"].as_f64().unwrap() - lost).abs() < 1e-9 && lost > 0.01,
        "{report}"
    );
    let table = String::from_utf8(chain(&["--uavs", "3", "--scenario", several]).stdout).unwrap();
    assert!(
        table.contains("against all interferers: SIR ")
            && table.contains("% below what the relays believe"),
        "{table}"
    );
}

#[test]
fn a_relay_that_is_described_and_not_there_is_refused() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenario.toml");
    let output = chain(&["--uavs", "4", "--scenario", example]);
    assert_eq!(output.status.code(), Some(2));
    let line = String::from_utf8(output.stderr).unwrap();
    assert!(
        line.ends_with("scenario.toml: [[relay]] index = 5: there is no such relay in a chain of 4; allowed: 1 to 4\n"),
        "{line}"
    );
}
