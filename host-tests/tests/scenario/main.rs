//! Scenario files: meaning of valid ones, and one helpful line for every mistake.

mod earth;
mod example;
mod fleet;
mod keys;
mod meaning;
mod mistakes;
mod planned;
mod power;

use std::fmt::Write as _;

use uav_relay_scenario::{Problem, Scenario, ScenarioError};

/// First part of the smallest valid files. `POWER`, and `INTERFERER` or `FIELD`, complete them.
const GEOMETRY: &str = "[geometry]\ndistance_m = 1000\naltitude_m = 20\n";
const POWER: &str = "[power]\ntx_w = 80\nuav_w = 1\n";
const INTERFERER: &str = "[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";
const FIELD: &str = "[field]\ni_max_w = 1e-9\nbeta = [{ x_m = 0, alpha = 4, beta = 2 }]\n";

fn small(extra: &str) -> String {
    format!("{GEOMETRY}{POWER}{INTERFERER}{extra}")
}

fn parse(text: &str) -> Result<Scenario, ScenarioError> {
    Scenario::parse("flight.toml", text)
}

/// Asserts that the file `text` is refused for `problem`. The error is one line with the file's name and all of
/// `parts`.
fn refused(text: &str, problem: Problem, parts: &[&str]) {
    let error = parse(text).expect_err(text);
    one_line(&error, "flight.toml", parts);
    assert_eq!(error.problem, problem, "{error}\n{text}");
}

fn one_line(error: &ScenarioError, file: &str, parts: &[&str]) {
    let line = error.to_string();
    assert_eq!(line.lines().count(), 1, "{line:?}");
    assert!(!line.chars().any(char::is_control), "{line:?}");
    assert!(line.chars().count() < 400, "too long to read: {line}");
    assert!(line.starts_with(&format!("{file}: ")), "{line}");
    for part in parts {
        assert!(line.contains(part), "no {part:?} in: {line}");
    }
}

/// Returns the kind of problem and the error line of each file.
fn refusals(files: &[String]) -> String {
    let mut all = String::new();
    for text in files {
        let error = parse(text).expect_err(text);
        one_line(&error, "flight.toml", &[]);
        let problem = format!("{:?}", error.problem);
        let kind = problem.split('(').next().unwrap_or_default();
        writeln!(all, "{kind}\n    {error}").unwrap();
    }
    all
}
