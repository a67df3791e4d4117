//! Progress line on a terminal.

use std::io::{IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

/// Run time before the line is shown.
const SILENT: Duration = Duration::from_secs(1);

/// Update interval of the line.
const EVERY: Duration = Duration::from_millis(100);

const ERASE: &str = "\r\u{1b}[K";

/// Progress line on standard error, erased at the end of the run.
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

    /// Shows `text` if an update is due.
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

/// Ignores write errors: a closed terminal is not an error of the run.
fn write(text: &str) {
    let mut out = std::io::stderr();
    _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}
