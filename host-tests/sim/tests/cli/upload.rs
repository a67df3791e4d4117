//! Options and reports of missions that are uploaded in flight.

use roxmltree::Document;
use serde_json::Value;

use super::{chain, example, json, refusals, unmet};

/// Returns the report of a run in which the interferer is at x = 800 m, y = -300 m from the start.
///
/// It is a reference for runs whose upload moves the interferer there. `more` has further options of `cargo chain`.
fn from_the_start(folder: &tempfile::TempDir, more: &str) -> Value {
    let file = folder.path().join("moved.toml");
    let text = "[geometry]\ndistance_m = 1000\naltitude_m = 20\nmin_separation_m = 4\n[power]\ntx_w = 80\nuav_w = 1\n[[interferer]]\npower_w = 80\nx_m = 800\ny_m = -300\n";
    std::fs::write(&file, text).unwrap();
    json(&format!("--scenario {} {more}", file.display()))
}

const MOVED: &str = "20:x_m=800,y_m=-300";

fn places(report: &Value) -> Vec<(Value, Value, Value)> {
    let relays = report["relays"].as_array().unwrap().iter();
    relays
        .map(|relay| {
            (
                relay["x_m"].clone(),
                relay["h_m"].clone(),
                relay["sir"].clone(),
            )
        })
        .collect()
}

fn whats(report: &Value, what: &str) -> usize {
    let moments = report["timeline"].as_array().unwrap().iter();
    moments.filter(|moment| moment["what"] == what).count()
}

/// Checks that an uploaded mission gives the same final positions as this mission loaded at the start.
///
/// Covers wires and radio, uploads from Tx and from Rx, and good and bad links.
#[test]
fn an_upload_ends_as_if_the_mission_had_been_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let expected = from_the_start(&folder, "");
    let loss = "--loss 0.3 --corrupt 0.1 --seed 3";
    for more in [
        "",
        "--upload-from rx",
        "--wires",
        "--wires --upload-from rx",
        loss,
        &format!("{loss} --upload-from rx --wires"),
    ] {
        let report = json(&format!("--upload {MOVED} {more}"));
        assert_eq!(places(&report), places(&expected), "{more:?}");
        for key in ["sir", "rx_sir", "target"] {
            assert_eq!(report[key], expected[key], "{key}, {more:?}");
        }
        assert_eq!(report["version"].as_u64(), Some(1));
        let relays = report["relays"].as_array().unwrap();
        assert!(relays.iter().all(|relay| relay["version"] == 1));
        assert_eq!(
            (whats(&report, "offered"), whats(&report, "adopted")),
            (1, 8)
        );
        let recovery = report["recovery"].as_array().unwrap();
        let of_it: Vec<&Value> = recovery.iter().filter(|one| one["version"] == 1).collect();
        let [one] = of_it.as_slice() else {
            panic!("{recovery:?}");
        };
        assert_eq!(one["offered_s"].as_f64(), Some(20.0));
        let times = ["offered_s", "formed_s", "converged_s"].map(|key| one[key].as_f64().unwrap());
        assert!(times.is_sorted() && times[2] < 60.0, "{times:?}");
        assert!(one["sweeps"].as_u64().unwrap() >= 2, "{one}");
        let ground = if more.contains("rx") { 9 } else { 0 };
        let moments = report["timeline"].as_array().unwrap();
        let offered = moments.iter().find(|moment| moment["what"] == "offered");
        assert_eq!(offered.unwrap()["relay"].as_u64(), Some(ground));
    }
}

#[test]
fn without_an_upload_the_report_mentions_none() {
    for report in [json(""), json("--kill 4@20")] {
        assert!(report.get("version").is_none());
        assert!(report["relays"][0].get("version").is_none());
    }
}

