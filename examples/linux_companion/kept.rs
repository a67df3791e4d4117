//! A file that is written in flight. Where the disk does not take it the relay stays in the air: it is said once, counted, and tried
//! again every second.

use std::path::{Path, PathBuf};

use serde_json::json;
use uav_relay::{Duration, Instant};

use uav_relay_linux::keep::keep;
use uav_relay_linux::log::Log;

/// Between two tries.
const AGAIN: Duration = Duration::from_millis(1_000);

/// A file, and how it went.
#[derive(Debug)]
pub(crate) struct Kept {
    option: &'static str,
    file: PathBuf,
    failures: u64,
    failing: bool,
    again_at: Instant,
}

impl Kept {
    pub(crate) fn new(option: &'static str, file: &Path) -> Self {
        Self {
            option,
            file: file.to_owned(),
            failures: 0,
            failing: false,
            again_at: Instant::ZERO,
        }
    }

    /// Whether it is of use to try: not so soon after a try that failed.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        !self.failing || self.again_at <= now
    }

    /// Makes `bytes` all that is in the file; whether they are.
    pub(crate) fn put(&mut self, now: Instant, log: &Log, bytes: &[u8]) -> bool {
        let Self { option, file, .. } = self;
        let name = format!("{option} {}", file.display());
        let result = keep(file, bytes);
        let was = core::mem::replace(&mut self.failing, result.is_err());
        match result {
            Ok(()) => {
                if was {
                    let failures = self.failures;
                    log.say(
                        now,
                        "file",
                        json!({ "file": self.file.display().to_string(), "failures": failures }),
                        format_args!("{name}: is written again, after {failures} failures"),
                    );
                }
                true
            }
            Err(error) => {
                self.failures += 1;
                self.again_at = now + AGAIN;
                if !was {
                    log.say(
                        now,
                        "file",
                        json!({ "file": self.file.display().to_string(), "failures": self.failures }),
                        format_args!(
                            "{name}: cannot be written: {error}; the relay flies on, and tries again every second"
                        ),
                    );
                }
                false
            }
        }
    }

    /// How often it could not be written.
    pub(crate) const fn failures(&self) -> u64 {
        self.failures
    }
}
