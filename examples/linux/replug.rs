//! Tty that is reopened when it disappears, so that a loose cable does not end the program.

use std::fmt;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::path::{Path, PathBuf};

use rustix::event::PollFlags;
use serde_json::{Value, json};
use uav_relay::serial::{Fault, SerialPort};
use uav_relay::{Duration, Instant};
use uav_relay_capture::Direction;

use crate::log::Log;
use crate::tap::Tap;
use crate::tty::Tty;

/// Pause before the first attempt to reopen a tty. The pause doubles with every attempt, up to [`LONGEST`].
const FIRST: Duration = Duration::from_millis(250);
const LONGEST: Duration = Duration::from_millis(4_000);

/// Serial port (tty) that may be unplugged and plugged in again under the same name.
#[derive(Debug)]
pub struct Replug {
    option: &'static str,
    path: PathBuf,
    baud: u32,
    tty: Option<Tty>,
    again_at: Instant,
    pause: Duration,
    counts: Counts,
    /// Capture of this tty's traffic, if enabled.
    tap: Option<Tap>,
}

/// Traffic counters of a tty: bytes, and number of failures, for example because the tty was unplugged.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    read: u64,
    written: u64,
    /// Number of bytes to send that were discarded, because the tty was missing.
    lost: u64,
    times_gone: u32,
}

impl Replug {
    /// Opens the tty. The tty must exist at the start, because a wrong name is a mistake.
    ///
    /// # Errors
    /// One line that names the option and the fault.
    pub fn open(option: &'static str, path: &Path, baud: u32) -> Result<Self, String> {
        Ok(Self {
            option,
            path: path.to_owned(),
            baud,
            tty: Some(Tty::open(option, path, baud)?),
            again_at: Instant::ZERO,
            pause: FIRST,
            counts: Counts::default(),
            tap: None,
        })
    }

    /// Adds `tap`, which captures all further traffic of this tty.
    pub fn tapped(&mut self, tap: Tap) {
        self.tap = Some(tap);
    }

    /// Adds a comment about an operator's command to the tty's next captured frame, if it has a capture.
    pub fn note(&mut self, note: &str) {
        if let Some(tap) = &mut self.tap {
            tap.note(note);
        }
    }

    /// Closes a tty that has failed, and reopens it after a pause. Logs each loss and each return of the tty once.
    pub fn tend(&mut self, now: Instant, log: &Log) {
        let failure = self.tty.as_ref().and_then(Tty::failure);
        if let Some(failure) = failure {
            let what = format_args!(
                "{failure}; check the cable of the device: the program opens the port again as soon as the device is back"
            );
            log.event(now, "port lost", self.fields(), what);
            self.tty = None;
            self.counts.times_gone = self.counts.times_gone.saturating_add(1);
            self.again_at = now + self.pause;
        }
        if let Some(tap) = self.tap.take_if(|tap| tap.is_over())
            && let Some(fault) = tap.fault()
        {
            let fields = json!({ "fault": fault, "left_out": tap.left_out() });
            let what = format_args!(
                "--capture cannot be written: {fault}; the capture ends here, and the program continues without it; the next start of the program begins a new capture"
            );
            log.event(now, "capture ended", fields, what);
        }
        if self.tty.is_none() && self.again_at <= now {
            self.pause = self.pause.times(2).min(LONGEST);
            self.again_at = now + self.pause;
            if let Ok(tty) = Tty::open(self.option, &self.path, self.baud) {
                self.tty = Some(tty);
                log.event(
                    now,
                    "port back",
                    self.fields(),
                    format_args!("{self} is open again"),
                );
            }
        }
    }

    fn fields(&self) -> Value {
        json!({ "option": self.option, "port": self.path.display().to_string() })
    }

    /// Returns the time of the next attempt to reopen the tty; `None` while the tty is open.
    pub fn wake(&self) -> Option<Instant> {
        self.tty.is_none().then_some(self.again_at)
    }

    /// Returns the tty's file descriptor and the events to poll; `None` while the tty is closed.
    pub fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        self.tty.as_ref().map(|tty| (tty.as_fd(), tty.interest()))
    }

    /// Records the events that poll(2) reported for this tty, such as a hang-up.
    pub fn noticed(&mut self, events: PollFlags) {
        if let Some(tty) = &mut self.tty {
            tty.noticed(events);
        }
    }

    /// Returns true while the tty is open.
    pub const fn is_open(&self) -> bool {
        self.tty.is_some()
    }

    /// Returns the path of the tty.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the baud rate, bit/s.
    pub const fn baud(&self) -> u32 {
        self.baud
    }

    /// Returns the number of bytes received since the start.
    pub const fn bytes_in(&self) -> u64 {
        self.counts.read
    }

    /// Returns the tty's state and traffic counters as JSON.
    pub fn status(&self) -> Value {
        json!({
            "option": self.option,
            "port": self.path.display().to_string(),
            "open": self.is_open(),
            "bytes_in": self.counts.read,
            "bytes_out": self.counts.written,
            "bytes_lost": self.counts.lost,
            "times_gone": self.counts.times_gone,
            "capture_left_out": self.tap.as_ref().map(Tap::left_out),
        })
    }
}

impl fmt::Display for Replug {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.option, self.path.display())
    }
}

impl SerialPort for Replug {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        let Some(tty) = &mut self.tty else {
            return Ok(0);
        };
        let count = tty.read(into)?;
        if count > 0 {
            self.counts.read += count as u64;
            // Only received bytes reset the pause. So a tty that fails right after each opening is retried less and
            // less often.
            self.pause = FIRST;
            if let Some(tap) = &mut self.tap {
                tap.take(Direction::In, into.get(..count).unwrap_or_default());
            }
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let Some(tty) = &mut self.tty else {
            // The bytes would be outdated by the time the tty is back.
            self.counts.lost += bytes.len() as u64;
            return Ok(bytes.len());
        };
        let count = tty.write(bytes)?;
        self.counts.written += count as u64;
        if let Some(tap) = &mut self.tap {
            tap.take(Direction::Out, bytes.get(..count).unwrap_or_default());
        }
        Ok(count)
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        self.tty.as_mut().map_or(Ok(None), Tty::has_left)
    }
}
