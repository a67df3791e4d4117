//! Sleep until a port has bytes, or room after it had none, or something else happens.

use std::os::fd::BorrowedFd;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use crate::replug::Replug;

/// Sleeps until one of `ttys` has bytes, or room after it had none, or one of `others` what it waits for; for `at_most`, or for ever. What
/// was found at each of `others`.
///
/// # Errors
/// What the system says where it is not possible to sleep.
pub fn sleep<'a>(
    at_most: Option<Duration>,
    ttys: impl Iterator<Item = &'a mut Replug>,
    others: &[(BorrowedFd<'_>, PollFlags)],
) -> Result<Vec<PollFlags>, Errno> {
    // Longer than a Timespec can be is for ever.
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
