//! A command line that is wrong: one line with the option, its value and what it may be.

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser;
use uav_relay_scenario::deployment::Deployment;

use crate::config::{self, Beyond, Given};

/// Reads the command line, and the file that `--config` names in it; where there is nothing to run, help or the mistake has been printed.
/// `section` is the program's own part of the file.
///
/// # Errors
/// The status to end with.
pub fn read<T: Parser>(section: fn(&Deployment, &mut Given)) -> Result<(T, Beyond), ExitCode> {
    let (words, beyond) = config::read::<T>(section).map_err(|line| refuse(&line))?;
    let options = T::try_parse_from(words).map_err(|error| {
        if !error.use_stderr() {
            // Help. Nobody is left to be told that it cannot be printed.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        refuse(&first(&error.to_string()))
    })?;
    Ok((options, beyond))
}

/// The mistake is the first paragraph; of the tips and the usage that follow, only what was meant is of use.
fn first(text: &str) -> String {
    let mut lines = text.lines().map(str::trim);
    let wrong: Vec<&str> = lines.by_ref().take_while(|line| !line.is_empty()).collect();
    let line = wrong.join(" ").trim_start_matches("error: ").to_owned();
    let meant = lines
        .filter(|line| line.starts_with("tip: ") && line.contains("similar"))
        .find_map(|line| {
            line.split_once("exists: ")
                .or_else(|| line.split_once("exist: "))
        });
    match meant {
        Some((_, meant)) => format!("{line}; did you mean {meant}?"),
        None => line,
    }
}

/// Says what is wrong.
pub fn refuse(line: &str) -> ExitCode {
    complain(line);
    ExitCode::from(2)
}

/// One line on standard error. Not `eprintln!`: that panics where nobody reads any more.
pub fn complain(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A whole number within `least` to `most`.
///
/// # Errors
/// The range, where it is not one of them.
pub fn whole<T: TryFrom<u64>>(text: &str, least: u64, most: u64) -> Result<T, String> {
    let value: Option<u64> = text.trim().parse().ok();
    value
        .filter(|value| (least..=most).contains(value))
        .and_then(|value| T::try_from(value).ok())
        .ok_or_else(|| format!("must be a whole number within {least} to {most}"))
}

/// A number within `least` to `most`.
///
/// # Errors
/// The range, where it is not one of them.
pub fn number(text: &str, least: f32, most: f32) -> Result<f32, String> {
    let value = text.trim().parse().ok();
    value
        .filter(|value| (least..=most).contains(value))
        .ok_or_else(|| format!("must be a number within {least:?} to {most:?}"))
}

/// One of several numbers.
///
/// # Errors
/// As [`number`], with its name.
pub fn named(name: &str, text: &str, least: f32, most: f32) -> Result<f32, String> {
    number(text, least, most).map_err(|error| format!("{name} {error}"))
}
