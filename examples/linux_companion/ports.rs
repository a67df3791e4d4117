//! Ttys of a relay: one for each neighbour, or one for a shared radio.

use std::path::PathBuf;

use serde_json::{Value, json};
use uav_relay::serial::{Fault, Pair, SerialLink, SerialPort, SerialStats, Shared};
use uav_relay::{Instant, Relay, ViewRecord};

use crate::options::Options;
use uav_relay_linux::log::Log;
use uav_relay_linux::replug::Replug;

/// Serial port toward one neighbour; `None` if the relay has no port in this direction.
#[derive(Debug)]
pub(crate) struct End(Option<Replug>);

impl SerialPort for End {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        self.0.as_mut().map_or(Ok(0), |tty| tty.read(into))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let all = Ok(bytes.len());
        self.0.as_mut().map_or(all, |tty| tty.write(bytes))
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        self.0.as_mut().map_or(Ok(None), Replug::has_left)
    }
}

#[derive(Debug)]
pub(crate) enum Ports {
    Pair(Box<Pair<End, End>>),
    Shared(Box<Shared<End>>),
}

impl Ports {
    /// Opens the ttys that the options name.
    pub(crate) fn open(options: &Options) -> Result<Self, String> {
        let link = |name, path: &Option<PathBuf>| {
            let tty = path.as_deref();
            let tty = tty.map(|path| Replug::open(name, path, options.baud));
            Ok::<_, String>(SerialLink::new(End(tty.transpose()?), options.baud))
        };
        if options.shared.is_some() {
            let channel = link("--shared", &options.shared)?;
            return Ok(Self::Shared(Box::new(Shared::new(channel))));
        }
        let upstream = link("--upstream", &options.upstream)?;
        let downstream = link("--downstream", &options.downstream)?;
        Ok(Self::Pair(Box::new(Pair::new(upstream, downstream))))
    }

    /// Exchanges bytes between ports and relay. Returns the time by which the next call is due.
    ///
    /// Changed votes on the chain's members are passed to `store` before the relay sends.
    pub(crate) fn poll(
        &mut self,
        now: Instant,
        relay: &mut Relay,
        store: &mut dyn FnMut(&ViewRecord) -> bool,
    ) -> Option<Instant> {
        match self {
            Self::Pair(pair) => pair.poll(now, relay, store),
            Self::Shared(shared) => shared.poll(now, relay, store),
        }
    }

    /// Reopens lost ttys. Returns the time of the next attempt, if any.
    pub(crate) fn tend(&mut self, now: Instant, log: &Log) -> Option<Instant> {
        self.ttys()
            .filter_map(|tty| {
                tty.tend(now, log);
                tty.wake()
            })
            .min()
    }

    /// Reads and discards the bytes received so far, at most 16 KiB of each tty.
    pub(crate) fn discard(&mut self) {
        let mut bytes = [0; 1_024];
        for tty in self.ttys() {
            let reads = (0..16).take_while(|_| matches!(tty.read(&mut bytes), Ok(1..)));
            reads.for_each(drop);
        }
    }

    pub(crate) fn names(&mut self) -> Vec<String> {
        self.ttys().map(|tty| tty.to_string()).collect()
    }

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

    pub(crate) fn ttys(&mut self) -> impl Iterator<Item = &mut Replug> {
        let (first, second) = match self {
            Self::Pair(pair) => (pair.upstream.port_mut(), Some(pair.downstream.port_mut())),
            Self::Shared(shared) => (shared.channel.port_mut(), None),
        };
        [Some(first), second]
            .into_iter()
            .flatten()
            .filter_map(|end| end.0.as_mut())
    }
}
