//! Pseudo-terminal: a tty for a relay on one side, its wire on the other.

use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, ioctl_fionbio};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Pseudo-terminal in the system's default mode: cooked and with echo. The relay has to make it raw.
#[derive(Debug)]
pub(crate) struct Pty {
    pub(crate) wire: OwnedFd,
    path: PathBuf,
    /// Handle that keeps the tty in existence while no relay has it open.
    tty: OwnedFd,
}

impl Pty {
    pub(crate) fn new() -> Self {
        // Relays must not inherit the handle, which would keep their own ttys alive.
        let wire = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&wire).unwrap();
        unlockpt(&wire).unwrap();
        ioctl_fionbio(&wire, true).unwrap();
        let path = ptsname(&wire, Vec::new()).unwrap().into_string().unwrap();
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let tty = open(&path, flags, Mode::empty()).unwrap();
        Self {
            wire,
            path: PathBuf::from(path),
            tty,
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the tty's speed, bit/s.
    pub(crate) fn baud(&self) -> u32 {
        tcgetattr(&self.tty).unwrap().output_speed()
    }

    /// Reads bytes that the relay has sent, as many as fit into `buffer`. Returns the part that was read.
    pub(crate) fn read<'a>(&self, buffer: &'a mut [u8]) -> &'a [u8] {
        match rustix::io::read(&self.wire, &mut *buffer) {
            Ok(count) => &buffer[..count],
            Err(Errno::AGAIN) => &[],
            Err(error) => panic!("{}: {error}", self.path.display()),
        }
    }

    /// Writes bytes to the relay. Returns the number of bytes accepted, since a tty that is not read becomes full.
    pub(crate) fn write(&self, bytes: &[u8]) -> usize {
        match rustix::io::write(&self.wire, bytes) {
            Ok(count) => count,
            Err(Errno::AGAIN) => 0,
            Err(error) => panic!("{}: {error}", self.path.display()),
        }
    }

    /// Fills the buffers for the relay's output until neither the tty nor the kernel accepts more bytes.
    pub(crate) fn stuff(&self) {
        let mut idle = 0;
        while idle < 10 {
            match rustix::io::write(&self.tty, &[0xAA; 256]) {
                Ok(_) => idle = 0,
                Err(Errno::AGAIN) => {
                    idle += 1;
                    std::thread::sleep(Duration::from_millis(10));
                }
                Err(error) => panic!("{}: {error}", self.path.display()),
            }
        }
    }
}

/// Makes a tty raw before a relay opens it. Otherwise the tty would echo all received bytes onto the channel.
pub(crate) fn make_raw(path: &str) {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let tty = open(path, flags, Mode::empty()).unwrap();
    let mut line = tcgetattr(&tty).unwrap();
    line.make_raw();
    tcsetattr(&tty, OptionalActions::Now, &line).unwrap();
}
