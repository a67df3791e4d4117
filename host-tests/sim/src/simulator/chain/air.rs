//! How frames travel from one relay to others.

use uav_relay::{Instant, Port};

use super::super::attack::Recorded;
use super::super::faults::Faults;
use super::super::queue::Happening;
use super::state::Chain;

/// Who hears a frame, counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Receiver {
    Relay(usize),
    Ground(usize),
}

impl Chain {
    /// Whether relays `one` and `other` (from 0) cannot hear each other now.
    pub(super) fn are_parted(&self, one: usize, other: usize) -> bool {
        let of = |index: usize| u16::try_from(index + 1).unwrap_or(u16::MAX);
        let parts = &self.setup.partitions;
        parts
            .iter()
            .any(|part| part.parts(of(one), of(other), self.now))
    }

    /// Puts a frame on a link.
    pub(super) fn transmit(&mut self, index: usize, port: Port, frame: &[u8]) {
        self.outcome.messages += 1;
        self.outcome.bytes += frame.len() as u64;
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let line = if port == Port::Downstream {
            &mut member.lines[1]
        } else {
            &mut member.lines[0]
        };
        let arrives = line.send(self.now, frame.len(), &self.setup.link);
        let reach = self.setup.radio_reach;
        let (receivers, into) = match port {
            Port::Upstream => (index.saturating_sub(1)..index, Port::Downstream),
            Port::Downstream => (index + 1..index + 2, Port::Upstream),
            Port::Shared => (index.saturating_sub(reach)..index + reach + 1, Port::Shared),
        };
        let relays = receivers
            .filter(|receiver| *receiver != index)
            .filter(|receiver| *receiver < self.members.len() && !self.are_parted(index, *receiver))
            .map(Receiver::Relay);
        let grounds = (0..self.stations.len())
            .filter(|at| self.reaches_ground(index, port, *at))
            .map(Receiver::Ground);
        let receivers: Vec<Receiver> = relays.chain(grounds).collect();
        self.send(frame, into, arrives, receivers);
    }

    /// Puts `frame` into the queues of all that hear it, each with what happens to it on its way.
    pub(super) fn send(
        &mut self,
        frame: &[u8],
        into: Port,
        arrives: Instant,
        receivers: impl IntoIterator<Item = Receiver>,
    ) {
        if let Some(attacker) = &mut self.attacker {
            attacker.record(Recorded {
                arrived: arrives,
                port: into,
                bytes: frame.to_vec(),
            });
        }
        let late_by = self.setup.link.hop_time();
        let faults = match self.setup.faults_end {
            Some(end) if self.now >= end => Faults::default(),
            _ => self.setup.faults,
        };
        for receiver in receivers {
            let arrivals = faults.inject(frame, &mut self.rng, &mut self.outcome.injected);
            for arrival in arrivals {
                let late = late_by.times(u32::try_from(arrival.late).unwrap_or(u32::MAX));
                let bytes = arrival.bytes;
                let (at, happening) = match receiver {
                    Receiver::Relay(at) => (at, Happening::Bytes { port: into, bytes }),
                    Receiver::Ground(at) => (at, Happening::Heard { bytes }),
                };
                self.queue.put(arrives + late, at, happening);
            }
        }
    }
}
