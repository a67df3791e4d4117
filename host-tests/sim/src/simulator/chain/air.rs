//! Transmission of frames between relays over links or an ideal shared channel.

use uav_relay::{Instant, Port};

use super::super::attack::Recorded;
use super::super::faults::Faults;
use super::super::queue::QueuedEvent;
use super::receiver::Receiver;
use super::recorded::link;
use super::state::Chain;

impl Chain {
    pub(super) fn transmit(&mut self, index: usize, port: Port, frame: &[u8]) {
        if port == Port::Shared && self.broadcast(index, frame) {
            return;
        }
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
        let (near, into) = match port {
            Port::Upstream => (index.checked_sub(1), Port::Downstream),
            Port::Downstream => (Some(index + 1), Port::Upstream),
            Port::Shared => (None, Port::Shared),
        };
        let near = near.filter(|by| *by < self.members.len() && self.hears(*by, index));
        let relays = match port {
            Port::Shared => self.in_range(index),
            _ => near.into_iter().collect(),
        };
        let grounds = (0..self.stations.len())
            .filter(|at| self.reaches_ground(index, port, *at))
            .map(Receiver::Ground);
        let relays = relays.into_iter().map(Receiver::Relay);
        let receivers: Vec<Receiver> = relays.chain(grounds).collect();
        self.overhear(frame, into, arrives);
        let note = self.send(index, frame, into, arrives, receivers);
        self.keep_frame(self.sent_at(arrives), link(index, port), frame, note);
    }

    /// Records for the attacker a frame that reaches all its receivers.
    pub(super) fn overhear(&mut self, frame: &[u8], into: Port, arrives: Instant) {
        if let Some(attacker) = &mut self.attacker {
            attacker.record(Recorded {
                arrived: arrives,
                port: into,
                bytes: frame.to_vec(),
            });
        }
    }

    /// Schedules the arrivals of a frame of node `from` at its receivers, with faults. Returns a description of the faults.
    pub(super) fn send(
        &mut self,
        from: usize,
        frame: &[u8],
        into: Port,
        arrives: Instant,
        receivers: impl IntoIterator<Item = Receiver>,
    ) -> String {
        let mut note = String::new();
        let late_by = self.setup.link.hop_time();
        let mut faults = match self.setup.faults_end {
            Some(end) if self.now >= end => Faults::default(),
            _ => self.setup.faults,
        };
        let in_runs = self.bursts.is_some() && faults.loss > 0.0;
        if in_runs {
            faults.loss = 0.0;
        }
        for receiver in receivers {
            if in_runs && self.loses(from, receiver) {
                self.outcome.injected.lost += 1;
                self.remark(&mut note, receiver, frame, &[]);
                continue;
            }
            let arrivals = faults.inject(frame, &mut self.rng, &mut self.outcome.injected);
            self.remark(&mut note, receiver, frame, &arrivals);
            for arrival in arrivals {
                let late = late_by.times(u32::try_from(arrival.late).unwrap_or(u32::MAX));
                let bytes = arrival.bytes;
                let (at, happening) = match receiver {
                    Receiver::Relay(at) => (at, QueuedEvent::Bytes { port: into, bytes }),
                    Receiver::Ground(at) => (at, QueuedEvent::Heard { bytes }),
                };
                self.queue.put(arrives + late, at, happening);
            }
        }
        note
    }

    /// Returns true if a burst of losses hits the frame.
    fn loses(&mut self, from: usize, receiver: Receiver) -> bool {
        let to = match receiver {
            Receiver::Relay(at) => at,
            Receiver::Ground(at) => self.members.len() + at,
        };
        self.bursts
            .as_mut()
            .is_some_and(|bursts| bursts.loses(from, to, &mut self.rng))
    }
}
