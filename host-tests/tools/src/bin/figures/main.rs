//! `cargo figures`: every figure of the paper's evaluation, and this project's own, as SVG, CSV and a page.

mod options;

use std::io::IsTerminal as _;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser as _;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use uav_relay_sim::command::{self, Failure};
use uav_relay_tools::figures::page::{write_index, write_sheet};
use uav_relay_tools::figures::sheet::Sheet;
use uav_relay_tools::figures::trouble::Trouble;
use uav_relay_tools::figures::{ALL, Figure};

use options::Options;

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(run(&options).map_err(|trouble| failure(&trouble))),
        Err(error) => command::usage(&error),
    }
}

fn failure(trouble: &Trouble) -> Failure {
    let line = trouble.to_string();
    match trouble {
        Trouble::File(..) => Failure::input(line),
        _ => Failure::unmet(line),
    }
}

/// Makes the figures that are asked for, and says where they are.
fn run(options: &Options) -> Result<(), Trouble> {
    let started = Instant::now();
    let dir = &options.out;
    std::fs::create_dir_all(dir)
        .map_err(|error| Trouble::File(format!("--out {}", dir.display()), error))?;
    let asked = |figure: &&Figure| {
        options.only.is_empty() || options.only.iter().any(|name| name == figure.name)
    };
    let chosen: Vec<&Figure> = ALL.iter().filter(asked).collect();
    let bar = progress(chosen.len());
    let made: Result<Vec<Sheet>, Trouble> = chosen
        .into_par_iter()
        .map(|figure| {
            let sheet = (figure.make)()?;
            write_sheet(dir, &sheet)?;
            bar.set_message(figure.name);
            bar.inc(1);
            Ok(sheet)
        })
        .collect();
    bar.finish_and_clear();
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

/// A bar on a terminal, else nothing.
fn progress(figures: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(figures as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}") {
        bar.set_style(style);
    }
    bar.tick();
    bar
}
