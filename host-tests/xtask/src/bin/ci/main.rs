//! `cargo ci`: everything that must pass, one step after the other; the last line says what did not.

mod prepare;
mod steps;

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;

/// Runs everything that must pass, one step after the other; the last line says what did not.
#[derive(Parser)]
#[command(name = "cargo ci")]
struct Options {
    /// Only what every edit needs: formatting, lints of the host, the library's tests and those that are done in seconds.
    #[arg(long)]
    quick: bool,
}

fn main() -> ExitCode {
    let Options { quick } = Options::parse();
    let started = Instant::now();
    if let Err(missing) = prepare::prepare(quick) {
        println!("ci: {missing}");
        return ExitCode::FAILURE;
    }
    let steps = if quick { steps::quick() } else { steps::all() };
    let (mut failed, mut left_out) = (Vec::new(), 0);
    for (number, step) in (1..).zip(&steps) {
        println!(
            "\n== {number}/{} {}: {}",
            steps.len(),
            step.name,
            step.command
        );
        if let Some(tool) = step.needs.filter(|tool| !tool.is_there()) {
            println!("== {} left out; for it, type: {}", step.name, tool.get);
            left_out += 1;
            continue;
        }
        let begun = Instant::now();
        let passed = step.run();
        println!(
            "== {} {} in {} s",
            step.name,
            if passed { "passed" } else { "FAILED" },
            begun.elapsed().as_secs()
        );
        if !passed {
            failed.push(&*step.name);
        }
    }
    let seconds = started.elapsed().as_secs();
    let run = steps.len() - left_out;
    if failed.is_empty() {
        println!("\nci: all {run} steps passed in {seconds} s, {left_out} left out");
        ExitCode::SUCCESS
    } else {
        println!(
            "\nci: {} of {run} steps failed: {} ({seconds} s, {left_out} left out)",
            failed.len(),
            failed.join("; ")
        );
        ExitCode::FAILURE
    }
}
