//! The ttys of either wiring, and sleep until one of them or a timer needs the relay.

use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use uav_relay::serial::{Fault, Pair, SerialLink, SerialPort, Shared, byte_time};
use uav_relay::{Instant, Relay};

use crate::options::Ttys;
use crate::tty::Tty;

/// A tty, or the end of the chain: nobody is there.
#[derive(Debug)]
pub(crate) struct End(Option<Tty>);

impl SerialPort for End {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        self.0.as_mut().map_or(Ok(0), |tty| tty.read(into))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let all = Ok(bytes.len());
        self.0.as_mut().map_or(all, |tty| tty.write(bytes))
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        self.0.as_mut().map_or(Ok(None), Tty::has_left)
    }
}

/// All that a relay is connected to.
#[derive(Debug)]
pub(crate) enum Ports {
    Pair(Box<Pair<End, End>>),
    Shared(Box<Shared<End>>),
}

/// Why [`Ports::sleep`] returned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Woken {
    /// There may be something to do.
    Work,
    /// The program was told to end.
    Stop,
}

impl Ports {
    /// Opens them.
    ///
    /// # Errors
    /// One line that names the tty.
    pub(crate) fn open(ttys: &Ttys, baud: u32) -> Result<Self, String> {
        let link = |option, path: Option<&_>| {
            let tty = path.map(|path| Tty::open(option, path, baud)).transpose()?;
            Ok::<_, String>(SerialLink::new(End(tty), byte_time(baud)))
        };
        Ok(match ttys {
            Ttys::Pair {
                upstream,
                downstream,
            } => {
                let upstream = link("--upstream", upstream.as_deref())?;
                let downstream = link("--downstream", downstream.as_deref())?;
                Self::Pair(Box::new(Pair::new(upstream, downstream)))
            }
            Ttys::Shared(tty) => {
                let channel = link("--shared", Some(tty.as_path()))?;
                Self::Shared(Box::new(Shared::new(channel)))
            }
        })
    }

    /// Moves what can be moved, with a call of `keep` before anything is sent, and says when to come back at the latest.
    pub(crate) fn poll(
        &mut self,
        now: Instant,
        relay: &mut Relay,
        keep: &mut dyn FnMut(&Relay),
    ) -> Option<Instant> {
        match self {
            Self::Pair(pair) => pair.poll_keeping(now, relay, keep),
            Self::Shared(shared) => shared.poll_keeping(now, relay, keep),
        }
    }

    pub(crate) fn ttys(&mut self) -> impl Iterator<Item = &mut Tty> {
        let (first, second) = match self {
            Self::Pair(pair) => (pair.upstream.port_mut(), Some(pair.downstream.port_mut())),
            Self::Shared(shared) => (shared.channel.port_mut(), None),
        };
        [Some(first), second]
            .into_iter()
            .flatten()
            .filter_map(|end| end.0.as_mut())
    }

    /// Sleeps until a tty has bytes, or room after it had none, `stop` has bytes, or `other` what it waits for; for `at_most`, or for
    /// ever. Says what was found at `other`, too.
    ///
    /// # Errors
    /// One line if it is not possible to sleep.
    pub(crate) fn sleep(
        &mut self,
        at_most: Option<Duration>,
        stop: BorrowedFd<'_>,
        other: Option<(BorrowedFd<'_>, PollFlags)>,
    ) -> Result<(Woken, PollFlags), String> {
        // Longer than a Timespec can be is for ever.
        let timeout = at_most.and_then(|span| Timespec::try_from(span).ok());
        let ttys: Vec<&mut Tty> = self.ttys().collect();
        let mut fds = vec![PollFd::from_borrowed_fd(stop, PollFlags::IN)];
        let on_ttys = ttys
            .iter()
            .map(|tty| PollFd::from_borrowed_fd(tty.as_fd(), tty.interest()));
        fds.extend(on_ttys);
        fds.extend(other.map(|(fd, interest)| PollFd::from_borrowed_fd(fd, interest)));
        match poll(&mut fds, timeout.as_ref()) {
            Ok(_) => {}
            Err(Errno::INTR) => return Ok((Woken::Work, PollFlags::empty())),
            Err(error) => return Err(format!("cannot sleep: {error}")),
        }
        let mut found: Vec<PollFlags> = fds.iter().map(PollFd::revents).collect();
        let stopped = !found.remove(0).is_empty();
        let at_other = if other.is_some() {
            found.pop().unwrap_or(PollFlags::empty())
        } else {
            PollFlags::empty()
        };
        for (tty, events) in ttys.into_iter().zip(found) {
            tty.noticed(events);
        }
        let woken = if stopped { Woken::Stop } else { Woken::Work };
        Ok((woken, at_other))
    }
}
