//! Error messages for invalid options: one line that names the allowed values, and exit status 2.

use std::io::Read as _;
use std::process::{Command, Stdio};

use super::{example, json, refusals};

const WRONG: &[&str] = &[
    "--uavs abc",
    "--uavs 0",
    "--uavs -3",
    "--uavs 99999999999999999999",
    "--uavs 3.5",
    "--seed x",
    "--seed -1",
    "--rounds -1",
    "--closed-loop 3x",
    "--baud 1e5",
    "--forge 0",
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
fn what_is_wrong_is_named_with_what_is_allowed() {
    insta::assert_snapshot!(refusals(WRONG));
}

#[test]
fn an_option_that_would_be_ignored_is_refused() {
    insta::assert_snapshot!(refusals(IGNORED));
}

/// Checks the same options where they have an effect.
#[test]
fn an_option_that_is_of_use_is_taken() {
    for arguments in [
        "--uavs 2 --method align-step --epsilon 0.5",
        "--uavs 2 --method adjust --rounds 3 --explore 2 --grid 5x5 --no-predict --tolerance 0.001",
        "--uavs 3 --loss 0.1 --burst 2",
        "--uavs 3 --kill 2@20 --boot 2@40 --kill 2@60 --boot 2@80",
        "--uavs 3 --kill 2@20 --boot 2@20",
        "--uavs 3 --boot 2@20",
        "--uavs 3 --soak 30 --kill 2@29",
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        json(&arguments);
    }
}

/// Errors name keys of a scenario only if the user gave one.
#[test]
fn who_has_a_scenario_is_told_its_keys() {
    let output = super::chain(&["--scenario", &example("scenario.toml"), "--uavs", "999"]);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(line.contains("geometry.min_separation_m"), "{line}");
    let most = json(&["--uavs", "250"]);
    assert_eq!(most["uavs"], 250);
}

/// A mission that was adopted is never reported as not adopted.
#[test]
fn what_was_adopted_is_not_denied() {
    for (arguments, is_denied) in [
        (
            &["--uavs", "2", "--upload", "20", "--kill", "1@40"][..],
            false,
        ),
        (&["--wires", "--upload", "20", "--kill", "4@20"], true),
    ] {
        let output = super::chain(arguments);
        assert_eq!(output.status.code(), Some(1));
        let all = [output.stdout, output.stderr].concat();
        let text = String::from_utf8(all).unwrap();
        assert_eq!(text.contains("mission 1 adopted"), !is_denied, "{text}");
        for denial in ["was not adopted", "no upload was adopted"] {
            assert_eq!(text.contains(denial), is_denied, "{denial} in {text}");
        }
    }
}

/// A closed output pipe causes no panic (exit status 101).
#[test]
fn whoever_does_not_listen_changes_no_status() {
    let several = example("multi_interferer.toml");
    for (arguments, status) in [
        (&["--uavs", "3"][..], 0),
        (&["--uavs", "3", "--json"], 0),
        (&["--help"], 0),
        (&["--uavs", "0"], 2),
        (&["--epsilon", "1"], 2),
        (&["--uavs", "2", "--kill", "1@20"], 1),
        // This scenario prints notes on standard error.
        (&["--uavs", "3", "--scenario", &several], 0),
    ] {
        for closed in [[true, false], [false, true], [true, true]] {
            let mut child = Command::new(env!("CARGO_BIN_EXE_chain"))
                .args(arguments)
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
