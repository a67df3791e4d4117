//! A command line that is wrong: one line with the option, its value and what it may be.

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser;

/// Reads the command line; where there is nothing to run, help or the mistake has been printed.
pub(crate) fn read<T: Parser>() -> Result<T, ExitCode> {
    T::try_parse().map_err(|error| {
        if !error.use_stderr() {
            // Help. Nobody is left to be told that it cannot be printed.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        // The mistake is the first paragraph; usage and tips follow.
        let text = error.to_string();
        let wrong: Vec<&str> = text
            .lines()
            .take_while(|line| !line.trim().is_empty())
            .map(str::trim)
            .collect();
        refuse(wrong.join(" ").trim_start_matches("error: "))
    })
}

/// Says what is wrong.
pub(crate) fn refuse(line: &str) -> ExitCode {
    complain(line);
    ExitCode::from(2)
}

/// One line on standard error. Not `eprintln!`: that panics where nobody reads any more.
pub(crate) fn complain(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A number within `least` to `most`.
///
/// # Errors
/// The range, where it is not one of them.
pub(crate) fn number(text: &str, least: f32, most: f32) -> Result<f32, String> {
    let value = text.trim().parse().ok();
    value
        .filter(|value| (least..=most).contains(value))
        .ok_or_else(|| format!("must be a number within {least:?} to {most:?}"))
}

/// One of several numbers.
///
/// # Errors
/// As [`number`], with its name.
pub(crate) fn named(name: &str, text: &str, least: f32, most: f32) -> Result<f32, String> {
    number(text, least, most).map_err(|error| format!("{name} {error}"))
}
