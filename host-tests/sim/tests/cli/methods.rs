//! Planning methods on the command line: required scenarios, results and pictures.

use serde_json::Value;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;

use super::{chain, example, json, refusal, unmet};

/// Checks that the method `joint` uses fitted slots: time slots as long as each hop needs. The relays deliver at
/// least 95 % of the promised data rate. Fitted slots together with rate steps of the radio are rejected.
#[test]
fn fitted_slots_are_flown_by_joint() {
    let file = std::env::temp_dir().join(format!("fitted_{}.toml", std::process::id()));
    let with = |link: &str| {
        let text = uav_relay_scenario::DEFAULT;
        let link =
            format!("[link]\nreverse = 0.5\nbandwidth_hz = 1e6\naccess = \"fitted\"\n{link}");
        std::fs::write(&file, format!("{text}\n{link}\n")).unwrap();
    };
    with("gap_db = 3.0");
    let ask = format!("--uavs 5 --scenario {} --traffic both", file.display());
    let rates = |method: &str| {
        let report = json(&format!("{ask} --method {method}"));
        ["promised_bps", "delivered_bps"].map(|key| report[key][0].as_f64().unwrap())
    };
    let ([equal, _], [fitted, delivered]) = (rates("align"), rates("joint"));
    assert!(fitted > 1.3 * equal, "{fitted} {equal}");
    assert!(
        (0.95..=1.0).contains(&(delivered / fitted)),
        "{delivered} {fitted}"
    );
    // The relays' slots fill the frame, in order: toward Rx from hop 1 on, then back from the last hop on.
    let slots = json(&format!("{ask} --method joint"))["hop_slots"].clone();
    let slots = slots.as_array().unwrap();
    let bounds = |key: &str| -> Vec<[f64; 2]> {
        let slots = slots.iter().map(|hop| &hop[key]);
        slots
            .map(|slot| [0, 1].map(|end| slot[end].as_f64().unwrap()))
            .collect()
    };
    let [there, back] = ["slot", "slot_back"].map(bounds);
    assert_eq!(there.len(), 6);
    let mut at = 0.0;
    for [begin, end] in there.iter().chain(back.iter().rev()) {
        assert!(*begin == at && end > begin, "{slots:?}");
        at = *end;
    }
    assert_eq!(at, 1.0);
    let table = chain(&format!("{ask} --method joint")).stdout;
    let table = String::from_utf8(table).unwrap();
    let row = format!(
        "     2 {:>12.6} {:>10.6} {:>12.6} {:>10.6}\n",
        there[1][0], there[1][1], back[1][0], back[1][1]
    );
    assert!(table.contains(&row), "{row}{table}");
    assert_eq!(
        json(&format!("{ask} --method align"))["hop_slots"],
        Value::Null
    );
    with("steps = [{ sinr_db = 0.0, bits_per_hz = 1.0 }]");
    let (_, line) = refusal(&format!("{ask} --method joint"));
    assert!(
        line.contains("link.steps") && line.contains("joint"),
        "{line}"
    );
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn a_way_back_is_flown_by_align_adjust_and_joint() {
    let file = std::env::temp_dir().join(format!("way_back_{}.toml", std::process::id()));
    let text = uav_relay_scenario::DEFAULT;
    std::fs::write(&file, format!("{text}\n[link]\nreverse = 1.0\n")).unwrap();
    let ask = format!("--uavs 5 --scenario {}", file.display());
    let report = json(&ask);
    let [sir, back, reverse] =
        ["sir", "worst_back", "reverse"].map(|key| report[key].as_f64().unwrap());
    assert_eq!(reverse, 1.0);
    assert_eq!(report["messages"], 8);
    assert!(
        sir <= back && sir > 0.99 * report["target"].as_f64().unwrap(),
        "{report}"
    );
    assert!(
        report["relays"][0]["sir_back"].as_f64().unwrap() >= sir,
        "{report}"
    );
    let adjusted = json(&format!("{ask} --method adjust --rounds 3"));
    assert!(
        adjusted["sir"].as_f64().unwrap() > sir * (1.0 - 1e-5),
        "{adjusted}"
    );
    let altitudes = std::fs::read_to_string(example("altitudes.toml")).unwrap();
    std::fs::write(&file, format!("{altitudes}\n[link]\nreverse = 1.0\n")).unwrap();
    let (align, joint) = (json(&ask), json(&format!("{ask} --method joint")));
    let [level, free] = [&align, &joint].map(|report| report["sir"].as_f64().unwrap());
    assert!(free > 1.2 * level, "{free} {level}");
    let target = joint["target"].as_f64().unwrap();
    assert!((free / target - 1.0).abs() < 1e-3, "{joint}");
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn the_fixed_step_reports_the_papers_sweeps() {
    let report = json("--uavs 2 --method align-step --epsilon 0.1");
    assert_eq!(report["sweeps"].as_u64(), Some(10_245));
    assert!((report["sir"].as_f64().unwrap() - 1.6).abs() < 1e-5);
}

#[test]
fn a_method_names_the_scenario_it_needs() {
    for method in ["stochastic", "stochastic-step"] {
        let (status, line) = refusal(&format!("--method {method}"));
        assert_eq!(status, 2);
        assert!(line.contains(method) && line.contains("[field]"), "{line}");
    }
    for method in ["align", "align-step", "adjust", "joint"] {
        let (status, line) = refusal(&format!(
            "--scenario {} --method {method}",
            example("field.toml")
        ));
        assert_eq!(status, 2);
        assert!(
            line.contains(method) && line.contains("[[interferer]]"),
            "{line}"
        );
    }
    let (status, line) = refusal("--closed-loop 2");
    assert_eq!(status, 2);
    assert!(line.contains("--closed-loop"), "{line}");
    for (option, value) in [
        ("--rounds", "0"),
        ("--explore", "-1"),
        ("--grid", "41"),
        ("--grid", "1x5"),
        ("--closed-loop", "101"),
    ] {
        let (status, line) = refusal(&format!("--method adjust {option} {value}"));
        assert_eq!(status, 2);
        assert!(line.contains(option), "{line}");
    }
}

#[test]
fn the_joint_figures_hold() {
    let file = example("altitudes.toml");
    for (uavs, least, best) in [
        ("2", 0.881_45, 0.881_533_9),
        ("5", 1.047_36, 1.047_463_5),
        ("8", 1.235_66, 1.235_783_8),
        ("50", 6.497_73, 6.498_377_7),
    ] {
        let report = json(&format!("--scenario {file} --uavs {uavs} --method joint"));
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
    let report = json(&format!("--scenario {file} --uavs 50 --method adjust"));
    let rounds: Vec<f64> = report["rounds"]
        .as_array()
        .unwrap()
        .iter()
        .map(|sir| sir.as_f64().unwrap())
        .collect();
    assert_eq!(rounds.len(), 501);
    assert!(rounds.windows(2).all(|pair| pair[1] >= pair[0]));
    assert!(report["sir"].as_f64().unwrap() >= 6.40, "{}", report["sir"]);
    let grid = json(&format!(
        "--scenario {file} --uavs 50 --method adjust --grid 41x21"
    ));
    let gain = grid["sir"].as_f64().unwrap() / rounds[0];
    assert!((gain - 1.0).abs() < 1e-6, "{gain}");
}

#[test]
fn a_field_is_flown_by_agreement_or_by_measurements() {
    let file = example("field.toml");
    let agreed = json(&format!("--scenario {file} --method stochastic"));
    assert_eq!(agreed["sweeps"].as_u64(), Some(1));
    assert!(agreed["promised"].is_boolean());
    let sir = agreed["sir"].as_f64().unwrap();
    let step = json(&format!(
        "--scenario {file} --method stochastic-step --epsilon 0.01"
    ));
    assert!(step["sweeps"].as_u64().unwrap() > 10);
    assert!(sir >= step["sir"].as_f64().unwrap() - 0.01);
    let measured = |rounds: &str| {
        let report = json(&format!(
            "--scenario {file} --method stochastic --closed-loop {rounds}"
        ));
        report["sir"].as_f64().unwrap()
    };
    assert!(measured("6") > 0.97 * sir, "{} {sir}", measured("6"));
}

#[test]
fn a_too_large_step_is_reported() {
    let field = example("field.toml");
    let arguments = format!("--scenario {field} --method stochastic-step --epsilon 0.2");
    let report = unmet(&arguments, "fixed-step schedule");
    assert!(report.get("best_sir").is_none());
}

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
        json(&format!(
            "--scenario {} --method {method} --svg {path}",
            example(scenario)
        ));
        let svg = std::fs::read_to_string(&file).unwrap();
        roxmltree::Document::parse(&svg).unwrap();
        assert!(svg.contains(method) && !svg.contains("NaN"));
    }
}

#[test]
fn relays_keep_the_fixed_altitudes_of_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mixed.toml");
    let text = "[geometry]\ndistance_m = 1000.0\naltitude_m = 20.0\n[power]\ntx_w = 80.0\nuav_w = 1.0\n[[interferer]]\npower_w = 80.0\nx_m = 500.0\ny_m = 400.0\n[[relay]]\nindex = 3\naltitude_m = 30.0\npower_w = 0.5\n";
    std::fs::write(&file, text).unwrap();
    let picture = folder.path().join("mixed.svg");
    let report = json(&format!(
        "--uavs 4 --scenario {} --svg {}",
        file.display(),
        picture.display()
    ));
    let heights: Vec<f64> = report["relays"]
        .as_array()
        .unwrap()
        .iter()
        .map(|relay| relay["h_m"].as_f64().unwrap())
        .collect();
    assert_eq!(heights, [20.0, 20.0, 30.0, 20.0]);
    let drawing = std::fs::read_to_string(picture).unwrap();
    let drawing = roxmltree::Document::parse(&drawing).unwrap();
    // Each relay is drawn from the side, and from above because the interferer is beside the line.
    for coordinate in ["h = ", "y = "] {
        let circles = drawing
            .descendants()
            .filter(|node| node.has_tag_name("circle"));
        let titles = circles.filter_map(|circle| circle.first_element_child()?.text());
        assert_eq!(titles.filter(|title| title.contains(coordinate)).count(), 4);
    }
}

#[test]
fn several_interferers_are_flown_as_one_with_a_note() {
    let several = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/multi_interferer.toml"
    );
    let output = chain(&format!("--json --uavs 3 --scenario {several}"));
    assert!(output.status.success());
    let note = String::from_utf8(output.stderr).unwrap();
    assert!(
        note.starts_with("note: one interferer of 79.4") && note.lines().count() == 1,
        "{note}"
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["sir"].as_f64().unwrap() > 0.1, "{report}");
    // The SIR against both interferers is that of a scene with both.
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
    let table = String::from_utf8(chain(&format!("--uavs 3 --scenario {several}")).stdout).unwrap();
    assert!(
        table.contains("against all interferers: SIR ")
            && table.contains("% below the SIR that the relays expect"),
        "{table}"
    );
}
