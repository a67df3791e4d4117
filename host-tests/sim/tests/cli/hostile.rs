//! Reports of failures, partitions and attacks.

use serde_json::Value;

use super::{chain, json};

#[test]
fn a_killed_relay_is_left_out_and_the_report_tells_how_that_went() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lost.svg");
    let file_name = file.to_str().unwrap();
    let report = json(&["--kill", "4@20", "--air", "ideal", "--svg", file_name]);
    assert_eq!(
        (
            report["uavs"].as_u64(),
            report["left"].as_u64(),
            report["channel"].as_str()
        ),
        (Some(8), Some(7), Some("shared"))
    );
    let indices = |list: &Value| -> Vec<u64> {
        let all = list.as_array().unwrap().iter();
        all.map(|relay| relay["index"].as_u64().unwrap()).collect()
    };
    assert_eq!(indices(&report["relays"]), [1, 2, 3, 5, 6, 7, 8]);
    assert_eq!(indices(&report["lost"]), [4]);
    assert_eq!(report["lost"][0]["why"], "silent");
    assert!(report["lost"][0]["x_m"].as_f64().unwrap() > 0.0);
    // The remaining chain equals a chain of seven relays from the start.
    let seven = json(&["--uavs", "7"]);
    for key in ["sir", "rx_sir", "target"] {
        assert_eq!(report[key], seven[key], "{key}");
    }
    let [one] = report["recovery"].as_array().unwrap().as_slice() else {
        panic!("{report}");
    };
    assert_eq!(one["lost"], serde_json::json!([4]));
    let times = ["happened_s", "detected_s", "formed_s", "converged_s"]
        .map(|key| one[key].as_f64().unwrap());
    assert_eq!(times[0], 20.0);
    assert!(
        // The two sides notice the loss up to one lease renewal period (2.5 s) apart.
        times.is_sorted() && times[1] <= 35.0 && times[3] - times[1] < 3.5,
        "{times:?}"
    );
    assert!((1..=6).contains(&one["sweeps"].as_u64().unwrap()), "{one}");
    let whats: Vec<&str> = report["timeline"]
        .as_array()
        .unwrap()
        .iter()
        .map(|moment| moment["what"].as_str().unwrap())
        .collect();
    for what in ["silent", "lost", "found", "view accepted", "converged"] {
        assert!(whats.contains(&what), "{what} in {whats:?}");
    }
    let drawing = std::fs::read_to_string(file).unwrap();
    assert!(drawing.contains("7 of 8 relays") && drawing.contains("4 lost"));
}

#[test]
fn the_story_of_a_loss_is_told_in_a_line_for_each_thing_that_happened() {
    let output = chain(&["--kill", "4@20"]);
    assert!(output.status.success() && output.stderr.is_empty());
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "4      379.452      20.00       silent",
        "with 7 of 8 relays by `align`",
        "one radio channel",
        "20.000 s  relay 4 went silent",
        " s  relays 3 and 5 lost relay 4",
        " s  relays 3 and 5 became neighbours",
        " s  view accepted: 7 relays, view ",
        " s  converged: 7 relays, SIR 2.312",
        // The last frame of relay 4, a lease renewal, is up to 5 s old; the first probe after 15 s detects the loss.
        ", relay 4 lost: noticed after 1",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
}

#[test]
fn a_relay_that_is_switched_on_again_gets_its_place_back() {
    for index in ["1", "4", "8"] {
        let (kill, boot) = (format!("{index}@20"), format!("{index}@60"));
        let report = json(&["--kill", &kill, "--boot", &boot]);
        assert_eq!(report["left"].as_u64(), Some(8));
        assert_eq!(report["sir"], json(&[])["sir"]);
        let recovery = report["recovery"].as_array().unwrap();
        let index: Value = index.parse::<u64>().unwrap().into();
        let is_back = |one: &Value| one["back"].as_array().unwrap().contains(&index);
        assert!(recovery.iter().any(is_back), "{recovery:?}");
    }
}

#[test]
fn of_two_parts_the_larger_goes_on_until_they_meet_again() {
    let report = json(&["--partition", "3@20"]);
    assert_eq!(report["left"].as_u64(), Some(5));
    let lost = report["lost"].as_array().unwrap();
    assert!(
        lost.len() == 3 && lost.iter().all(|relay| relay["why"] == "apart"),
        "{lost:?}"
    );
    let healed = json(&["--partition", "3@20-120"]);
    assert_eq!(healed["left"].as_u64(), Some(8));
    assert_eq!(healed["sir"], json(&[])["sir"]);
}

/// Quorum of one: of two relays, only the leader may go on alone.
#[test]
fn too_few_hold_their_places_and_the_status_is_1() {
    let output = chain(&["--json", "--uavs", "2", "--kill", "1@20"]);
    assert_eq!(output.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(
        report["error"].as_str().unwrap().contains("no quorum"),
        "{report}"
    );
    assert!(report.get("sir").is_none());
    assert_eq!(report["left"].as_u64(), Some(0));
    assert_eq!(report["lost"][1]["why"], "no quorum");
    assert_eq!(
        json(&["--uavs", "2", "--kill", "2@20"])["left"].as_u64(),
        Some(1)
    );
}

#[test]
fn with_tags_an_attacker_changes_nothing() {
    for extra in [&[][..], &["--kill", "2@20"], &["--wires"]] {
        let arguments = [&["--uavs", "5", "--forge", "600", "--replay", "600"], extra].concat();
        let report = json(&arguments);
        let attack = &report["attack"];
        assert_eq!(attack["auth"], true);
        for kind in ["forged", "replayed"] {
            assert_eq!(attack[kind]["sent"].as_u64(), Some(600), "{attack}");
            assert_eq!(attack[kind]["taken"].as_u64(), Some(0), "{attack}");
        }
        let counted = |kind: &str, name: &str| attack[kind]["counted"][name].as_u64().unwrap_or(0);
        assert!(counted("forged", "forged") > 300, "{attack}");
        assert!(counted("forged", "unsigned") > 30, "{attack}");
        assert!(counted("replayed", "replayed") > 300, "{attack}");
        for key in ["moved", "misled", "unsafe_setpoints"] {
            assert_eq!(attack[key].as_u64(), Some(0), "{key} in {attack}");
        }
        assert_eq!(attack["formed"], attack["formed_without"], "{attack}");
    }
}

/// Relays without tags accept an attacker's frames, and the report shows the consequences.
#[test]
fn without_tags_an_attacker_is_listened_to_and_the_report_says_so() {
    let attacked = [
        "--uavs",
        "4",
        "--forge",
        "1000",
        "--replay",
        "100",
        "--no-auth",
        "--json",
    ];
    // The chain may not settle; then the report has an error, and the exit status is 1.
    let output = chain(&attacked);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(output.status.code() == Some(1), report["error"].is_string());
    let attack = &report["attack"];
    assert_eq!(attack["auth"], false);
    for kind in ["forged", "replayed"] {
        assert!(attack[kind]["taken"].as_u64().unwrap() > 10, "{attack}");
    }
    // Forged offers of another mission are rejected: they need a tag.
    assert!(
        attack["forged"]["counted"]["unsigned"].as_u64().unwrap() > 0,
        "{attack}"
    );
    assert!(
        attack["formed"].as_u64() > attack["formed_without"].as_u64(),
        "{attack}"
    );
}
