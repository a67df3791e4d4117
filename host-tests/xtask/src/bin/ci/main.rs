//! Runs all checks one after the other; `cargo ci`. The last lines name the failed ones, with their output.

mod evidence;
mod prepare;
mod steps;

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;

/// Runs all checks one after the other; the last lines name the failed ones, with their output.
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
    let mut failed = Vec::new();
    for (number, step) in (1..).zip(&steps) {
        println!(
            "\n== {number}/{} {}: {}",
            steps.len(),
            step.name,
            step.command
        );
        let begun = Instant::now();
        let result = step.run();
        println!(
            "== {} {} in {} s",
            step.name,
            if result.is_ok() { "passed" } else { "FAILED" },
            begun.elapsed().as_secs()
        );
        if let Err(evidence) = result {
            failed.push((&*step.name, evidence));
        }
    }
    let (all, seconds) = (steps.len(), started.elapsed().as_secs());
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
