//! A tty as a [`SerialPort`]: raw, 8N1, without flow control, and every call returns at once.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::event::PollFlags;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr,
};
use uav_relay::serial::{Fault, SerialPort};

/// An open tty.
#[derive(Debug)]
pub struct Tty {
    fd: OwnedFd,
    /// Option and path, as messages have it.
    name: String,
    /// Whether it took less than it was last offered.
    full: bool,
    failure: Option<String>,
}

impl Tty {
    /// Opens the tty that was given for `option`.
    ///
    /// # Errors
    /// One line that says what does not work.
    pub fn open(option: &str, path: &Path, baud: u32) -> Result<Self, String> {
        let name = format!("{option} {}", path.display());
        let fd = configured(path, baud).map_err(|error| match error {
            Errno::WOULDBLOCK => format!("{name}: is in use already"),
            Errno::NOTTY => format!("{name}: is no tty"),
            Errno::NOENT => format!("{name}: No such file: is it plugged in?"),
            Errno::ISDIR => format!("{name}: is a directory, and no tty"),
            Errno::ACCESS => format!(
                "{name}: may not be opened by this user; on most systems the group dialout may"
            ),
            Errno::INVAL => format!("{name}: does not do {baud} bit/s"),
            error => format!("{name}: {error}"),
        })?;
        Ok(Self {
            fd,
            name,
            full: false,
            failure: None,
        })
    }

    /// What to sleep on: bytes that come in, and room if there was none.
    pub fn interest(&self) -> PollFlags {
        if self.full {
            PollFlags::IN | PollFlags::OUT
        } else {
            PollFlags::IN
        }
    }

    /// Takes note of what poll(2) has found. An adapter that is pulled out stays ready for ever: without this, a busy loop.
    pub fn noticed(&mut self, events: PollFlags) {
        if events.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            self.fail("is gone");
        }
    }

    /// The line that says why this tty is of no use any more.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    fn fail(&mut self, what: impl std::fmt::Display) {
        let name = &self.name;
        self.failure
            .get_or_insert_with(|| format!("{name}: {what}"));
    }

    /// What has come of a read or write; none where that is for later.
    fn done(&mut self, result: Result<usize, Errno>) -> Result<Option<usize>, Fault> {
        match result {
            Ok(count) => Ok(Some(count)),
            Err(Errno::AGAIN | Errno::INTR) => Ok(None),
            Err(Errno::IO | Errno::NXIO | Errno::NODEV) => {
                self.fail("is gone");
                Err(Fault::Other)
            }
            Err(error) => {
                self.fail(error);
                Err(Fault::Other)
            }
        }
    }
}

impl AsFd for Tty {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

impl SerialPort for Tty {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        if self.failure.is_some() {
            return Ok(0);
        }
        let result = rustix::io::read(&self.fd, into);
        let count = self.done(result)?;
        if count == Some(0) {
            // With VMIN = 1 the end of file is the other end's, not a lack of bytes.
            self.fail("is gone");
        }
        Ok(count.unwrap_or(0))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        if self.failure.is_some() {
            return Ok(bytes.len());
        }
        let result = rustix::io::write(&self.fd, bytes);
        let count = self.done(result)?.unwrap_or(0);
        self.full = count < bytes.len();
        Ok(count)
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        // Only asked where a pin enables the driver; the kernel does that for a tty (TIOCSRS485).
        Ok(None)
    }
}

fn configured(path: &Path, baud: u32) -> Result<OwnedFd, Errno> {
    // Non-blocking from the start: opening must not wait for a carrier either.
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let fd = open(path, flags, Mode::empty())?;
    let mut line = tcgetattr(&fd)?;
    // Two readers would each get half of every frame. A lock, as terminal programs take it, ends with the process.
    flock(&fd, FlockOperation::NonBlockingLockExclusive)?;
    line.make_raw();
    line.input_modes -= InputModes::IXOFF | InputModes::IXANY;
    line.control_modes -= ControlModes::CRTSCTS | ControlModes::CSTOPB;
    line.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    line.set_speed(baud)?;
    tcsetattr(&fd, OptionalActions::Now, &line)?;
    // What came in before this relay was switched on, perhaps at another baud rate.
    tcflush(&fd, QueueSelector::IFlush)?;
    Ok(fd)
}
