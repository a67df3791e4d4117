//! Tests of the stored run, and of error messages for missing programs.

use super::*;

#[test]
fn results_contain_the_stored_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("../../examples/RESULTS.md")).unwrap();
    let folder = TempDir::new().unwrap();
    let copy = folder.path().join("RESULTS.md");
    // The copy has no table.
    let begin = readme.find("<!-- cargo compare").unwrap();
    let begin = begin + readme[begin..].find('\n').unwrap() + 1;
    let end = readme.find("<!-- end of that -->").unwrap();
    std::fs::write(&copy, readme[..begin].to_owned() + &readme[end..]).unwrap();
    let kept = root.join("rivals/measured.json");
    let arguments = [
        "--from",
        kept.to_str().unwrap(),
        "--into",
        copy.to_str().unwrap(),
    ];
    let output = compare(&arguments);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read_to_string(&copy).unwrap(), readme);

    std::fs::write(&copy, "no table").unwrap();
    let line = refusal(&compare(&arguments), 2);
    assert!(
        line.contains("--into") && line.contains("are missing"),
        "{line}"
    );
}

/// Checks in the stored run that SLSQP takes at least 20 times as long as this crate.
///
/// SLSQP starts from a single chain: the equally spaced chain from which it reaches this crate's SIR soonest. The
/// problems have eight and fifty relays with free altitudes. Problems with lateral offsets are not checked, because
/// this crate tries more than twice as many starts for them.
#[test]
fn slsqp_from_one_start_takes_20_times_our_time() {
    let kept = include_str!("../../rivals/measured.json");
    let kept: Value = serde_json::from_str(kept).unwrap();
    for solved in kept["problems"].as_array().unwrap() {
        let (choice, relays) = (&solved["problem"]["choice"], &solved["problem"]["relays"]);
        let runs = solved["runs"].as_array().unwrap();
        let found = |run: &Value| run["answer"]["found"].clone();
        let one = runs
            .iter()
            .find(|run| run["solver"] == "SciPy SLSQP, its best start alone");
        let (own, one) = (found(&runs[0]), found(one.unwrap()));
        let own_s = own["time_s"].as_f64().unwrap();
        let ratio = |time: &Value| time.as_f64().map(|time_s| time_s / own_s);
        let (level, all) = (ratio(&one["level"]["after_s"]), ratio(&one["time_s"]));
        println!("{choice} of {relays}: {level:?} to the same, {all:?} in all");
        if choice == "altitudes" && (relays == 8 || relays == 50) {
            assert!(level >= Some(20.0) && all >= Some(20.0));
        }
    }
}

#[test]
fn json_round_trip_is_the_identity() {
    let (sir, chain) = (2.25, [[350.5, 0.0, 20.0], [400.25, 0.5, 20.0]]);
    let own = run("own", 1e-5, sir, &chain);
    let mut rival = run("rival", 1.5, sir, &chain);
    rival["answer"]["found"]["good"] = json!({ "after_s": 0.5, "chain": chain });
    rival["answer"]["found"]["evaluations"] = json!(7);
    let lost = json!({ "solver": "lost", "answer": { "error": "why" } });
    let results = results("places", 2, &[own, rival, lost]);
    let output = rescored(&results, &["--json"]);
    assert_eq!(
        serde_json::from_slice::<Value>(&output.stdout).unwrap(),
        results
    );
}

/// Runs `compare` with `folder` as its whole PATH, so that it finds no other programs.
///
/// The virtual environment is the subfolder `venv`.
fn with_path(folder: &Path) -> Output {
    let venv = folder.join("venv");
    Command::new(env!("CARGO_BIN_EXE_compare"))
        .env("PATH", folder)
        .args(["--limit", "1", "--venv", venv.to_str().unwrap()])
        .output()
        .unwrap()
}

#[test]
fn missing_python_is_reported() {
    let folder = TempDir::new().unwrap();
    let line = refusal(&with_path(folder.path()), 2);
    assert!(line.starts_with("python3 is not on PATH: "), "{line}");
}

#[cfg(target_os = "linux")]
#[test]
fn missing_venv_pip_or_packages_are_reported() {
    use std::os::unix::fs::symlink;

    let folder = TempDir::new().unwrap();
    let python3 = folder.path().join("python3");
    symlink("/bin/false", &python3).unwrap();
    let line = refusal(&with_path(folder.path()), 2);
    assert!(line.contains("are venv and pip there?"), "{line}");

    std::fs::remove_file(&python3).unwrap();
    symlink("/bin/true", &python3).unwrap();
    let bin = folder.path().join("venv/bin");
    std::fs::create_dir_all(&bin).unwrap();
    symlink("/bin/false", bin.join("python")).unwrap();
    let line = refusal(&with_path(folder.path()), 2);
    assert!(
        line.contains("pip cannot install nlopt==") && line.contains("is there a network"),
        "{line}"
    );

    // Complete environment with a Python that does not answer.
    std::fs::remove_file(bin.join("python")).unwrap();
    symlink("/bin/true", bin.join("python")).unwrap();
    let line = refusal(&with_path(folder.path()), 1);
    assert!(line.contains("Python sent no answer"), "{line}");
}
