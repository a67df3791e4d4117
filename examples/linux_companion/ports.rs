//! The ttys of either wiring, and sleep until one of them or a timer needs the relay.

use std::os::fd::BorrowedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::PollFlags;
use rustix::io::Errno;
use serde_json::{Value, json};
use uav_relay::serial::{Fault, Pair, SerialLink, SerialPort, SerialStats, Shared, byte_time};
use uav_relay::{Instant, Relay};

use crate::gate::Gate;
use crate::options::Ttys;
use uav_relay_linux::log::Log;
use uav_relay_linux::replug::Replug;
use uav_relay_linux::{sleep, tap};

/// A tty, or the end of the chain: nobody is there; behind a gate.
#[derive(Debug)]
pub(crate) struct End(Option<Replug>, Gate);

impl SerialPort for End {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        self.0.as_mut().map_or(Ok(0), |tty| tty.read(into))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        if !self.1.is_open() {
            // It waits, as for a port that takes nothing.
            return Ok(0);
        }
        let all = Ok(bytes.len());
        self.0.as_mut().map_or(all, |tty| tty.write(bytes))
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        self.0.as_mut().map_or(Ok(None), Replug::has_left)
    }
}

/// All that a relay is connected to.
#[derive(Debug)]
pub(crate) enum Ports {
    Pair(Box<Pair<End, End>>),
    Shared(Box<Shared<End>>),
}

impl Ports {
    /// Opens them. Nothing is sent while `gate` is shut.
    ///
    /// # Errors
    /// One line that names the tty.
    pub(crate) fn open(ttys: &Ttys, baud: u32, gate: &Gate) -> Result<Self, String> {
        let link = |option, path: Option<&_>| {
            let tty = path
                .map(|path| Replug::open(option, path, baud))
                .transpose()?;
            Ok::<_, String>(SerialLink::new(End(tty, gate.clone()), byte_time(baud)))
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

    /// Writes what goes over them to a capture from now on, and returns the file.
    ///
    /// # Errors
    /// One line that names the file.
    pub(crate) fn capture(&mut self, file: &Path) -> Result<PathBuf, String> {
        let (taps, file) = tap::taps(env!("CARGO_BIN_NAME"), file, &self.names())?;
        for (tty, tap) in self.ttys().zip(taps) {
            tty.tapped(tap);
        }
        Ok(file)
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

    /// Opens again what has vanished, when it is time to, and says when to come back for that.
    pub(crate) fn tend(&mut self, now: Instant, log: &Log) -> Option<Instant> {
        self.ttys()
            .filter_map(|tty| {
                tty.tend(now, log);
                tty.wake()
            })
            .min()
    }

    /// Their names, as options give them.
    pub(crate) fn names(&mut self) -> Vec<String> {
        self.ttys().map(|tty| tty.to_string()).collect()
    }

    /// What they have counted: bytes, and what went wrong with them.
    pub(crate) fn status(&mut self) -> Value {
        let links = match self {
            Self::Pair(pair) => vec![*pair.upstream.stats(), *pair.downstream.stats()],
            Self::Shared(shared) => vec![*shared.channel.stats()],
        };
        let sum = |of: fn(&SerialStats) -> u32| links.iter().map(of).fold(0, u32::saturating_add);
        let ports: Vec<Value> = self.ttys().map(|tty| tty.status()).collect();
        json!({
            "ports": ports,
            "frames_dropped": sum(|link| link.dropped),
            "reads_failed": sum(|link| link.other),
            "writes_failed": sum(|link| link.write),
        })
    }

    fn ttys(&mut self) -> impl Iterator<Item = &mut Replug> {
        let (first, second) = match self {
            Self::Pair(pair) => (pair.upstream.port_mut(), Some(pair.downstream.port_mut())),
            Self::Shared(shared) => (shared.channel.port_mut(), None),
        };
        [Some(first), second]
            .into_iter()
            .flatten()
            .filter_map(|end| end.0.as_mut())
    }

    /// Sleeps until a tty has bytes, or room after it had none, or one of `others` what it waits for; for `at_most`, or for ever. What was
    /// found at each of `others`.
    ///
    /// # Errors
    /// What the system says where it is not possible to sleep.
    pub(crate) fn sleep(
        &mut self,
        at_most: Option<Duration>,
        others: &[(BorrowedFd<'_>, PollFlags)],
    ) -> Result<Vec<PollFlags>, Errno> {
        sleep::sleep(at_most, self.ttys(), others)
    }
}
