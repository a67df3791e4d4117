//! Error messages for invalid options: one line that names the allowed values, and exit status 2.

use std::io::Read as _;
use std::process::{Command, Stdio};

use super::{example, json, refusal};

#[test]
fn what_is_wrong_is_named_with_what_is_allowed() {
    let whole = |option: &str, value: &str, range: &str| {
        let line = format!(
            "invalid value '{value}' for '{option}': must be a whole number within {range}"
        );
        (
            format!("{} {value}", option.split(' ').next().unwrap()),
            line,
        )
    };
    let mut cases = vec![
        whole("--uavs <N>", "abc", "1 to 1000"),
        whole("--uavs <N>", "0", "1 to 1000"),
        whole("--uavs <N>", "-3", "1 to 1000"),
        whole("--uavs <N>", "99999999999999999999", "1 to 1000"),
        whole("--uavs <N>", "3.5", "1 to 1000"),
        whole("--seed <S>", "x", "0 to 18446744073709551615"),
        whole("--seed <S>", "-1", "0 to 18446744073709551615"),
        whole("--rounds <K>", "-1", "1 to 65535"),
        whole("--closed-loop <R>", "3x", "1 to 100"),
        whole("--baud <B>", "1e5", "300 to 10000000"),
        whole("--forge <N>", "0", "1 to 100000"),
        whole("--replay <N>", "many", "1 to 100000"),
        whole("--samples <K>", "1000001", "1 to 1000000"),
    ];
    let one_of = "must be one of align, align-step, adjust, joint, stochastic, stochastic-step";
    let not_a_file =
        "must be the name of a file: standard output has the report; a file of this name is ./-";
    for (arguments, line) in [
        ("--method foo", format!("invalid value 'foo' for '--method <M>': {one_of}")),
        ("--method alin", format!("invalid value 'alin' for '--method <M>': {one_of}; did you mean align?")),
        ("--air foo", "invalid value 'foo' for '--air <A>': must be one of csma, aloha, ideal".to_owned()),
        ("--upload 20 --upload-from moon", "invalid value 'moon' for '--upload-from <END>': must be one of tx, rx".to_owned()),
        ("--uav 3", "unexpected argument '--uav' found; did you mean --uavs?".to_owned()),
        ("three", "unexpected argument 'three' found; --help lists what there is".to_owned()),
        ("--svg -", format!("invalid value '-' for '--svg <FILE>': {not_a_file}")),
        ("--capture -", format!("invalid value '-' for '--capture <FILE>': {not_a_file}")),
        ("--loss -0.1", "invalid value '-0.1' for '--loss <P>': must be a number within 0.0 to 0.9".to_owned()),
        ("--uavs 999", "--uavs 999: must be within 1 to 250 without a --scenario: relays keep 4 m apart on 1000 m".to_owned()),
        ("--boot 3@1 --kill 3@5", "--boot 3@1: must be after --kill 3@5".to_owned()),
    ] {
        cases.push((arguments.to_owned(), line));
    }
    for (arguments, line) in cases {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        assert_eq!(refusal(&arguments), (2, line + "\n"), "{arguments:?}");
    }
}

#[test]
fn an_option_that_would_be_ignored_is_refused() {
    let field = example("field.toml");
    for (arguments, option, needs) in [
        (
            "--epsilon 0.2",
            "--epsilon 0.2",
            "align-step and stochastic-step",
        ),
        (
            "--epsilon 0.2 --method joint",
            "--epsilon 0.2",
            "--method joint has no fixed step",
        ),
        (
            "--explore 5",
            "--explore 5",
            "--method align has no rounds; adjust has",
        ),
        ("--rounds 5 --method joint", "--rounds 5", "adjust"),
        ("--grid 3x4", "--grid 3x4", "adjust"),
        (
            "--no-predict --method align-step",
            "--no-predict",
            "has a fixed step",
        ),
        (
            "--tolerance 0.01 --method align-step",
            "--tolerance 0.01",
            "--epsilon",
        ),
        ("--closed-loop 2", "--closed-loop", "--method align"),
        ("--burst 3", "--burst 3", "--loss"),
        ("--samples 5", "--samples 5", "--listen"),
        ("--shadow 0", "--shadow 0", "--listen"),
        (
            "--move-interferer 1,-2",
            "--move-interferer 1,-2",
            "--listen",
        ),
        ("--listen-for 30", "--listen-for 30", "--listen"),
        ("--takeover 1@5", "--takeover 1@", "--fly"),
        ("--upload-from tx", "--upload-from tx", "--upload"),
        ("--no-store", "--no-store", "--upload"),
        ("--upload 20 --no-store", "--no-store", "--boot"),
        ("--kill 3@5 --kill 3@9", "--kill 3@9", "--kill 3@5"),
        ("--soak 30 --kill 3@30", "--kill 3@30", "--soak 30"),
        (
            "--soak 30 --kill 3@5 --boot 3@31",
            "--boot 3@31",
            "--soak 30",
        ),
        (
            "--soak 30 --partition 3@40-50",
            "--partition 3@40",
            "--soak 30",
        ),
        ("--soak 30 --deaf 3:4@40", "--deaf 3:4", "--soak 30"),
        (
            "--soak 30 --upload 40:uav_w=2",
            "--upload 40:uav_w=2",
            "--soak 30",
        ),
        (
            "--soak 30 --fly --takeover 3@40",
            "--takeover 3",
            "--soak 30",
        ),
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let (status, line) = refusal(&arguments);
        assert_eq!(status, 2, "{arguments:?}: {line}");
        let (named, rest) = line.split_at(option.len());
        assert_eq!(named, option, "{line}");
        assert!(rest.contains(needs), "{needs} in {line}");
    }
    let (_, line) = refusal(&[
        "--scenario",
        &field,
        "--method",
        "stochastic-step",
        "--tolerance",
        "0.01",
    ]);
    assert!(
        line.starts_with("--tolerance 0.01: would be ignored"),
        "{line}"
    );
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
