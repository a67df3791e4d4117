//! A pseudo-terminal: a tty for a relay at one side, its wire at the other.

use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, ioctl_fionbio};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Both sides. It is left as the system makes it, cooked and with echo: to make it raw is up to the relay.
#[derive(Debug)]
pub(crate) struct Pty {
    pub(crate) wire: OwnedFd,
    path: PathBuf,
    /// Keeps the tty there while no relay has it open, as a real one is.
    tty: OwnedFd,
}

impl Pty {
    pub(crate) fn new() -> Self {
        // Not for the relays to inherit: they would keep their own ttys alive.
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

    /// The speed its tty is set to, bit/s.
    pub(crate) fn baud(&self) -> u32 {
        tcgetattr(&self.tty).unwrap().output_speed()
    }

    /// What the relay has sent, as far as it fits into `buffer`.
    pub(crate) fn read<'a>(&self, buffer: &'a mut [u8]) -> &'a [u8] {
        match rustix::io::read(&self.wire, &mut *buffer) {
            Ok(count) => &buffer[..count],
            Err(Errno::AGAIN) => &[],
            Err(error) => panic!("{}: {error}", self.path.display()),
        }
    }

    /// Hands bytes to the relay and says how many: a tty that nobody reads overflows in the end.
    pub(crate) fn write(&self, bytes: &[u8]) -> usize {
        match rustix::io::write(&self.wire, bytes) {
            Ok(count) => count,
            Err(Errno::AGAIN) => 0,
            Err(error) => panic!("{}: {error}", self.path.display()),
        }
    }

    /// Sends as if the relay did, until the tty takes no more even after the kernel has moved on what it had.
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

/// Makes a tty raw that nobody has opened yet: on a channel that others use, it would send them back what it hears.
pub(crate) fn make_raw(path: &str) {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let tty = open(path, flags, Mode::empty()).unwrap();
    let mut line = tcgetattr(&tty).unwrap();
    line.make_raw();
    tcsetattr(&tty, OptionalActions::Now, &line).unwrap();
}
