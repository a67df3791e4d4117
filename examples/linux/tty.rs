//! Non-blocking tty as a [`SerialPort`]: raw, 8N1, no flow control.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::event::PollFlags;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr,
};
use uav_relay::serial::{Fault, SerialPort};

/// Open tty of a serial port.
#[derive(Debug)]
pub struct Tty {
    fd: OwnedFd,
    name: String,
    /// True if the tty accepted only a part of the last write, because its buffer is full.
    full: bool,
    failure: Option<String>,
}

impl Tty {
    /// Opens the tty `path`, which `option` names, at `baud` bit/s.
    ///
    /// # Errors
    /// One line that names the option, the path and the fault.
    pub fn open(option: &str, path: &Path, baud: u32) -> Result<Self, String> {
        let name = format!("{option} {}", path.display());
        let fd = configured(path, baud).map_err(|error| match error {
            Errno::WOULDBLOCK => format!("{name}: is already in use"),
            Errno::NOTTY => format!("{name}: is not a tty"),
            Errno::NOENT => format!("{name}: there is no such device: is it plugged in?"),
            Errno::ISDIR => format!("{name}: is a directory, not a tty"),
            Errno::ACCESS => format!(
                "{name}: permission denied: on most systems only members of the group dialout may open it"
            ),
            Errno::INVAL => format!("{name}: this device does not support {baud} bit/s"),
            error => format!("{name}: {error}"),
        })?;
        Ok(Self {
            fd,
            name,
            full: false,
            failure: None,
        })
    }

    /// Returns the events to poll for: received bytes, and after a partial write also room to write.
    pub fn interest(&self) -> PollFlags {
        if self.full {
            PollFlags::IN | PollFlags::OUT
        } else {
            PollFlags::IN
        }
    }

    /// Marks the tty as failed if poll(2) reported a hang-up or an error.
    ///
    /// For an unplugged adapter poll(2) returns at once at every call, so without this mark the program would never
    /// sleep.
    pub fn noticed(&mut self, events: PollFlags) {
        if events.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            self.fail("the device was disconnected");
        }
    }

    /// Returns the error that made this tty unusable, if any.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    fn fail(&mut self, what: impl std::fmt::Display) {
        let name = &self.name;
        self.failure
            .get_or_insert_with(|| format!("{name}: {what}"));
    }

    /// Returns the number of transferred bytes; `None` if the caller must retry, as the tty was not ready.
    fn done(&mut self, result: Result<usize, Errno>) -> Result<Option<usize>, Fault> {
        match result {
            Ok(count) => Ok(Some(count)),
            Err(Errno::AGAIN | Errno::INTR) => Ok(None),
            Err(Errno::IO | Errno::NXIO | Errno::NODEV) => {
                self.fail("the device was disconnected");
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
            // With VMIN = 1 an end of file means that the device is gone.
            self.fail("the device was disconnected");
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
        // Needed only for a driver-enable pin. For a tty the kernel drives such a pin (TIOCSRS485).
        Ok(None)
    }
}

fn configured(path: &Path, baud: u32) -> Result<OwnedFd, Errno> {
    // The tty is opened as non-blocking, because opening must not wait for a carrier.
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let fd = open(path, flags, Mode::empty())?;
    let mut line = tcgetattr(&fd)?;
    // Two readers would each get a part of every frame. The lock prevents this. Terminal programs use it as well, and
    // it ends with the process.
    flock(&fd, FlockOperation::NonBlockingLockExclusive)?;
    line.make_raw();
    line.input_modes -= InputModes::IXOFF | InputModes::IXANY;
    line.control_modes -= ControlModes::CRTSCTS | ControlModes::CSTOPB;
    line.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    line.set_speed(baud)?;
    tcsetattr(&fd, OptionalActions::Now, &line)?;
    // Discards bytes from before the start, perhaps sent at a different baud rate.
    tcflush(&fd, QueueSelector::IFlush)?;
    Ok(fd)
}
