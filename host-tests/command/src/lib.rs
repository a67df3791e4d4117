//! What the commands have in common: how they refuse, and numbers from the command line.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use uav_relay::{ChannelLoad, Duration};

/// The fastest link there is, bit/s.
pub const MOST_BAUD: u32 = 10_000_000;

/// Why there is no result: the one line on standard error, and the exit status.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Failure {
    /// 1: it ran, but nothing meets what was asked. 2: the input is wrong.
    pub status: u8,
    /// What is wrong, in one line.
    pub line: String,
}

impl Failure {
    /// The input is wrong.
    pub fn input(line: impl Into<String>) -> Self {
        Self {
            status: 2,
            line: line.into(),
        }
    }

    /// Nothing meets what was asked.
    pub fn unmet(line: impl Into<String>) -> Self {
        Self {
            status: 1,
            line: line.into(),
        }
    }
}

/// The exit status of a command, after the line on standard error where it failed.
pub fn ended(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            complain(&failure.line);
            ExitCode::from(failure.status)
        }
    }
}

/// Help as it is; of an error one line that says what is wrong, and what is allowed.
pub fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        print(&error.to_string());
        return ExitCode::SUCCESS;
    }
    complain(&wrong(error));
    ExitCode::from(2)
}

/// What is wrong with the options, in one line.
fn wrong(error: &clap::Error) -> String {
    let text = error.to_string();
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let mut wrong = lines.next().unwrap_or("wrong options").to_owned();
    // Options that are missing are listed below the first line.
    if wrong.ends_with(':') {
        for missing in lines.take_while(|line| line.starts_with("  ")) {
            wrong.push(' ');
            wrong.push_str(missing.trim());
        }
    }
    // So are the values that there are, and what may have been meant.
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
        wrong.push_str("; --help lists what there is");
    }
    wrong.trim_start_matches("error: ").to_owned()
}

/// Says `line` on standard error. Where nobody reads that, the exit status has to do.
pub fn complain(line: &str) {
    _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints `text`. A reader that has had enough, such as `head`, is no fault of the command.
pub fn print(text: &str) {
    _ = std::io::stdout().write_all(text.as_bytes());
}

/// Says `line` on standard error. Nobody there to hear it is no fault of the command either.
pub fn say(line: &str) {
    _ = writeln!(std::io::stderr(), "{line}");
}

/// A report as one JSON object.
///
/// # Errors
/// A number that JSON does not have.
pub fn json(report: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string(report)
        .map(|json| json + "\n")
        .map_err(|error| Failure::input(error.to_string()))
}

/// Writes the picture that `--svg` asks for.
///
/// # Errors
/// Names the file, and why it cannot be written.
pub fn write(file: &std::path::Path, drawing: &str) -> Result<(), Failure> {
    std::fs::write(file, drawing).map_err(|error| {
        Failure::input(format!(
            "{}: --svg cannot be written: {error}",
            file.display()
        ))
    })
}

/// Whether a channel of `baud` carries relays that share it and ask a silent neighbour after `probe_after`.
///
/// # Errors
/// The least that does, how many relays share the channel, and what else would fit.
pub fn carries(baud: u32, load: ChannelLoad, probe_after: Duration) -> Result<(), String> {
    load.carried(baud, probe_after).map_err(|full| {
        let least = full.least_baud;
        format!("--baud {baud}: must be within {least} to {MOST_BAUD}: {full}")
    })
}

/// A number of the command line, within `least` to `most`.
///
/// # Errors
/// The range, where it is not one of them.
pub fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let range = || format!("must be a number within {least:?} to {most:?}");
    let value: f64 = text.parse().map_err(|_| range())?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(range())
    }
}

/// What reads a whole number of the command line, within `least` to `most`.
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

/// A file of the command line that is written to. Standard output, which `-` stands for elsewhere, has the report.
///
/// # Errors
/// What to say instead of `-`, and that it must not be empty.
pub fn file(text: &str) -> Result<PathBuf, String> {
    match text {
        "" => Err("must be the name of a file".to_owned()),
        "-" => Err(
            "must be the name of a file: standard output has the report; a file of this name is ./-"
                .to_owned(),
        ),
        name => Ok(name.into()),
    }
}
