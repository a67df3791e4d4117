//! Machine and date of a run, and the clock for processor time.

use std::process::Command;
use std::time::Instant;

use serde::{Deserialize, Serialize};

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Machine {
    pub(crate) date: String,
    pub(crate) processor: String,
}

impl Machine {
    pub(crate) fn this() -> Self {
        Self {
            date: date().unwrap_or_else(|| "an unknown day".to_owned()),
            processor: processor().unwrap_or_else(|| "an unknown processor".to_owned()),
        }
    }
}

fn date() -> Option<String> {
    let output = Command::new("date").args(["-u", "+%F"]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    Some(text.trim().to_owned()).filter(|date| !date.is_empty())
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Clock that measures the processor time of this thread, without that of other programs.
///
/// On Linux its resolution is some milliseconds. On other systems it is the wall-clock time.
pub(crate) struct Clock {
    started: Instant,
    on_cpu_s: Option<f64>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self {
            started: Instant::now(),
            on_cpu_s: on_cpu_s(),
        }
    }

    pub(crate) fn elapsed_s(&self) -> f64 {
        let on_cpu_s = on_cpu_s()
            .zip(self.on_cpu_s)
            .map(|(now, before)| now - before);
        // A kernel without CPU accounting reports 0.
        on_cpu_s
            .filter(|time_s| *time_s > 0.0)
            .unwrap_or_else(|| self.started.elapsed().as_secs_f64())
    }
}

fn on_cpu_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds / 1e9)
}