#[test]
fn an_upload_is_in_the_timeline_and_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("upload.svg");
    let file_name = file.to_str().unwrap();
    let output = chain(&format!("--upload {MOVED} --air ideal --svg {file_name}"));
    assert!(output.status.success() && output.stderr.is_empty());
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "worst hop: SIR 1.5817",
        "the chain uses the uploaded mission, version 1",
        "one radio channel",
        "positions agreed: 8 relays, SIR 2.466",
        "20.000 s  the ground station at Tx uploads mission version 1",
        " s  relays 1 to 8 stored mission version 1",
        " s  mission version 1 adopted by relays 1 to 8",
        "positions agreed: 8 relays, SIR 1.582",
        "mission version 1 uploaded (view 1): adopted 0.",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
    let drawing = std::fs::read_to_string(file).unwrap();
    Document::parse(&drawing).unwrap();
    for words in [
        "interferer: 80 W, x = 800 m, y = -300 m",
        "interferer of the previous mission: 80 W, x = 500 m, y = 400 m",
        "|y| = 300 m",
        "mission 1 offered",
        "mission 1 adopted",
        "1.5817 (1.99 dB)",
    ] {
        assert!(drawing.contains(words), "{words} in {drawing}");
    }
}

/// Checks that versions of uploads are numbered by time, not by the order of the options.
#[test]
fn the_later_of_two_uploads_is_flown() {
    let folder = tempfile::tempdir().unwrap();
    let report = json("--upload 60:x_m=800,y_m=-300 --upload 20:power_w=30");
    assert_eq!(report["version"].as_u64(), Some(2));
    assert_eq!(places(&report), places(&from_the_start(&folder, "")));
    let recovery = report["recovery"].as_array().unwrap();
    let versions: Vec<u64> = recovery
        .iter()
        .filter_map(|one| one["version"].as_u64())
        .collect();
    assert_eq!(versions, [1, 2]);
}

/// Checks that an upload of all parameters has the same result as a scenario file with these values.
#[test]
fn every_upload_key_is_a_scenario_key() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("other.toml");
    let text = "[geometry]\ndistance_m = 900\naltitude_m = 60\naltitude_min_m = 40\naltitude_max_m = 120\nlateral_min_m = -30\nlateral_max_m = 40\nmin_separation_m = 5\n[power]\ntx_w = 70\nuav_w = 2\n[[interferer]]\npower_w = 60\nx_m = 300\ny_m = 200\n";
    std::fs::write(&file, text).unwrap();
    let shared = "--method joint --uavs 5";
    let expected = json(&format!(
        "--scenario {} --tolerance 0.01 {shared}",
        file.display()
    ));
    let upload = "5:distance_m=900,altitude_m=60,altitude_min_m=40,altitude_max_m=120,lateral_min_m=-30,lateral_max_m=40,min_separation_m=5,tx_w=70,uav_w=2,power_w=60,x_m=300,y_m=200,tolerance=0.01";
    let report = json(&format!("--upload {upload} {shared}"));
    assert_eq!(places(&report), places(&expected));
    // A band of a single altitude follows the common altitude.
    let report = json("--upload 5:altitude_m=60");
    assert_eq!(report["relays"][0]["h_m"].as_f64(), Some(60.0));
}

/// Checks that a rebooted relay gets an uploaded mission from its own storage or from its neighbours.
#[test]
fn a_reboot_with_or_without_a_store_ends_in_the_new_mission() {
    let folder = tempfile::tempdir().unwrap();
    let expected = places(&from_the_start(&folder, ""));
    for index in ["1", "4"] {
        let (kill, boot) = (format!("{index}@60"), format!("{index}@90"));
        let run = format!("--upload {MOVED} --kill {kill} --boot {boot}");
        let stored = json(&run);
        assert_eq!(places(&stored), expected);
        assert_eq!(whats(&stored, "adopted"), 8);
        let learned = json(&format!("{run} --no-store"));
        assert_eq!(places(&learned), expected);
        assert_eq!(whats(&learned, "adopted"), 9, "it adopts it anew");
        for report in [stored, learned] {
            let recovery = report["recovery"].as_array().unwrap();
            let news = recovery.iter().filter(|one| one.get("version").is_some());
            assert_eq!(news.count(), 1, "what is known is no news: {recovery:?}");
        }
    }
}

/// Checks that the remaining relays fly an uploaded mission if one relay is lost.
///
/// The relay is lost before, during or after the upload.
#[test]
fn the_remaining_relays_fly_the_upload() {
    let folder = tempfile::tempdir().unwrap();
    let seven = from_the_start(&folder, "--uavs 7");
    for at in ["5", "20.05", "25", "60"] {
        for index in ["1", "4", "8"] {
            let report = json(&format!("--upload {MOVED} --kill {index}@{at}"));
            assert_eq!(report["left"].as_u64(), Some(7), "{index}@{at}");
            assert_eq!(places(&report), places(&seven), "{index}@{at}");
        }
    }
}

