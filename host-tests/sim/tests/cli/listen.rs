//! Scenarios and reports of relays that measure the interference.

use super::{chain, json, refusal};

const TOML: &str =
    "[geometry]\ndistance_m = 1000\naltitude_m = 20\n[power]\ntx_w = 80\nuav_w = 1\n[listen]\n";

#[test]
fn what_is_heard_comes_from_an_interferer() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("listen.toml");
    std::fs::write(&file, TOML).unwrap();
    let name = file.to_str().unwrap();
    let (status, text) = refusal(&["--scenario", name, "--uavs", "3", "--listen"]);
    assert_eq!(status, 2, "{text}");
    assert!(text.contains("interferer: is missing"), "{text}");
    let source = "[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";
    std::fs::write(&file, format!("{TOML}following = true\n{source}")).unwrap();
    let options = [
        "--scenario",
        name,
        "--uavs",
        "3",
        "--listen",
        "--listen-for",
        "30",
    ];
    assert!(json(&options)["sir"].is_number());
}

/// Checks the strip of events of relays that spread evenly at first. They have agreed on no SIR then.
#[test]
fn relays_that_spread_to_hear_have_no_sir_in_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("listen.svg");
    let name = file.to_str().unwrap();
    let options = ["--uavs", "3", "--listen", "--listen-for", "30"];
    let output = chain(&[&options[..], &["--svg", name]].concat());
    assert!(output.status.success(), "{output:?}");
    let svg = std::fs::read_to_string(&file).unwrap();
    assert!(svg.contains(">spread<"), "{svg}");
    assert!(!svg.contains("SIR 0.000"), "{svg}");
}

/// The SIR and the optimum are those of the remaining relays.
#[test]
fn a_lost_relay_does_not_count() {
    let options = [
        "--uavs",
        "6",
        "--kill",
        "4@20",
        "--listen",
        "--listen-for",
        "120",
    ];
    let report = json(&options);
    let of = |name: &str| report[name].as_f64().unwrap();
    assert_eq!(report["lost"][0]["index"].as_u64(), Some(4), "{report}");
    let [worst, true_sir, share] = ["sir", "true_sir", "share_of_optimum"].map(of);
    assert!((true_sir / worst - 1.0).abs() < 0.01, "{report}");
    assert!(share > 0.99 && share < 1.01, "{report}");
    assert!((true_sir / of("optimum_sir") - share).abs() < 1e-6);
    // The optimum is that of five relays, not six.
    let five = json(&["--uavs", "5"]);
    let optimum = five["sir"].as_f64().unwrap();
    assert!((of("optimum_sir") / optimum - 1.0).abs() < 1e-3, "{report}");
    let table = String::from_utf8(chain(&options).stdout).unwrap();
    let line = table
        .lines()
        .find(|line| line.starts_with("true SIR "))
        .unwrap();
    assert!(
        !line.contains("inf") && !line.contains("0.0000 of"),
        "{line}"
    );
}
