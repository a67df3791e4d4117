//! The progress line of a run that takes longer than a second, on a terminal.

use std::io::{IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

/// A run that is shorter has no line.
const SILENT: Duration = Duration::from_secs(1);

/// The line is written again after this time.
const EVERY: Duration = Duration::from_millis(100);

/// Erases the terminal line, from its beginning.
const ERASE: &str = "\r\u{1b}[K";

/// A line on standard error that is overwritten; erased at the end of the run.
pub(crate) struct Progress {
    started: Instant,
    shown: Option<Instant>,
    is_terminal: bool,
}

impl Progress {
    pub(crate) fn begin() -> Self {
        Self {
            started: Instant::now(),
            shown: None,
            is_terminal: std::io::stderr().is_terminal(),
        }
    }

    /// Shows `text`, where it is time to.
    pub(crate) fn show(&mut self, text: impl FnOnce() -> String) {
        let elapsed = self.started.elapsed();
        let is_due = self.shown.is_none_or(|shown| shown.elapsed() >= EVERY);
        if self.is_terminal && elapsed > SILENT && is_due {
            write(&format!("{ERASE}{} s: {}", elapsed.as_secs(), text()));
            self.shown = Some(Instant::now());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown.is_some() {
            write(ERASE);
        }
    }
}

/// A terminal that is gone is no fault of the run.
fn write(text: &str) {
    let mut out = std::io::stderr();
    _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}
