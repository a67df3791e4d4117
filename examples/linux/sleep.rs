//! Sleep until a port or another file descriptor is ready.

use std::os::fd::BorrowedFd;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use crate::replug::Replug;

/// Sleeps until one of `ttys` or `others` is ready, at most `at_most`, else for ever. Returns the events of each of `others`.
///
/// A tty is ready when it has bytes, or room after it had none.
///
/// # Errors
/// The system's error if poll(2) fails.
pub fn sleep<'a>(
    at_most: Option<Duration>,
    ttys: impl Iterator<Item = &'a mut Replug>,
    others: &[(BorrowedFd<'_>, PollFlags)],
) -> Result<Vec<PollFlags>, Errno> {
    // A span too long for a Timespec means for ever.
    let timeout = at_most.and_then(|span| Timespec::try_from(span).ok());
    let mut ttys: Vec<&mut Replug> = ttys.filter(|tty| tty.is_open()).collect();
    let on_ttys = ttys.iter().filter_map(|tty| tty.interest());
    let mut fds: Vec<PollFd<'_>> = others
        .iter()
        .copied()
        .chain(on_ttys)
        .map(|(fd, interest)| PollFd::from_borrowed_fd(fd, interest))
        .collect();
    match poll(&mut fds, timeout.as_ref()) {
        Ok(_) | Err(Errno::INTR) => {}
        Err(error) => return Err(error),
    }
    let mut found: Vec<PollFlags> = fds.iter().map(PollFd::revents).collect();
    let on_ttys = found.split_off(others.len());
    for (tty, events) in ttys.iter_mut().zip(on_ttys) {
        tty.noticed(events);
    }
    Ok(found)
}
