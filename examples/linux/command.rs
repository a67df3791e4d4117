//! Command-line parsing. A mistake is reported in one line with the option, its value and the allowed range.

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser;
use uav_relay_scenario::deployment::Deployment;
use uav_relay_scenario::number::{brief, shortest};

use crate::config::{self, FileOnlySettings, FileOptions};

/// Parses the command line and the file named by `--config`.
///
/// `section` adds the options from the section of the file that only this program reads, such as `[companion]`.
///
/// # Errors
/// The exit status after `--help` or a mistake; the message has been printed.
pub fn read<T: Parser>(
    section: fn(&Deployment, &mut FileOptions),
) -> Result<(T, FileOnlySettings), ExitCode> {
    let (words, beyond) = config::read::<T>(section).map_err(|line| refuse(&line))?;
    let options = T::try_parse_from(words).map_err(|error| {
        if !error.use_stderr() {
            // Text of help or version. A closed standard output is ignored.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        refuse(&one_line(&error))
    })?;
    Ok((options, beyond))
}

/// Returns the first paragraph of clap's error as one line, with the suggested spelling.
pub fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let mut lines = text.lines().map(str::trim);
    let wrong: Vec<&str> = lines.by_ref().take_while(|line| !line.is_empty()).collect();
    let mut line = wrong.join(" ").trim_start_matches("error: ").to_owned();
    if let Some((value, names)) = line.split_once(" [possible values: ") {
        line = format!("{value}: must be one of {}", names.trim_end_matches(']'));
    }
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

/// Prints the mistake `line` to standard error, and returns exit status 2.
pub fn refuse(line: &str) -> ExitCode {
    print_line(line);
    ExitCode::from(2)
}

/// Writes one line to standard error. Unlike `eprintln!`, it does not panic if standard error is closed.
pub fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Parser of an option's value, as clap takes it.
pub trait Parse<T>: Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {}

impl<T, F: Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static> Parse<T> for F {}

/// Returns the parser of a whole number in the range `least` to `most`. The parser's error text names the range.
pub fn whole<T: TryFrom<u64>>(least: u64, most: u64) -> impl Parse<T> {
    move |text: &str| {
        let value: Option<u64> = text.trim().parse().ok();
        value
            .filter(|value| (least..=most).contains(value))
            .and_then(|value| T::try_from(value).ok())
            .ok_or_else(|| format!("must be a whole number within {least} to {most}"))
    }
}

/// Returns the parser of a number in a range, in the unit `unit`. The parser's error text names the range and the unit.
pub fn number([least, most]: [f32; 2], unit: &'static str) -> impl Parse<f32> {
    move |text: &str| {
        let value = text.trim().parse().ok();
        value
            .filter(|value| (least..=most).contains(value))
            .ok_or_else(|| {
                let [least, most] = [least, most].map(|limit| brief(shortest(limit)));
                format!("must be a number within {least} to {most} {unit}")
                    .trim_end()
                    .to_owned()
            })
    }
}

/// Parses one of several numbers in an option's value. Errors have its name `name` and its unit `unit`.
///
/// # Errors
/// A message with the name, the allowed range and the unit.
pub fn named(name: &str, text: &str, range: [f32; 2], unit: &'static str) -> Result<f32, String> {
    number(range, unit)(text).map_err(|error| format!("{name} {error}"))
}
