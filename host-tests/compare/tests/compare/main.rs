//! `cargo compare` without Python: scores, tables, and errors if Python is missing.
#![cfg(test)]

mod kept;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};
use tempfile::TempDir;
use uav_relay_oracle::cases;
use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::Corridor;

fn compare(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_compare"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Checks that a run failed with this exit status; returns its only line on standard error.
fn refusal(output: &Output, status: i32) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(output.stdout.is_empty());
    assert_eq!(output.status.code(), Some(status), "{text}");
    text
}

fn results(choice: &str, relays: u16, runs: &[Value]) -> Value {
    json!({
        "machine": { "date": "2000-01-01", "processor": "Some CPU" },
        "versions": { "python": "3.11.1", "scipy": "1.2.3", "nlopt": "4.5.6" },
        "limit_s": 30.0,
        "problems": [{ "problem": { "choice": choice, "relays": relays }, "runs": runs }],
    })
}

fn rescored(results: &Value, more: &[&str]) -> Output {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("results.json");
    std::fs::write(&file, results.to_string()).unwrap();
    compare(&[&["--from", file.to_str().unwrap()], more].concat())
}

fn table(results: &Value) -> String {
    let output = rescored(results, &[]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// Returns SIR (linear) and positions [x, y, altitude], m, of the best chain of eight relays at 20 m.
///
/// An independent program has computed it. The tests use it as the result of a correct solver.
fn best_of_eight() -> (f64, Vec<[f64; 3]>) {
    let cases = cases::of("gamma_star").unwrap();
    let found = cases.iter().find(|case| {
        let scene = case.params.y.total_cmp(&400.0).is_eq();
        scene && case.relays() == Some(8) && case.part_list("x").is_some()
    });
    let case = found.unwrap();
    let x = case.part_list("x").unwrap();
    let chain = x.into_iter().map(|x| [x, 0.0, 20.0]).collect();
    (case.part("gamma").unwrap(), chain)
}

fn run(solver: &str, time_s: f64, sir: f64, chain: &[[f64; 3]]) -> Value {
    let found = json!({ "time_s": time_s, "sir": sir, "chain": chain, "cut": false });
    json!({ "solver": solver, "answer": { "found": found } })
}

/// Returns the table cells of a solver "rival" with the result `rival` for eight relays.
fn line_of_rival(rival: Value) -> String {
    let (sir, chain) = best_of_eight();
    let own = run("own", 1e-5, sir, &chain);
    let text = table(&results("places", 8, &[own, rival]));
    let line = text.lines().find(|line| line.contains("| rival |"));
    let cells = line.unwrap().trim_start_matches("| 8 | rival | ");
    cells.to_owned()
}

#[test]
fn help_names_every_option() {
    let output = compare(&["--help"]);
    assert!(output.status.success() && output.stderr.is_empty());
    let help = String::from_utf8(output.stdout).unwrap();
    for option in [
        "--limit <S>",
        "--json",
        "--from <FILE>",
        "--into <FILE>",
        "--venv <DIR>",
        "[default: 30]",
    ] {
        assert!(help.contains(option), "{option} in {help}");
    }
}

#[test]
fn wrong_options_are_named() {
    for limit in ["0", "601", "soon"] {
        let line = refusal(&compare(&["--limit", limit]), 2);
        assert!(line.contains("--limit") && line.contains(limit), "{line}");
    }
    let line = refusal(&compare(&["--from", "nowhere.json"]), 2);
    assert!(line.contains("--from nowhere.json"), "{line}");
    let line = refusal(&rescored(&json!({ "limit_s": 3 }), &[]), 2);
    assert!(
        line.contains("results.json") && line.contains("machine"),
        "{line}"
    );
    let (sir, chain) = best_of_eight();
    let unknown = results("places", 7, &[run("own", 1e-5, sir, &chain)]);
    let line = refusal(&rescored(&unknown, &[]), 2);
    assert!(
        line.contains("places of 7: not one of the problems"),
        "{line}"
    );
}

#[test]
fn the_table_has_a_row_per_solver_and_host_and_date() {
    let (sir, chain) = best_of_eight();
    let own = run("own", 1.26e-5, sir, &chain);
    let mut quick = run("quick", 0.00251, sir, &chain);
    quick["answer"]["found"]["evaluations"] = json!(1_234_567);
    quick["answer"]["found"]["good"] = json!({ "after_s": 6.3e-4, "chain": chain });
    quick["answer"]["found"]["level"] = json!({ "after_s": 1.26e-3, "chain": chain });
    let mut slow = run("slow", 31.0, sir, &chain);
    slow["answer"]["found"]["cut"] = json!(true);
    let lost = json!({ "solver": "lost", "answer": { "error": "no | way" } });
    let text = table(&results("places", 8, &[own, quick, slow, lost]));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        &lines[..8],
        [
            "Places, all at 20 m (the default scenario):",
            "",
            "| N | solver | SIR of the worst hop | short of the optimum by | the same in f32 | chains evaluated | within 1e-4 of it after | as good as the first line after | time in all |",
            "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
            "| 8 | own | 2.465536 | less than 1e-8 | 1.7e-6 |  | never | never | 13 µs (1.0) |",
            "| 8 | quick | 2.465536 | less than 1e-8 | 1.7e-6 | 1 234 567 | 630 µs (50) | 1.3 ms (100) | 2.5 ms (200) |",
            "| 8 | slow | 2.465536 | less than 1e-8 | 1.7e-6 |  | never | never | 31 s (2 500 000), cut off |",
            "| 8 | lost | no   way | | | | | | |",
        ]
    );
    assert!(!text.contains("examples/altitudes.toml"), "{text}");
    let last = "2000-01-01 on Some CPU; Python 3.11.1, SciPy 1.2.3, NLopt 4.5.6, at most 30 s a solver and problem.";
    assert_eq!(lines.last(), Some(&last));
}

#[test]
fn the_reported_sir_is_that_of_the_positions() {
    let (sir, chain) = best_of_eight();
    assert!(
        line_of_rival(run("rival", 1.0, sir, &chain)).starts_with("2.465536 | less than 1e-8 |")
    );
    // All hops of the best chain have the same SIR, so a relay moved by 1 m makes one hop worse.
    let mut moved = chain.clone();
    moved[3][0] -= 1.0;
    let x: Vec<f64> = moved.iter().map(|[x, ..]| *x).collect();
    let worse = Link::paper(8).chain_sir(&x);
    let line = line_of_rival(run("rival", 1.0, worse, &moved));
    let short = (sir - worse) / sir;
    assert!(
        line.starts_with(&format!("{worse:.6} | {short:.1e} |")),
        "{line}"
    );
    // The reported SIR is checked.
    let line = line_of_rival(run("rival", 1.0, sir, &moved));
    assert!(
        line.starts_with("does not count: it reports SIR 2.465536, and has 2.3"),
        "{line}"
    );
}

/// Returns the best SIR and positions of eight relays in `corridor`, 150 m beside the interferer.
fn best_beside(corridor: Corridor) -> (f64, Vec<[f64; 3]>) {
    let link = Link {
        y_i: 150.0,
        min_separation_m: 4.0,
        ..Link::paper(8)
    };
    let best = optimum(&link, corridor, &[]).unwrap().unwrap();
    let places = best.places.iter();
    let chain = places.map(|place| [place.x_m, place.y_m, place.altitude_m]);
    (best.sir, chain.collect())
}

#[test]
fn chosen_altitudes_count_in_the_sir() {
    let corridor = Corridor::plane(20.0, 300.0);
    let (sir, mut chain) = best_beside(corridor);
    let own = run("own", 0.01, sir, &chain);
    chain[2][2] = 300.5;
    let high = run("high", 0.01, sir, &chain);
    let text = table(&results("altitudes", 8, &[own, high]));
    assert!(
        text.starts_with("Places and altitudes (`examples/altitudes.toml`):\n"),
        "{text}"
    );
    assert!(
        text.contains("| 8 | own | 1.235784 | less than 1e-8 |"),
        "{text}"
    );
    assert!(
        text.contains("| 8 | high | does not count: relay 3 is at h = 300.5 m |"),
        "{text}"
    );
}

#[test]
fn an_invalid_chain_does_not_count() {
    let (sir, best) = best_of_eight();
    let line_of = |chain: &[[f64; 3]]| line_of_rival(run("rival", 1.0, sir, chain));
    let moved = |relay: usize, axis: usize, to_m: f64| {
        let mut chain = best.clone();
        chain[relay - 1][axis] = to_m;
        line_of(&chain)
    };
    let mut swapped = best.clone();
    swapped.swap(2, 3);
    let near_m = |apart_m: f64| best[5][0] - apart_m;
    for (line, reason) in [
        (line_of(&best[..7]), "it has 7 relays"),
        (moved(1, 0, -0.5), "relay 1 is at x = -0.5 m"),
        (moved(8, 0, 1000.5), "relay 8 is at x = 1000.5 m"),
        (moved(5, 2, 20.5), "relay 5 is at h = 20.5 m"),
        (moved(6, 1, -0.5), "relay 6 is at y = -0.5 m"),
        (line_of(&swapped), "relay 4 is behind the one before it"),
        (
            moved(5, 0, near_m(3.99)),
            "relay 6 is 3.990 m from the one before it",
        ),
    ] {
        assert_eq!(line, format!("does not count: {reason} | | | | | | |"));
    }
    // Rounding to f32 is permitted.
    let line = moved(5, 0, near_m(3.9995));
    assert!(!line.contains("m from the one before it"), "{line}");
}

#[test]
fn the_good_enough_limit_is_applied() {
    let (sir, chain) = best_of_eight();
    let mut moved = chain.clone();
    moved[3][0] -= 0.01;
    let mut rival = run("rival", 1.0, sir, &chain);
    rival["answer"]["found"]["good"] = json!({ "after_s": 0.5, "chain": chain });
    assert!(line_of_rival(rival.clone()).contains("| 500 ms (50 000) |"));
    rival["answer"]["found"]["good"]["chain"] = json!(moved);
    assert!(line_of_rival(rival.clone()).contains("| never |"));
    // A chain with the SIR of this crate's chain counts as equal.
    rival["answer"]["found"]["level"] = json!({ "after_s": 0.25, "chain": chain });
    assert!(line_of_rival(rival.clone()).contains("| 250 ms (25 000) |"));
    rival["answer"]["found"]["level"]["chain"] = json!(moved);
    assert!(!line_of_rival(rival.clone()).contains("| 250 ms"));
    rival["answer"]["found"]["good"]["chain"][3] = json!(chain[4]);
    assert!(line_of_rival(rival).starts_with("does not count: relay 5 is 0.000 m"));
}

#[test]
fn chosen_lateral_offsets_count_in_the_sir() {
    let corridor = Corridor {
        left_m: -280.0,
        right_m: 280.0,
        ..Corridor::plane(20.0, 300.0)
    };
    let (sir, mut chain) = best_beside(corridor);
    let own = run("own", 0.01, sir, &chain);
    chain[2][1] = -280.5;
    let far = run("far", 0.01, sir, &chain);
    let text = table(&results("sides", 8, &[own, far]));
    assert!(text.contains("| 8 | own | 1.543032 | "), "{text}");
    assert!(
        text.contains("| 8 | far | does not count: relay 3 is at y = -280.5 m |"),
        "{text}"
    );
}
