//! Lines from a FIFO. Writers may open and close it at any time.

use std::fmt;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::fs::{FileType, Mode, OFlags, fstat, open};
use rustix::io::{Errno, read};
use uav_relay::Instant;
use uav_relay_scenario::number::{narrow, watts};

use crate::log::Log;

/// Maximum length of an input line, bytes; a longer line is rejected.
pub const LONGEST: usize = 200;

/// Description of the permitted powers, for error messages.
const POWER: &str = "a power in W without the unit, within 1e-30 to 1e6, or in dBm with the unit, for example -95 dBm";

/// Parses a power from the words of a line: a number in W, or a number followed by `dBm`. Returns the power in W.
///
/// # Errors
/// A text that names the words and the permitted range.
pub fn power_w(words: &[&str]) -> Result<f32, String> {
    parsed_w(words).ok_or_else(|| format!("{:?} is not {POWER}", words.join(" ")))
}

fn parsed_w(words: &[&str]) -> Option<f32> {
    let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.is_finite());
    let power_w = match words {
        [power, "dBm"] => watts(number(power)?),
        [power] => match power.strip_suffix("dBm") {
            Some(power) => watts(number(power)?),
            None => number(power)?,
        },
        _ => return None,
    };
    let power_w = narrow(power_w);
    (1e-30..=1e6).contains(&power_w).then_some(power_w)
}

/// Splits a line into words.
///
/// # Errors
/// A text that says that the line is too long or not UTF-8.
pub fn words(line: &[u8]) -> Result<Vec<&str>, String> {
    if line.len() > LONGEST {
        return Err(format!("the line must have at most {LONGEST} bytes"));
    }
    let text = std::str::from_utf8(line).map_err(|_| "the line must be UTF-8 text")?;
    Ok(text.split_whitespace().collect())
}

/// Counter of invalid input lines. The first one is logged.
#[derive(Debug, Default)]
pub struct InvalidLines(u64);

impl InvalidLines {
    /// Counts an invalid line. The first one is logged as an event named `event`, with the reason `why` and the valid
    /// forms.
    pub fn refuse(
        &mut self,
        now: Instant,
        log: &Log,
        event: &str,
        line: &[u8],
        [input, why, expected]: [&str; 3],
    ) {
        self.0 += 1;
        if self.0 == 1 {
            let text = String::from_utf8_lossy(line);
            let what = format_args!(
                "invalid line {text:?} in {input} is ignored: {why}; a valid line is {expected}; further invalid lines are counted, but not logged"
            );
            log.line(now, event, what);
        }
    }

    /// Returns the number of invalid lines.
    #[must_use]
    pub const fn count(&self) -> u64 {
        self.0
    }
}

const READS: usize = 16;

/// FIFO from which lines are read.
#[derive(Debug)]
pub struct Fifo {
    fd: OwnedFd,
    name: String,
    partial_line: PartialLine,
}

/// Incomplete line. A line longer than [`LONGEST`] is cut to `LONGEST + 1` bytes, by which the caller recognises it as
/// too long.
#[derive(Debug, Default)]
pub struct PartialLine(Vec<u8>);

impl PartialLine {
    /// Appends received bytes, and calls `line` with each complete line, without its line feed.
    ///
    /// A line longer than [`LONGEST`] is cut to `LONGEST + 1` bytes.
    pub fn take(&mut self, bytes: &[u8], mut line: impl FnMut(&[u8])) {
        for &byte in bytes {
            if byte == b'\n' {
                line(&self.0);
                self.0.clear();
            } else if self.0.len() <= LONGEST {
                self.0.push(byte);
            }
        }
    }
}

impl Fifo {
    /// Opens the FIFO `path`, which `option` names.
    ///
    /// # Errors
    /// One line that names `option` and the fault.
    pub fn open(option: &str, path: &Path) -> Result<Self, String> {
        let name = format!("{option} {}", path.display());
        // The FIFO is also opened for writing, so that no end of file occurs when a writer closes it.
        let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        let fd = open(path, flags, Mode::empty()).map_err(|error| format!("{name}: {error}"))?;
        let kind = fstat(&fd).map(|stat| FileType::from_raw_mode(stat.st_mode));
        if kind != Ok(FileType::Fifo) {
            return Err(format!("{name}: is not a FIFO: make one with mkfifo"));
        }
        Ok(Self {
            fd,
            name,
            partial_line: PartialLine::default(),
        })
    }

    /// Returns the FIFO's file descriptor, to wait for input with `poll`.
    #[must_use]
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// Reads the lines that have arrived since the last call, and calls `line` with each line.
    ///
    /// One call reads at most 64 KiB.
    pub fn read(&mut self, mut line: impl FnMut(&[u8])) {
        let mut buffer = [0; 4096];
        for _ in 0..READS {
            let count = match read(&self.fd, &mut buffer) {
                Ok(count @ 1..) => count,
                Err(Errno::INTR) => continue,
                // No more input. An end of file cannot occur, because this process has the FIFO open for writing.
                _ => break,
            };
            let bytes = buffer.get(..count).unwrap_or_default();
            self.partial_line.take(bytes, &mut line);
        }
    }
}

impl fmt::Display for Fifo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}