#[test]
fn a_silent_relay_on_wires_stops_an_upload() {
    let late = "--upload 20:x_m=800 --kill 4@20 --wires";
    let report = unmet(late, "relay 4 went silent");
    let error = report["error"].as_str().unwrap();
    assert!(
        error.contains("mission version 1 was not adopted"),
        "{error}"
    );
    assert_eq!(report["version"].as_u64(), Some(0));
    assert!(report["virtual_s"].as_f64().unwrap() < 60.0);
}

#[test]
fn an_attack_has_no_effect_on_an_upload() {
    let run = format!("--upload {MOVED} --forge 2000 --replay 2000");
    let report = json(&run);
    let attack = &report["attack"];
    for kind in ["forged", "replayed"] {
        assert_eq!(attack[kind]["sent"].as_u64(), Some(2000), "{attack}");
        assert_eq!(attack[kind]["taken"].as_u64(), Some(0), "{attack}");
    }
    for key in ["moved", "misled", "unsafe_setpoints"] {
        assert_eq!(attack[key].as_u64(), Some(0), "{key} in {attack}");
    }
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(places(&report), places(&from_the_start(&folder, "")));
}

#[test]
fn an_upload_changes_the_hypothetical_interferer() {
    let file = example("multi_interferer.toml");
    let output = chain(&format!("--scenario {file} --upload 20:x_m=500 --json"));
    assert!(output.status.success());
    let notes = String::from_utf8(output.stderr).unwrap();
    assert!(
        notes.contains("replaces all interferers of the scenario")
            && notes.contains("--upload changes the interferer that the relays use"),
        "{notes}"
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["version"].as_u64(), Some(1));
}

#[test]
fn wrong_uploads_are_named_with_what_is_allowed() {
    insta::assert_snapshot!(refusals(&[
        "--upload 20:rx_lat_deg=91",
        "--upload 20:rx_lat_deg=47.4",
        "--scenario EXAMPLES/site.toml --upload 20:rx_lat_deg=49",
        "--scenario EXAMPLES/site.toml --upload 20:rx_lat_deg=47.42,distance_m=1000",
        "--upload x",
        "--upload 20:",
        "--upload 1e7",
        "--upload 20:x_m",
        "--upload 20:z=3",
        "--upload 20:x_m=1,x_m=2",
        "--upload 20:x_m=1e8",
        "--upload 20:y_m=NaN",
        "--upload 20:power_w=0",
        "--upload 20:altitude_m=0",
        "--upload 20:tolerance=1",
        "--upload 20:min_separation_m=500",
        "--upload 20:altitude_min_m=50",
        "--upload 20 --no-auth",
        "--upload-from rx",
        "--no-store",
        "--upload 20 --upload-from moon",
        "--upload 20 --scenario EXAMPLES/field.toml --method stochastic",
        "--upload 20 --scenario EXAMPLES/field.toml --method stochastic --closed-loop 2",
    ]));
}

/// Checks that drones fly to their positions on the new line if an upload moves the receiver.
#[test]
fn drones_fly_to_a_receiver_that_moves() {
    let site = example("site.toml");
    let report = json(&format!(
        "--scenario {site} --uavs 4 --fly --upload 60:rx_lat_deg=47.412,rx_lon_deg=8.552"
    ));
    assert_eq!(report["version"].as_u64(), Some(1));
    assert_eq!(whats(&report, "adopted"), 4);
    for drone in report["drones"].as_array().unwrap() {
        assert!(drone["flown"].as_bool().unwrap(), "{drone}");
        assert!(drone["off_m"].as_f64().unwrap() < 1.0, "{drone}");
    }
    // The positions equal those of a chain that starts with the distance of the new sites.
    let longer = json(&format!(
        "--uavs 4 --scenario {site} --upload 1:rx_lat_deg=47.412,rx_lon_deg=8.552"
    ));
    assert_eq!(places(&report), places(&longer));
}
