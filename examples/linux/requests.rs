//! What the operator asks of a relay in flight by signals: to open its log again (SIGHUP), and to say what it has counted (SIGUSR1).

use std::io::Read as _;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGUSR1, SIGXFSZ};

use crate::system::on;

/// A stream for each of the two.
#[derive(Debug)]
pub struct Requests {
    hangup: UnixStream,
    status: UnixStream,
}

impl Requests {
    /// Begins to listen for them. A file that may not grow (SIGXFSZ) is an error like a full disk from now on, and no end of the program.
    ///
    /// # Errors
    /// One line that says what does not work.
    pub fn new() -> Result<Self, String> {
        signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
            .map_err(|error| format!("cannot wait for signals: {error}"))?;
        Ok(Self {
            hangup: on(&[SIGHUP])?,
            status: on(&[SIGUSR1])?,
        })
    }

    /// What to sleep on.
    pub fn fds(&self) -> [BorrowedFd<'_>; 2] {
        [self.hangup.as_fd(), self.status.as_fd()]
    }

    /// Whether there was a SIGHUP since.
    pub fn take_hangup(&mut self) -> bool {
        drained(&mut self.hangup)
    }

    /// Whether there was a SIGUSR1 since.
    pub fn take_status(&mut self) -> bool {
        drained(&mut self.status)
    }
}

fn drained(stream: &mut UnixStream) -> bool {
    let mut bytes = [0; 64];
    let mut any = false;
    while let Ok(1..) = stream.read(&mut bytes) {
        any = true;
    }
    any
}
