//! Runs all checks: `cargo ci`. The last lines name the failed ones, with their output.
//!
//! The steps run in three sequences (lanes) at the same time. Steps with the same target folder are in the main lane.
//! Steps with a target folder of their own are in a second lane, at low priority. Tests that mostly wait for the wall
//! clock are in a third lane.

mod prepare;
mod steps;

use std::collections::VecDeque;
use std::fmt::{Display, Formatter, Result as FormatResult};
use std::io::{BufRead, Result, Write, stdout};
use std::panic::resume_unwind;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use steps::{Lane, Step};

/// Runs all checks; the last lines name the failed ones, with their output.
#[derive(Parser)]
#[command(name = "cargo ci")]
struct Options {
    /// Run only the quick checks. Formatting, host lints, the library's tests and integration tests that take seconds.
    #[arg(long)]
    quick: bool,
    /// Run only the steps whose names contain this text.
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

fn main() -> ExitCode {
    let Options { quick, only } = Options::parse();
    let started = Instant::now();
    if let Err(missing) = prepare::prepare(quick) {
        println!("ci: {missing}");
        return ExitCode::FAILURE;
    }
    let mut steps = if quick { steps::quick() } else { steps::all() };
    steps.retain(|step| step.name.contains(&only));
    if steps.is_empty() {
        println!("ci: no step's name contains {only:?}");
        return ExitCode::FAILURE;
    }
    let all = steps.len();
    let (background, others): (Vec<_>, Vec<_>) = (1..)
        .zip(&steps)
        .partition(|(_, step)| step.lane == Lane::Background);
    let mut failed: Vec<(&str, Evidence)> = Vec::new();
    std::thread::scope(|scope| {
        let mut lanes = vec![scope.spawn(|| run_in_one_piece(background, all))];
        for (number, step) in others {
            if step.lane == Lane::Waiting {
                lanes.push(scope.spawn(move || run_in_one_piece(vec![(number, step)], all)));
            } else {
                failed.extend(run(number, all, step, &mut stdout()));
            }
        }
        for lane in lanes {
            match lane.join() {
                Ok(failures) => failed.extend(failures),
                Err(panic) => resume_unwind(panic),
            }
        }
    });
    let seconds = started.elapsed().as_secs();
    if failed.is_empty() {
        println!("\nci: all {all} steps passed in {seconds} s");
        ExitCode::SUCCESS
    } else {
        for (name, evidence) in &failed {
            println!("\n== {name} failed:\n{evidence}");
        }
        let names: Vec<&str> = failed.iter().map(|&(name, _)| name).collect();
        println!(
            "\nci: {} of {all} steps failed: {} ({seconds} s)",
            failed.len(),
            names.join("; ")
        );
        ExitCode::FAILURE
    }
}

/// Runs the numbered steps of `lane` one after the other; returns the failures.
///
/// A lane is a sequence of steps. The main lane runs at the same time.
///
/// The output of a step is printed at its end, so that it does not mix with others. `all` is the number of all steps,
/// for the headings.
fn run_in_one_piece(lane: Vec<(usize, &Step)>, all: usize) -> Vec<(&str, Evidence)> {
    let run = |(number, step)| {
        let mut output = Vec::new();
        let failure = run(number, all, step, &mut output);
        // The lines are written in one piece, so that they do not mix with those of other steps.
        _ = stdout().write_all(&output);
        failure
    };
    lane.into_iter().filter_map(run).collect()
}

/// Runs step `number` of `all`, and writes its output and result to `out`.
///
/// Returns `None` if it passed, otherwise its name and the relevant output.
fn run<'a>(
    number: usize,
    all: usize,
    step: &'a Step,
    out: &mut impl Write,
) -> Option<(&'a str, Evidence)> {
    let Step { name, command, .. } = step;
    _ = writeln!(out, "\n== {number}/{all} {name}: {command}");
    let begun = Instant::now();
    let failure = step.run(out).err();
    let result = if failure.is_none() {
        "passed"
    } else {
        "FAILED"
    };
    let seconds = begun.elapsed().as_secs();
    _ = writeln!(out, "== {name} {result} in {seconds} s");
    failure.map(|evidence| (&**name, evidence))
}

/// Number of last output lines that are repeated at the end for a failed step without tests.
const LAST_LINES: usize = 20;

/// Maximum number of lines repeated from a list of failures, either panics or names of failed tests.
const LINES_OF_FAILURES: usize = 100;

/// Relevant output of a failed step: the `failures:` of each test binary, or the last lines.
#[derive(Default)]
pub(crate) struct Evidence {
    failures: Vec<String>,
    last: VecDeque<String>,
    /// Number of lines still to keep of the present list of failures; `None` outside of such a list.
    remaining: Option<usize>,
}

impl Evidence {
    /// Copies a step's `output` to `out`, line by line, and keeps the lines about failures.
    pub(crate) fn read(&mut self, mut output: impl BufRead, out: &mut impl Write) -> Result<()> {
        let mut line = Vec::new();
        while output.read_until(b'\n', &mut line)? > 0 {
            out.write_all(&line)?;
            self.add(String::from_utf8_lossy(&line).trim_end());
            line.clear();
        }
        Ok(())
    }

    pub(crate) fn add(&mut self, line: &str) {
        // This heading comes before the panics, and a second time before the names.
        if line == "failures:" {
            self.remaining = Some(LINES_OF_FAILURES);
        }
        if line.starts_with("test result:") && self.remaining.take().is_some() {
            self.failures.push(line.to_owned());
        }
        if let Some(remaining @ 1..) = &mut self.remaining {
            *remaining -= 1;
            self.failures.push(line.to_owned());
        }
        if self.last.len() == LAST_LINES {
            self.last.pop_front();
        }
        self.last.push_back(line.to_owned());
    }
}

impl Display for Evidence {
    fn fmt(&self, f: &mut Formatter<'_>) -> FormatResult {
        if self.failures.is_empty() {
            self.last.iter().try_for_each(|line| writeln!(f, "{line}"))
        } else {
            self.failures
                .iter()
                .try_for_each(|line| writeln!(f, "{line}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Evidence;

    #[test]
    fn failures_of_each_test_binary_are_kept_with_their_panics() {
        let output = "running 2 tests\ntest a ... ok\ntest b ... FAILED\n\nfailures:\n\n---- b stdout ----\npanicked at 3\n\n\
                      failures:\n    b\n\ntest result: FAILED. 1 passed\nrunning 1 test\ntest c ... ok\ntest result: ok. 1 passed\n";
        let mut evidence = Evidence::default();
        output.lines().for_each(|line| evidence.add(line));
        let kept = evidence.to_string();
        assert!(
            kept.starts_with("failures:\n\n---- b stdout ----\npanicked at 3\n"),
            "{kept}"
        );
        assert!(
            kept.ends_with("    b\n\ntest result: FAILED. 1 passed\n"),
            "{kept}"
        );
    }

    #[test]
    fn a_step_without_tests_is_reported_by_its_last_lines() {
        let mut evidence = Evidence::default();
        (0..50).for_each(|number| evidence.add(&format!("line {number}")));
        let kept = evidence.to_string();
        assert!(
            kept.starts_with("line 30\n") && kept.ends_with("line 49\n"),
            "{kept}"
        );
    }
}
