//! Requests by signals: reopen the log (SIGHUP), report the counters (SIGUSR1).

use std::io::Read as _;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGUSR1, SIGXFSZ};

use crate::system::on;

/// Stream of each signal.
#[derive(Debug)]
pub struct Requests {
    hangup: UnixStream,
    status: UnixStream,
}

impl Requests {
    /// Registers the signals. SIGXFSZ becomes a write error, like a full disk, and does not end the program.
    ///
    /// # Errors
    /// One line that names the fault.
    pub fn new() -> Result<Self, String> {
        signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
            .map_err(|error| format!("cannot wait for signals: {error}"))?;
        Ok(Self {
            hangup: on(&[SIGHUP])?,
            status: on(&[SIGUSR1])?,
        })
    }

    /// Returns the file descriptors to poll.
    pub fn fds(&self) -> [BorrowedFd<'_>; 2] {
        [self.hangup.as_fd(), self.status.as_fd()]
    }

    /// Returns true if SIGHUP arrived since the last call.
    pub fn take_hangup(&mut self) -> bool {
        drained(&mut self.hangup)
    }

    /// Returns true if SIGUSR1 arrived since the last call.
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
