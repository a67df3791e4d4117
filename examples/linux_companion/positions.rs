//! Where the drone is, line by line from a FIFO: the autopilot's side writes `x_m y_m altitude_m` as often as it knows better, and behind
//! that the interference that was heard there, W, if it was measured. `receiver power_w` is what the ground receiver hears.

use std::fmt;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::fs::{FileType, Mode, OFlags, fstat, open};
use rustix::io::{Errno, read};
use uav_relay::{Instant, Placement, Sample};

use crate::log::Log;

/// No line is longer.
const LONGEST: usize = 200;

/// Buffers that are read at once, at most.
const READS: usize = 16;

/// An open FIFO.
#[derive(Debug)]
pub(crate) struct Positions {
    fd: OwnedFd,
    name: String,
    /// What has come of a line so far; one byte more than the longest for one that is too long.
    begun: Vec<u8>,
    /// Whether a line may have a power, too.
    listens: bool,
    /// Lines that were none.
    bad: u64,
}

impl Positions {
    /// Opens it.
    ///
    /// # Errors
    /// One line that says what does not work.
    pub(crate) fn open(path: &Path, listens: bool) -> Result<Self, String> {
        let name = format!("--positions {}", path.display());
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
            begun: Vec::new(),
            listens,
            bad: 0,
        })
    }

    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// The newest of the positions that have come since, and every measurement is handed to `heard`; the first line that is neither is said.
    /// Work: [`READS`] buffers at most, whoever writes how much.
    pub(crate) fn newest(
        &mut self,
        now: Instant,
        log: &Log,
        heard: &mut impl FnMut(Sample),
    ) -> Option<Placement> {
        let mut newest = None;
        let mut buffer = [0; 4096];
        for _ in 0..READS {
            let count = match read(&self.fd, &mut buffer) {
                Ok(count @ 1..) => count,
                Err(Errno::INTR) => continue,
                // This end holds the other one open as well, so there is no end, and no other error that a FIFO has.
                _ => break,
            };
            for &byte in buffer.get(..count).unwrap_or_default() {
                if byte != b'\n' {
                    if self.begun.len() <= LONGEST {
                        self.begun.push(byte);
                    }
                    continue;
                }
                match news(&self.begun) {
                    Some((place, sample)) if self.listens || sample.is_none() => {
                        newest = place.or(newest);
                        sample.into_iter().for_each(&mut *heard);
                    }
                    _ => self.refuse(now, log),
                }
                self.begun.clear();
            }
        }
        newest
    }

    fn refuse(&mut self, now: Instant, log: &Log) {
        self.bad += 1;
        if self.bad > 1 {
            return;
        }
        let text = String::from_utf8_lossy(&self.begun);
        log.tell(
            now,
            "position",
            format_args!(
                "{text:?} is not x_m y_m altitude_m{}; more of these are only counted",
                if self.listens {
                    " [power_w] or receiver power_w, a power within 1e-30 to 1e6"
                } else {
                    ""
                }
            ),
        );
    }

    /// Lines that were none.
    pub(crate) const fn bad(&self) -> u64 {
        self.bad
    }

    /// How many lines were no position, if any were.
    pub(crate) fn stopped(&self, now: Instant, log: &Log) {
        if self.bad > 0 {
            log.tell(
                now,
                "position",
                format_args!("{} lines were none", self.bad),
            );
        }
    }
}

impl fmt::Display for Positions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

/// Says whether drones are kept apart.
pub(crate) fn started(log: &Log, positions: Option<&Positions>) {
    match positions {
        Some(positions) => log.tell(
            Instant::ZERO,
            "guarded",
            format_args!("setpoints keep drones apart on their way, by {positions}"),
        ),
        None => log.tell(
            Instant::ZERO,
            "unguarded",
            format_args!("no --positions, nothing keeps drones apart on their way"),
        ),
    }
}

/// Three numbers, a fourth where a power was measured there; or the word `receiver`, and the power that was measured at that.
fn news(text: &[u8]) -> Option<(Option<Placement>, Option<Sample>)> {
    let text = std::str::from_utf8(text)
        .ok()
        .filter(|_| text.len() <= LONGEST)?;
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |word: &str| word.parse::<f32>().ok().filter(|number| number.is_finite());
    let power = |word: &str| number(word).filter(|power_w| (1e-30..=1e6).contains(power_w));
    if let ["receiver", power_w] = words[..] {
        let power_w = power(power_w)?;
        return Some((None, Some(Sample::Receiver { power_w })));
    }
    let [x, y, altitude, rest @ ..] = &words[..] else {
        return None;
    };
    let at = Placement {
        x_m: number(x)?,
        y_m: number(y)?,
        altitude_m: number(altitude)?,
    };
    let sample = match rest {
        [] => None,
        [power_w] => Some(Sample::Heard {
            at,
            power_w: power(power_w)?,
        }),
        _ => return None,
    };
    Some((Some(at), sample))
}
