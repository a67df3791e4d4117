//! Shared parts of the commands: errors, output and parsing of numbers.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use uav_relay::{ChannelLoad, Duration};

/// Largest data rate, bit/s.
pub const MOST_BAUD: u32 = 10_000_000;

/// Error of a command: the line on standard error, and the exit status.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Failure {
    /// 1: the request cannot be met. 2: the input is wrong.
    pub status: u8,
    /// Error message, one line.
    pub line: String,
}

impl Failure {
    /// Creates an error for wrong input.
    pub fn input(line: impl Into<String>) -> Self {
        Self {
            status: 2,
            line: line.into(),
        }
    }

    /// Creates an error for a request that cannot be met.
    pub fn unmet(line: impl Into<String>) -> Self {
        Self {
            status: 1,
            line: line.into(),
        }
    }
}

/// Prints the error, if any, and returns the exit status.
pub fn ended(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            complain(&failure.line);
            ExitCode::from(failure.status)
        }
    }
}

/// Prints help, or an option error as one line that says what is allowed, and returns the exit status.
pub fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        print(&error.to_string());
        return ExitCode::SUCCESS;
    }
    complain(&wrong(error));
    ExitCode::from(2)
}

fn wrong(error: &clap::Error) -> String {
    let text = error.to_string();
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let mut wrong = lines.next().unwrap_or("wrong options").to_owned();
    // clap lists missing options below the first line.
    if wrong.ends_with(':') {
        for missing in lines.take_while(|line| line.starts_with("  ")) {
            wrong.push(' ');
            wrong.push_str(missing.trim());
        }
    }
    // Allowed values and suggestions are listed separately, too.
    let told = |kind| match error.get(kind) {
        Some(ContextValue::String(one)) => one.clone(),
        Some(ContextValue::Strings(all)) => all.join(", "),
        _ => String::new(),
    };
    let allowed = told(ContextKind::ValidValue);
    if !allowed.is_empty() {
        wrong = format!("{wrong}: must be one of {allowed}");
    }
    let meant = [ContextKind::SuggestedArg, ContextKind::SuggestedValue].map(told);
    if let Some(meant) = meant.iter().find(|meant| !meant.is_empty()) {
        wrong = format!("{wrong}; did you mean {meant}?");
    } else if error.kind() == ErrorKind::UnknownArgument {
        wrong.push_str("; --help lists the options");
    }
    wrong.trim_start_matches("error: ").to_owned()
}

/// Prints `line` on standard error; a closed pipe is ignored.
pub fn complain(line: &str) {
    _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints `text`; a closed pipe, such as that of `head`, is ignored.
pub fn print(text: &str) {
    _ = std::io::stdout().write_all(text.as_bytes());
}

/// Prints `line` on standard error; a closed pipe is ignored.
pub fn say(line: &str) {
    _ = writeln!(std::io::stderr(), "{line}");
}

/// Formats a report as one JSON object.
///
/// # Errors
/// A number that JSON cannot represent.
pub fn json(report: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string(report)
        .map(|json| json + "\n")
        .map_err(|error| Failure::input(error.to_string()))
}

/// Writes the picture of `--svg`.
///
/// # Errors
/// Names the file and the reason.
pub fn write(file: &std::path::Path, drawing: &str) -> Result<(), Failure> {
    std::fs::write(file, drawing).map_err(|error| {
        Failure::input(format!(
            "{}: --svg cannot be written: {error}",
            file.display()
        ))
    })
}

/// Checks that a channel of `baud` carries relays with this load and this `probe_after`.
///
/// # Errors
/// The least sufficient data rate, the number of relays on the channel, and the alternatives.
pub fn carries(baud: u32, load: ChannelLoad, probe_after: Duration) -> Result<(), String> {
    load.carried(baud, probe_after).map_err(|full| {
        let least = full.least_baud;
        format!("--baud {baud}: must be within {least} to {MOST_BAUD}: {full}")
    })
}

/// Parses a number of the command line within `least` to `most`.
///
/// # Errors
/// The allowed range.
pub fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let range = || format!("must be a number within {least:?} to {most:?}");
    let value: f64 = text.parse().map_err(|_| range())?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(range())
    }
}

/// Returns a parser of whole numbers of the command line within `least` to `most`.
pub fn whole<T>(least: T, most: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync
where
    T: std::str::FromStr + std::fmt::Display + PartialOrd + Copy + Send + Sync,
{
    move |text| {
        let value = text
            .parse()
            .ok()
            .filter(|value| (least..=most).contains(value));
        value.ok_or_else(|| format!("must be a whole number within {least} to {most}"))
    }
}

/// Parses the name of an output file; `-` is rejected, because standard output carries the report.
///
/// # Errors
/// The name is empty or `-`, with the alternative.
pub fn file(text: &str) -> Result<PathBuf, String> {
    match text {
        "" => Err("must be the name of a file".to_owned()),
        "-" => Err(
            "must be the name of a file, because standard output has the report; for a file named - give ./-"
                .to_owned(),
        ),
        name => Ok(name.into()),
    }
}
