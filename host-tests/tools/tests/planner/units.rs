//! Answers in the requested unit, and in words.

use serde_json::Value;

use super::{example, plan, refusal, said};

#[test]
fn what_is_asked_in_decibels_is_answered_in_decibels() {
    let (status, line) = refusal("--target-sir-db 60");
    assert_eq!(status, 1);
    assert!(line.starts_with("no number of relays, up to 1000, gives every hop an SIR of 60 dB: the most is 20.980 dB, with "), "{line}");
    let (_, line) = refusal("--target-sir 1000");
    assert!(
        line.contains("an SIR of 1000: the most is 125.31"),
        "{line}"
    );
    let (_, line) = refusal(&format!(
        "--target-sir-db 60 --scenario {}",
        example("multi_interferer.toml")
    ));
    assert!(
        line.contains("an SIR of 60 dB: the most found is ") && line.contains(" dB"),
        "{line}"
    );

    let table = said("--target-sir-db 6");
    for part in [
        "worst hop: 6.000 dB (SIR 3.98107",
        "target: SIR 6 dB; that many relays reach up to 6.",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
    let table = said("--target-sir 4");
    for part in [
        "worst hop: SIR 4.00000",
        "target: SIR 4; that many relays reach up to 4.",
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
}

#[test]
fn json_has_both_units() {
    let read =
        |arguments: &str| -> Value { serde_json::from_slice(&plan(arguments).stdout).unwrap() };
    let pairs = |report: &Value, names: &[&str]| {
        for name in names {
            let of = |name: &str| {
                report[name]
                    .as_f64()
                    .unwrap_or_else(|| panic!("{name}: {report}"))
            };
            let db = 10.0 * of(name).log10();
            assert!(
                (db - of(&format!("{name}_db"))).abs() < 1e-9,
                "{name}: {report}"
            );
        }
    };
    let met = read("--target-sir-db 6 --json");
    pairs(&met, &["sir", "target_sir", "most_sir", "rx_sir"]);
    pairs(
        &read("--target-sir-db 60 --json"),
        &["best_sir", "target_sir"],
    );
}

#[test]
fn a_case_is_told_as_what_it_means_for_the_drone() {
    let json: Value = serde_json::from_str(&said("--uavs 1 --json")).unwrap();
    let table = said("--uavs 1");
    let words = json["case_words"].as_str().unwrap();
    assert!(words.starts_with("the drone "), "{words}");
    let line = format!(
        "{words} (Theorem {}, case {})\n",
        json["theorem"], json["case"]
    );
    assert!(table.contains(&line), "{line}: {table}");
    for (arguments, theorem) in [
        ("--x-m 300", "(Theorem 2, case "),
        ("--altitude free", "(Theorem 3, case "),
        (
            &format!("--altitude free --scenario {}", example("side.toml")),
            "(one relay aside, case ",
        ),
    ] {
        let table = said(&format!("--uavs 1 {arguments}"));
        let line = table
            .lines()
            .find(|line| line.contains(theorem))
            .unwrap_or_else(|| panic!("{table}"));
        assert!(line.contains("the drone "), "{line}");
    }
}

#[test]
fn a_scenario_in_field_units_is_planned() {
    let table = said(&format!(
        "--scenario {} --target-sir-db 8",
        example("decibels.toml")
    ));
    assert!(table.contains("worst hop: 8.00"), "{table}");
}

/// Map numbers are rounded for people: millimetres, thousandths of a decibel, whole counts.
#[test]
fn a_map_has_rounded_numbers_with_units_in_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let [geojson, kml] = ["plan.geojson", "plan.kml"]
        .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let scenario = example("decibels.toml");
    let maps = format!("--geojson {geojson} --kml {kml}");
    said(&format!("--scenario {scenario} --uavs 3 {maps}"));
    let is_short = |name: &str, number: &str| {
        let decimals = number.split_once('.').map_or("", |(_, decimals)| decimals);
        let most = match name {
            "index" | "hop" => 0,
            "sir_ratio" => 6,
            _ => 3,
        };
        decimals.len() <= most && !number.contains('e')
    };
    let text = std::fs::read_to_string(&geojson).unwrap();
    let map: Value = serde_json::from_str(&text).unwrap();
    let mut names = std::collections::BTreeSet::new();
    for feature in map["features"].as_array().unwrap() {
        for (name, value) in feature["properties"].as_object().unwrap() {
            let Value::Number(number) = value else {
                continue;
            };
            names.insert(name.clone());
            let is_count = matches!(name.as_str(), "index" | "hop");
            assert_eq!(number.is_u64(), is_count, "{name}: {number}");
            assert!(
                is_count || is_short(name, number.to_string().trim_end_matches(".0")),
                "{name}: {number}"
            );
        }
    }
    let known = [
        "amsl_m",
        "eirp_dbm",
        "h_m",
        "hop",
        "index",
        "sir_db",
        "sir_ratio",
        "x_m",
        "y_m",
    ];
    assert!(names.iter().eq(known), "{names:?}");
    let text = std::fs::read_to_string(&kml).unwrap();
    let descriptions = text.split("<description>").skip(1);
    let mut numbers = 0;
    for description in descriptions {
        for pair in description.split('<').next().unwrap().split(", ") {
            let (name, number) = pair.split_once(" = ").unwrap();
            assert!(is_short(name, number), "{pair}");
            numbers += 1;
        }
    }
    assert!(numbers > 20, "{text}");
}
