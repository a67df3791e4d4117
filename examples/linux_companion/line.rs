//! One line on standard output: seconds since the start, and what happened.

use std::fmt;
use std::io::Write as _;

use uav_relay::Instant;

/// Writes it. Not `println!`: that panics when nobody reads any more.
///
/// # Errors
/// Where standard output takes it no more.
pub(crate) fn line(now: Instant, text: fmt::Arguments<'_>) -> Result<(), String> {
    let micros = now.as_micros();
    let (seconds, millis) = (micros / 1_000_000, micros / 1_000 % 1_000);
    writeln!(std::io::stdout(), "{seconds:>6}.{millis:03} s  {text}")
        .map_err(|error| format!("standard output: {error}"))
}
