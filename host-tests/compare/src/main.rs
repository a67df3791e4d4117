//! `cargo compare`: this crate's placements compared with those of general-purpose optimisers.
//!
//! | file | content |
//! | --- | --- |
//! | `problem` | the problems and their true optima |
//! | `own` | chains and times of this crate |
//! | `environment` | Python with SciPy and NLopt |
//! | `rivals` | chains and times of the other solvers |
//! | `results` | the results, as printed by `--json` |
//! | `score` | evaluation of a chain, independent of the solver |
//! | `table` | the results as markdown |
//! | `machine` | machine and date |

mod environment;
mod machine;
mod own;
mod problem;
mod results;
mod rivals;
mod score;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use uav_relay_sim::command::{self, Failure};

use machine::Machine;
use problem::Problem;
use results::{Results, Solved};
use rivals::{Rivals, SOLVERS};

/// Places relays with this crate, SciPy and NLopt, and prints what each reached in which time. All run on this
/// machine, one after the other. The table is markdown.
#[derive(Parser, Debug)]
#[command(
    name = "compare",
    bin_name = "cargo compare",
    disable_version_flag = true
)]
struct Options {
    /// Processor time limit of a Python solver per problem, seconds, 1 to 600
    #[arg(long, value_name = "S", default_value_t = 30, value_parser = clap::value_parser!(u16).range(1..=600))]
    limit: u16,
    /// Print one JSON object with every chain instead of the table
    #[arg(long)]
    json: bool,
    /// Score the chains of an earlier --json again; nothing is solved, and Python is not needed
    #[arg(long, value_name = "FILE", conflicts_with_all = ["limit", "venv"])]
    from: Option<PathBuf>,
    /// Replace the table in FILE, between the two comments that mark it, with an excerpt
    #[arg(long, value_name = "FILE")]
    into: Option<PathBuf>,
    /// Folder of Python's virtual environment, created if necessary; target/compare by default
    #[arg(long, value_name = "DIR")]
    venv: Option<PathBuf>,
}

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(run(&options).map(|text| command::print(&text))),
        Err(error) => command::usage(&error),
    }
}

fn run(options: &Options) -> Result<String, Failure> {
    let results = match &options.from {
        Some(file) => read(file)?,
        None => solve(options)?,
    };
    if let Some(file) = &options.into {
        put(file, &table::excerpt(&results).map_err(Failure::input)?)?;
    }
    if options.json {
        return command::json(&results);
    }
    table::table(&results).map_err(Failure::input)
}

/// Comments in RESULTS.md before and after the table. `--into` replaces the text between them.
const MARKS: [&str; 2] = [
    "<!-- cargo compare --into examples/RESULTS.md -->\n",
    "<!-- end of that -->\n",
];

fn put(file: &Path, excerpt: &str) -> Result<(), Failure> {
    let wrong = |why: String| Failure::input(format!("--into {}: {why}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| wrong(error.to_string()))?;
    let [begin, end] = MARKS;
    let parts = text
        .split_once(begin)
        .and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)));
    let Some((before, after)) = parts else {
        return Err(wrong(format!(
            "the lines {} and {} are missing",
            begin.trim(),
            end.trim()
        )));
    };
    let text = format!("{before}{begin}\n{excerpt}\n{end}{after}");
    std::fs::write(file, text).map_err(|error| wrong(error.to_string()))
}

fn read(file: &Path) -> Result<Results, Failure> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("cannot be read: {error}"));
    let results =
        text.and_then(|text| serde_json::from_str(&text).map_err(|error| error.to_string()));
    results.map_err(|error| Failure::input(format!("--from {}: {error}", file.display())))
}

fn solve(options: &Options) -> Result<Results, Failure> {
    let problems = problem::all();
    // Hidden unless standard error is a terminal.
    let bar = ProgressBar::new((problems.len() * SOLVERS.len()) as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:24} {pos}/{len} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.set_message("Python's packages");
    let python = environment::python(
        options
            .venv
            .as_deref()
            .unwrap_or(Path::new(environment::USUAL)),
    )
    .map_err(Failure::input)?;
    bar.set_message("warming up");
    let mut rivals = Rivals::start(&python, f64::from(options.limit)).map_err(Failure::unmet)?;
    let mut solved = Vec::new();
    for problem in problems {
        solved.push(by_all(problem, &mut rivals, &bar).map_err(Failure::unmet)?);
    }
    bar.finish_and_clear();
    Ok(Results {
        machine: Machine::this(),
        versions: rivals.versions().clone(),
        limit_s: f64::from(options.limit),
        problems: solved,
    })
}

/// Solves one problem with this crate, and then with every other solver.
///
/// Each other solver also reports the time at which its SIR first reached that of this crate's chain.
fn by_all(problem: Problem, rivals: &mut Rivals, bar: &ProgressBar) -> Result<Solved, String> {
    let mut runs = own::runs(problem)?;
    let level = table::level(problem, &runs)?;
    for solver in SOLVERS {
        bar.set_message(format!("{problem}: {}", solver.title));
        runs.push(rivals.run(solver, problem, level)?);
        bar.inc(1);
    }
    Ok(Solved { problem, runs })
}
