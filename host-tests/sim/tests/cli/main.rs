//! Command-line interface of `cargo chain`: options, JSON and exit statuses.
#![cfg(test)]
#![allow(clippy::float_cmp)]

mod capture;
mod hostile;
mod methods;
mod rotation;
mod traffic;
mod upload;
mod web;

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn chain(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chain"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn json(arguments: &str) -> Value {
    let output = chain(&format!("--json {arguments}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments}: {errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Returns the report of a run with exit status 1, whose error contains `reason`.
fn unmet(arguments: &str, reason: &str) -> Value {
    let output = chain(&format!("--json {arguments}"));
    assert_eq!(output.status.code(), Some(1), "{arguments}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(
        report["error"].as_str().unwrap().contains(reason),
        "{report}"
    );
    report
}

/// Returns the exit status of `cargo chain` with `arguments`, and its only line on standard error.
fn refusal(arguments: &str) -> (i32, String) {
    let output = chain(arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
    (output.status.code().unwrap(), text)
}

#[test]
fn the_json_has_every_field_of_the_contract() {
    let report = json("--uavs 3 --seed 5");
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
    let output = chain("");
    assert!(output.status.success() && output.stderr.is_empty());
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("worst hop: SIR 2.4655") && table.contains("8 relays, method `align`"),
        "{table}"
    );
    assert!(
        table.contains("cost: 1 sweep along the chain, 14 messages"),
        "{table}"
    );
    assert_eq!(table.lines().count(), 1 + 8 + 1 + 2, "{table}");
}

/// Checks that the table has a y column if relays may leave the line. The test selects the method `joint` by its alias
/// `altitude`.
#[test]
fn the_table_has_y_if_lateral_offsets_are_allowed() {
    let side = example("side.toml");
    let table = |arguments: &str| String::from_utf8(chain(arguments).stdout).unwrap();
    let beside = table(&format!("--scenario {side} --uavs 2 --method altitude"));
    assert!(
        beside.contains("y [m]") && beside.contains("method `joint`"),
        "{beside}"
    );
    assert!(!table("--uavs 2").contains("y [m]"));
}

#[test]
fn the_same_seed_prints_the_same_bytes() {
    let bad_day = "--json --loss 0.3 --corrupt 0.15 --duplicate 0.1 --reorder 0.1 --seed";
    let go = |seed| chain(&format!("{bad_day} {seed}")).stdout;
    assert_eq!(go("3"), go("3"));
    assert_ne!(go("3"), go("4"));
    let report: Value = serde_json::from_slice(&go("3")).unwrap();
    assert!(report["faults"]["lost"].as_u64().unwrap() > 0);
}

/// Returns each command line of `cases` with its error line, and checks that its exit status is 2.
///
/// `EXAMPLES` stands for the folder of the examples.
fn refusals(cases: &[&str]) -> String {
    let examples = example("");
    let mut all = String::new();
    for case in cases {
        let options = case.replace("EXAMPLES/", &examples);
        let (status, line) = refusal(&options);
        assert_eq!(status, 2, "{case}: {line}");
        write!(all, "{case}\n    {}", line.replace(&examples, "EXAMPLES/")).unwrap();
    }
    all
}

fn example(name: &str) -> String {
    format!("{}/../../examples/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_chain_without_agreement_gives_status_1_and_a_reason_in_json() {
    unmet("--uavs 3 --kill 1@5 --kill 2@5", "no quorum");

    // The scenario cannot be changed here, so the error names the option; the JSON has the same message.
    let output = chain("--json --uavs 1000");
    assert_eq!(output.status.code(), Some(2));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let error = report["error"].as_str().unwrap();
    assert!(
        error.starts_with("--uavs 1000: must be within 1 to 250 "),
        "{report}"
    );
}

#[test]
fn a_killed_relay_on_wires_breaks_the_chain_as_reported() {
    let report = unmet("--uavs 4 --kill 2@0.01 --wires", "relay 2 went silent");
    let silences = report["silences"].as_array().unwrap();
    assert_eq!(silences.len(), 2);
    // Detected by the first probe after 15 s; probes are at most 10 s / 16 apart, plus an eighth.
    let latest_s = 15.0 + 10.0 / 16.0 * 1.125;
    assert!(
        silences
            .iter()
            .all(|silence| silence["silent"] == 2 && silence["at_s"].as_f64().unwrap() <= latest_s),
        "{silences:?}"
    );
}

#[test]
fn an_override_of_a_relay_beyond_the_chain_is_refused() {
    let example = example("scenario.toml");
    let output = chain(&format!("--uavs 4 --scenario {example}"));
    assert_eq!(output.status.code(), Some(2));
    let line = String::from_utf8(output.stderr).unwrap();
    assert!(
        line.ends_with(
            "scenario.toml: [[relay]] index = 5: the chain has only 4 relays; allowed: 1 to 4\n"
        ),
        "{line}"
    );
}

const WRONG: &[&str] = &[
    "--uavs 0",
    "--uavs 1001",
    "--uavs many",
    "--loss 0.95",
    "--corrupt NaN",
    "--duplicate -1",
    "--duplicate=-1",
    "--reorder x",
    "--tolerance 0",
    "--epsilon inf",
    "--kill 3",
    "--kill 9@1",
    "--kill 0@1",
    "--kill 3@-1",
    "--boot 3",
    "--boot 9@1",
    "--partition 3",
    "--partition 8@1",
    "--partition 0@1-2",
    "--partition 3@5-5",
    "--uavs 1 --partition 1@1",
    "--partition 3@1 --wires",
    "--forge 0",
    "--replay 100001",
    "--auth --no-auth",
    "--shared --wires",
    "--seed -3",
    "--method magic",
    "--nonsense",
    "--scenario no/such/file.toml",
    "--svg no/such/folder/a.svg",
    "--uavs abc",
    "--uavs -3",
    "--uavs 99999999999999999999",
    "--uavs 3.5",
    "--seed x",
    "--seed -1",
    "--rounds -1",
    "--closed-loop 3x",
    "--baud 1e5",
    "--replay many",
    "--samples 1000001",
    "--method foo",
    "--method alin",
    "--air foo",
    "--upload 20 --upload-from moon",
    "--uav 3",
    "three",
    "--svg -",
    "--capture -",
    "--loss -0.1",
    "--uavs 999",
    "--boot 3@1 --kill 3@5",
    "--air csma --wires",
    "--air tdma",
    "--baud 299",
    "--burst 0.5",
    "--burst 2 --loss 0.7",
    "--deaf 4:3",
    "--deaf 4@3",
    "--deaf 4:4@1",
    "--deaf 4:3@9-5",
    "--deaf 9:3@1",
    "--deaf 3:0@1",
    "--fly --soak 60 --fleet 1",
    "--fly --soak 60 --fleet 12 --flying 6",
    "--fly --soak 60 --fleet 12 --flying 13",
    "--fly --soak 60 --fleet 12 --endurance 299",
    "--fly --soak 60 --fleet 12 --ground-time -1",
    "--fly --soak 60 --fleet 12 --kill 3@5",
    "--fly --soak 60 --fleet 12 --uavs 8",
    "--fleet 12 --soak 60",
    "--fly --soak 60 --flying 8",
    "--soak 0",
];

const IGNORED: &[&str] = &[
    "--epsilon 0.2",
    "--epsilon 0.2 --method joint",
    "--explore 5",
    "--rounds 5 --method joint",
    "--grid 3x4",
    "--no-predict --method align-step",
    "--tolerance 0.01 --method align-step",
    "--closed-loop 2",
    "--burst 3",
    "--reach 3",
    "--samples 5",
    "--shadow 0",
    "--move-interferer 1,-2",
    "--listen-for 30",
    "--takeover 1@5",
    "--upload-from tx",
    "--no-store",
    "--upload 20 --no-store",
    "--kill 3@5 --kill 3@9",
    "--soak 30 --kill 3@30",
    "--soak 30 --kill 3@5 --boot 3@31",
    "--soak 30 --partition 3@40-50",
    "--soak 30 --deaf 3:4@40",
    "--soak 30 --upload 40:uav_w=2",
    "--soak 30 --fly --takeover 3@40",
    "--scenario EXAMPLES/field.toml --method stochastic-step --tolerance 0.01",
];

#[test]
fn errors_name_the_value_and_what_is_allowed() {
    insta::assert_snapshot!(refusals(WRONG));
}

#[test]
fn an_option_that_would_be_ignored_is_refused() {
    insta::assert_snapshot!(refusals(IGNORED));
}

/// Checks that an option is accepted where it has an effect, and refused where it has no effect.
#[test]
fn a_useful_option_is_accepted() {
    for arguments in [
        "--uavs 2 --method align-step --epsilon 0.5",
        "--uavs 2 --method adjust --rounds 3 --explore 2 --grid 5x5 --no-predict --tolerance 0.001",
        "--uavs 3 --loss 0.1 --burst 2",
        "--uavs 3 --kill 2@20 --boot 2@40 --kill 2@60 --boot 2@80",
        "--uavs 3 --kill 2@20 --boot 2@20",
        "--uavs 3 --boot 2@20",
        "--uavs 3 --soak 30 --kill 2@29",
    ] {
        json(arguments);
    }
}

/// Checks that an error names keys of the scenario file if the user gave such a file.
#[test]
fn errors_with_a_scenario_file_name_its_keys() {
    let output = chain(&format!(
        "--scenario {} --uavs 999",
        example("scenario.toml")
    ));
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(line.contains("geometry.min_separation_m"), "{line}");
    let most = json("--uavs 250");
    assert_eq!(most["uavs"], 250);
}

/// Checks that a report never says that an upload was not adopted if relays have adopted it.
#[test]
fn an_adopted_upload_is_never_reported_as_not_adopted() {
    for (arguments, is_denied) in [
        ("--uavs 2 --upload 20 --kill 1@40", false),
        ("--wires --upload 20 --kill 4@20", true),
    ] {
        let output = chain(arguments);
        assert_eq!(output.status.code(), Some(1));
        let all = [output.stdout, output.stderr].concat();
        let text = String::from_utf8(all).unwrap();
        assert_eq!(
            text.contains("mission version 1 adopted"),
            !is_denied,
            "{text}"
        );
        for denial in ["was not adopted", "no upload was adopted"] {
            assert_eq!(text.contains(denial), is_denied, "{denial} in {text}");
        }
    }
}

/// Checks that a closed output pipe changes no exit status and causes no panic.
#[test]
fn a_closed_output_changes_no_exit_status() {
    let several = example("multi_interferer.toml");
    for (arguments, status) in [
        ("--uavs 3", 0),
        ("--uavs 3 --json", 0),
        ("--help", 0),
        ("--uavs 0", 2),
        ("--epsilon 1", 2),
        ("--uavs 2 --kill 1@20", 1),
        // This scenario prints notes on standard error.
        (&format!("--uavs 3 --scenario {several}"), 0),
    ] {
        for closed in [[true, false], [false, true], [true, true]] {
            let mut child = Command::new(env!("CARGO_BIN_EXE_chain"))
                .args(arguments.split_whitespace())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let (mut out, mut err) = (child.stdout.take(), child.stderr.take());
            if closed[0] {
                out = None;
            }
            if closed[1] {
                err = None;
            }
            let (mut said, mut wrong) = (String::new(), String::new());
            if let Some(mut out) = out {
                out.read_to_string(&mut said).unwrap();
            }
            if let Some(mut err) = err {
                err.read_to_string(&mut wrong).unwrap();
            }
            assert_eq!(
                child.wait().unwrap().code(),
                Some(status),
                "{arguments:?} {closed:?}: {wrong}"
            );
            assert!(!wrong.contains("panicked"), "{wrong}");
        }
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .unwrap()
}

/// Checks that no cargo alias hides the progress of a build. A minute without output looks like a hang.
#[test]
fn no_command_hides_cargos_progress() {
    let text = std::fs::read_to_string(root().join(".cargo/config.toml")).unwrap();
    let aliases: Vec<&str> = text
        .lines()
        .filter(|line| line.contains("= \"run "))
        .collect();
    assert!(
        aliases.iter().any(|line| line.starts_with("chain = ")),
        "{text}"
    );
    for line in aliases {
        let is_quiet = line.contains("--quiet") || line.contains(" -q ");
        assert!(!is_quiet, "{line}");
    }
}

/// Returns the CPU time, s, in user and in system mode, of all child processes that have ended.
fn cpu_of_children() -> [f64; 2] {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let (_, after) = text.rsplit_once(')').unwrap();
    let fields: Vec<&str> = after.split_whitespace().collect();
    // Fields `cutime` and `cstime` of proc(5), in ticks of 10 ms.
    [fields[13], fields[14]].map(|ticks| ticks.parse::<f64>().unwrap() / 100.0)
}

#[test]
#[ignore = "builds the simulator anew, and measures CPU time, so that other work disturbs it"]
fn the_first_command_builds_in_60_s_of_cpu_time() {
    let empty = tempfile::tempdir().unwrap();
    let before = cpu_of_children();
    let output = Command::new(env!("CARGO"))
        .current_dir(root())
        .args(["chain", "--json"])
        .env("CARGO_TARGET_DIR", empty.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let after = cpu_of_children();
    let [user_s, system_s] = [after[0] - before[0], after[1] - before[1]];
    println!("{user_s:.1} s of user and {system_s:.1} s of system time");
    assert!(user_s + system_s <= 60.0);
}

#[test]
fn the_simulator_builds_without_the_crates_of_other_tools() {
    let output = Command::new(env!("CARGO"))
        .current_dir(root())
        .args(["tree", "--package", "uav-relay-sim", "--locked"])
        .args(["--edges", "normal,build", "--prefix", "none"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let is_built = |name: &str| text.lines().any(|line| line.starts_with(name));
    assert!(is_built("uav-relay-scenario v"), "{text}");
    for other in [
        "anstream v",
        "indicatif v",
        "mavlink v",
        "pcap-file v",
        "plotters v",
        "sha2 v",
        "syn v1.",
        "syn v2.",
        "thiserror v1.",
        "toml_edit v",
        "uav-relay-decode v",
        "uav-relay-page v",
        "wasm-bindgen v",
        "zerocopy v",
    ] {
        assert!(!is_built(other), "{other}: {text}");
    }
}
