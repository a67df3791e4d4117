//! `cargo figures`: the figures of the paper's evaluation and further ones, as SVG, CSV and a page.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use uav_relay_sim::command;
use uav_relay_sim::command::Failure;
use uav_relay_tools::figures::sheet::{FigureError, Sheet, write_index, write_sheet};
use uav_relay_tools::figures::{ALL, Figure};

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(run(&options).map_err(|trouble| failure(&trouble))),
        Err(error) => command::usage(&error),
    }
}

fn failure(trouble: &FigureError) -> Failure {
    let line = trouble.to_string();
    match trouble {
        FigureError::File(..) => Failure::input(line),
        _ => Failure::unmet(line),
    }
}

fn run(options: &Options) -> Result<(), FigureError> {
    let started = Instant::now();
    let dir = &options.out;
    std::fs::create_dir_all(dir)
        .map_err(|error| FigureError::File(format!("--out {}", dir.display()), error))?;
    let asked = |figure: &&Figure| {
        options.only.is_empty() || options.only.iter().any(|name| name == figure.name)
    };
    let chosen: Vec<&Figure> = ALL.iter().filter(asked).collect();
    let progress = Progress::begin(chosen.len());
    let made: Result<Vec<Sheet>, FigureError> = chosen
        .into_par_iter()
        .map(|figure| {
            let sheet = (figure.make)()?;
            write_sheet(dir, &sheet)?;
            progress.made(figure.name);
            Ok(sheet)
        })
        .collect();
    progress.bar.finish_and_clear();
    let sheets = made?;
    let index = write_index(dir, &sheets)?;
    let tables: usize = sheets.iter().map(|sheet| sheet.tables.len()).sum();
    command::print(&format!(
        "{} figures and {tables} tables in {:.1} s: {}\n",
        sheets.len(),
        started.elapsed().as_secs_f64(),
        index.display()
    ));
    Ok(())
}

/// Progress display of `cargo figures`.
///
/// It is a bar on a terminal, and otherwise a line on standard error for each figure.
struct Progress {
    bar: ProgressBar,
    is_terminal: bool,
    figures: usize,
    made: AtomicUsize,
}

impl Progress {
    fn begin(figures: usize) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        let bar = if is_terminal {
            ProgressBar::new(figures as u64)
        } else {
            ProgressBar::hidden()
        };
        if let Ok(style) = ProgressStyle::with_template(
            "{spinner} {elapsed} {bar:30} {pos} of {len} figures {msg}",
        ) {
            bar.set_style(style);
        }
        if is_terminal {
            // A figure takes up to a minute. The clock shows that the program is running.
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Self {
            bar,
            is_terminal,
            figures,
            made: AtomicUsize::new(0),
        }
    }

    fn made(&self, name: &str) {
        let made = self.made.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.set_message(format!("(last: {name})"));
        self.bar.inc(1);
        if !self.is_terminal {
            command::print_line(&format!("{made} of {} figures: {name}", self.figures));
        }
    }
}

/// Computes every figure of the paper's evaluation, and this project's own, with the code that flies. Pictures (SVG), their numbers
/// (CSV), and index.html with all of them.
#[derive(Parser, Debug)]
#[command(name = "figures", bin_name = "cargo figures", disable_version_flag = true, after_help = figures())]
struct Options {
    /// Output folder; created if necessary
    #[arg(long, value_name = "DIR", default_value = "target/figures")]
    out: PathBuf,
    /// Make only this figure; repeatable. index.html then shows only the requested ones
    #[arg(long, value_name = "NAME", value_parser = name)]
    only: Vec<String>,
}

fn names() -> String {
    ALL.map(|figure| figure.name).join(", ")
}

fn figures() -> String {
    format!("Figures: {}", names())
}

fn name(text: &str) -> Result<String, String> {
    if ALL.iter().any(|figure| figure.name == text) {
        Ok(text.to_owned())
    } else {
        Err(format!("must be one of {}", names()))
    }
}
