//! Errors, output and number parsing of the commands.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use uav_relay::{ChannelLoad, Duration};
use uav_relay_scenario::number::brief;

/// Maximum of `--baud`, bit/s.
pub const MOST_BAUD: u32 = 10_000_000;

/// Error of a command: one line for standard error, and the exit status.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Failure {
    /// Exit status: 1 if the input is right but the request cannot be met, 2 if the input is wrong.
    pub status: u8,
    /// Error message of the command, one line.
    pub line: String,
}

impl Failure {
    /// Creates an error for wrong input (exit status 2).
    pub fn input(line: impl Into<String>) -> Self {
        Self {
            status: 2,
            line: line.into(),
        }
    }

    /// Creates an error for a request that cannot be met (exit status 1).
    pub fn unmet(line: impl Into<String>) -> Self {
        Self {
            status: 1,
            line: line.into(),
        }
    }
}

/// Prints the error of a command, if any, and returns the exit status.
pub fn ended(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            print_line(&failure.line);
            ExitCode::from(failure.status)
        }
    }
}

/// Prints the requested help, or one line about a wrong option. Returns the exit status.
pub fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        print(&error.to_string());
        return ExitCode::SUCCESS;
    }
    print_line(&wrong(error));
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
    // Permitted values and suggestions are listed separately, too.
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

/// Prints the line `line` on standard error; a closed pipe is ignored.
pub fn print_line(line: &str) {
    _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints `text` on standard output. A closed standard output, as after `| head`, is ignored.
pub fn print(text: &str) {
    _ = std::io::stdout().write_all(text.as_bytes());
}

/// Formats an option with its value, as in `--option value`, if it is given.
pub fn given_option(option: &str, value: Option<impl std::fmt::Display>) -> Option<String> {
    value.map(|value| format!("{option} {value}"))
}

/// Formats a report as one JSON object and a line break.
///
/// # Errors
/// The report contains a value that JSON cannot represent.
pub fn json(report: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string(report)
        .map(|json| json + "\n")
        .map_err(|error| Failure::input(error.to_string()))
}

/// Writes SVG text to the file of the option `--svg`.
///
/// # Errors
/// The file cannot be written: the message names the file and the reason.
pub fn write(file: &std::path::Path, drawing: &str) -> Result<(), Failure> {
    std::fs::write(file, drawing).map_err(|error| {
        Failure::input(format!(
            "{}: --svg cannot be written: {error}",
            file.display()
        ))
    })
}

/// Checks that a radio channel of `baud` bit/s is fast enough for the relays that share it.
///
/// `load` has the number of relays. After the silence `probe_after` a relay asks a neighbour for a heartbeat.
///
/// # Errors
/// States the lowest sufficient data rate, the number of relays, and the alternatives.
pub fn carries(baud: u32, load: ChannelLoad, probe_after: Duration) -> Result<(), String> {
    load.carried(baud, probe_after)
        .map_err(|full| format!("--baud {baud}: {full}"))
}

/// Parses a number without a unit in the range `least` to `most`.
///
/// # Errors
/// The text is not a number in this range; the message states the range.
pub fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    quantity(text, least, most, "")
}

/// Parses a number in the range `least` to `most`, in the unit `unit`, for example `m/s`.
///
/// # Errors
/// The text is not a number in this range; the message states the range and the unit.
pub fn quantity(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value
        .filter(|value| (least..=most).contains(value))
        .ok_or_else(|| {
            let [least, most] = [least, most].map(brief);
            format!("must be a number within {least} to {most} {unit}")
                .trim_end()
                .to_owned()
        })
}

/// Returns a parser for whole numbers in the range `least` to `most`.
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

/// Parses the name of an output file. `-` is rejected, because the report goes to standard output.
///
/// # Errors
/// The name is empty or `-`. For `-` the message states how a file of this name is given.
pub fn file(text: &str) -> Result<PathBuf, String> {
    match text {
        "" => Err("must be the name of a file".to_owned()),
        "-" => Err(
            "must be the name of a file: standard output is used for the report; a file whose name is - is written ./-"
                .to_owned(),
        ),
        name => Ok(name.into()),
    }
}
