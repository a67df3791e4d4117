//! Lines from a FIFO, whoever writes to it comes and goes.

use std::fmt;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::fs::{FileType, Mode, OFlags, fstat, open};
use rustix::io::{Errno, read};
use uav_relay_scenario::number::{narrow, watts};

/// No line is longer, bytes.
pub const LONGEST: usize = 200;

/// What a line may say of a power.
pub const POWER: &str =
    "a power within 1e-30 to 1e6 W, or that in dBm with the unit behind it, as -95 dBm";

/// Returns the power in W that the words of a line give: a number of W, or a number of dBm with that unit behind it. `None` for anything else and
/// outside 1e-30 to 1e6 W.
#[must_use]
pub fn power_w(words: &[&str]) -> Option<f32> {
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

/// Buffers that are read at once, at most.
const READS: usize = 16;

/// An open FIFO.
#[derive(Debug)]
pub struct Fifo {
    fd: OwnedFd,
    name: String,
    begun: Begun,
}

/// What has come of a line so far; one byte more than the longest for one that is too long.
#[derive(Debug, Default)]
pub struct Begun(Vec<u8>);

impl Begun {
    /// Takes bytes, and hands every line that ends in them to `line`, without its end. Of one that is longer than [`LONGEST`] it hands on the
    /// first bytes, one more than that.
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
    /// Opens it.
    ///
    /// # Errors
    /// One line that names `option` and says what does not work.
    pub fn open(option: &str, path: &Path) -> Result<Self, String> {
        let name = format!("{option} {}", path.display());
        // With an end of its own to write to it is never at its end, whoever comes and goes.
        let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        let fd = open(path, flags, Mode::empty()).map_err(|error| format!("{name}: {error}"))?;
        let kind = fstat(&fd).map(|stat| FileType::from_raw_mode(stat.st_mode));
        if kind != Ok(FileType::Fifo) {
            return Err(format!("{name}: is no FIFO, make one with mkfifo"));
        }
        Ok(Self {
            fd,
            name,
            begun: Begun::default(),
        })
    }

    /// What to sleep on.
    #[must_use]
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// Hands every line that has come since to `line`. Work: 64 KiB at most, whoever writes how much.
    pub fn read(&mut self, mut line: impl FnMut(&[u8])) {
        let mut buffer = [0; 4096];
        for _ in 0..READS {
            let count = match read(&self.fd, &mut buffer) {
                Ok(count @ 1..) => count,
                Err(Errno::INTR) => continue,
                // This end holds the other one open as well, so there is no end, and no other error that a FIFO has.
                _ => break,
            };
            let bytes = buffer.get(..count).unwrap_or_default();
            self.begun.take(bytes, &mut line);
        }
    }
}

impl fmt::Display for Fifo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}
