//! Transmission of frames between relays over links or an ideal shared channel.

use std::fmt::Write as _;

use uav_relay::{Instant, Port, Side, Wiring};

use super::{Chain, QueuedEvent};
use crate::simulator::attack::Recorded;
use crate::simulator::faults::{Arrival, Faults};
use crate::simulator::medium::{Agenda, AirEvent, Sent};
use crate::simulator::outcome::{Link, OnAir, Shot, Transmission};

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

    /// Gives a copy of a sent frame to the attacker, who can replay it after its arrival at `arrives`.
    ///
    /// `into` is the port at which receivers get the frame.
    pub(super) fn overhear(&mut self, frame: &[u8], into: Port, arrives: Instant) {
        if let Some(attacker) = &mut self.attacker {
            attacker.record(Recorded {
                arrived: arrives,
                port: into,
                bytes: frame.to_vec(),
            });
        }
    }

    /// Queues the arrivals of a frame at `receivers`, with random faults. Returns a text about these faults.
    ///
    /// The frame was sent by node `from`, and arrives at the receivers' port `into`. It arrives at the time `arrives`
    /// unless a fault delays it.
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
                let (at, event) = match receiver {
                    Receiver::Relay(at) => (at, QueuedEvent::Bytes { port: into, bytes }),
                    Receiver::Ground(at) => (at, QueuedEvent::StationBytes { bytes }),
                };
                self.queue.put(arrives + late, at, event);
            }
        }
        note
    }

    /// Returns true if a burst of losses on the link from node `from` to `receiver` loses the next frame.
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

/// Receiver of a frame: the index, from 0, of a relay or of a ground station.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Receiver {
    Relay(usize),
    Ground(usize),
}

impl Chain {
    /// Queues a frame at the radio of `node`. Returns false if the run simulates no half-duplex channel.
    ///
    /// `node` counts relays from 0, then ground stations.
    pub(super) fn broadcast(&mut self, node: usize, frame: &[u8]) -> bool {
        let Some(medium) = &mut self.medium else {
            return false;
        };
        let mut agenda = Agenda::new();
        if medium.offer(self.now, node, frame, &mut agenda) {
            self.outcome.messages += 1;
            self.outcome.bytes += frame.len() as u64;
        }
        self.expect(agenda);
        true
    }

    pub(super) fn on_air(&mut self, event: AirEvent) {
        let Some(mut medium) = self.medium.take() else {
            return;
        };
        let mut agenda = Agenda::new();
        let sent = medium.happen(self.now, event, |node| self.hearers(node), &mut agenda);
        self.medium = Some(medium);
        self.expect(agenda);
        if let Some(sent) = sent {
            self.deliver(&sent);
        }
    }

    fn expect(&mut self, agenda: Agenda) {
        for (at, event) in agenda {
            self.queue.put(at, 0, QueuedEvent::Air(event));
        }
    }

    /// Returns the nodes that receive frames of `node` on the shared channel.
    ///
    /// Nodes are relays from 0, then ground stations.
    fn hearers(&self, node: usize) -> Vec<usize> {
        let relays = self.members.len();
        match node.checked_sub(relays) {
            None => {
                let stations = 0..self.stations.len();
                let near = stations.filter(|at| self.reaches_ground(node, Port::Shared, *at));
                let mut hearers = self.in_range(node);
                hearers.extend(near.map(|at| relays + at));
                hearers
            }
            Some(at) => (0..relays)
                .filter(|relay| self.reaches_ground(*relay, Port::Shared, at))
                .collect(),
        }
    }

    fn deliver(&mut self, sent: &Sent) {
        let relays = self.members.len();
        let arrives = self.now + self.setup.link.latency;
        // A frame that was not received by all cannot be replayed: for some receivers it would be new.
        if sent.missed == 0 {
            self.overhear(&sent.frame, Port::Shared, arrives);
        }
        let receivers = sent.heard_by.iter().map(|node| {
            node.checked_sub(relays)
                .map_or(Receiver::Relay(*node), Receiver::Ground)
        });
        let mut note = self.send(sent.from, &sent.frame, Port::Shared, arrives, receivers);
        if sent.missed > 0 {
            let missed = format!("{} in range did not receive the frame", sent.missed);
            note = if note.is_empty() {
                missed
            } else {
                format!("{missed}; {note}")
            };
        }
        self.keep_frame(self.now, Link::Shared, &sent.frame, note);
    }
}

impl Chain {
    /// Removes and returns the recorded frames that ended by `until`, in order of time.
    ///
    /// Empty unless [`Setup::record`](crate::simulator::setup::Setup::record) was set.
    pub fn frames(&mut self, until: Instant) -> Vec<OnAir> {
        self.record
            .as_mut()
            .map(|record| record.take(until))
            .unwrap_or_default()
    }

    /// Returns the time when the last bit of a frame was sent: its time of arrival minus the latency.
    pub(super) fn sent_at(&self, arrives: Instant) -> Instant {
        let latency = self.setup.link.latency.as_micros();
        Instant::from_micros(arrives.as_micros().saturating_sub(latency))
    }

    pub(super) fn keep_frame(&mut self, at: Instant, link: Link, frame: &[u8], note: String) {
        if let Some(record) = &mut self.record {
            record.put(at, link, frame, note);
        }
    }

    /// Appends a text to `note`: the faults of a frame at one receiver (lost, twice, changed or late).
    ///
    /// `arrivals` are the arrivals of `frame` at `receiver`, after the faults.
    pub(super) fn remark(
        &self,
        note: &mut String,
        receiver: Receiver,
        frame: &[u8],
        arrivals: &[Arrival],
    ) {
        if self.record.is_none() {
            return;
        }
        let mut fates = Vec::new();
        match arrivals {
            [] => fates.push("lost"),
            [_] => {}
            _ => fates.push("twice"),
        }
        if arrivals.iter().any(|arrival| arrival.bytes != frame) {
            fates.push("changed");
        }
        if arrivals.iter().any(|arrival| arrival.late > 0) {
            fates.push("late");
        }
        if fates.is_empty() {
            return;
        }
        let whom = match receiver {
            Receiver::Relay(at) => format!("relay {}", at + 1),
            Receiver::Ground(at) => match self.stations.get(at).map(|station| station.end) {
                Some(Side::Downstream) => "Rx".to_owned(),
                _ => "Tx".to_owned(),
            },
        };
        if !note.is_empty() {
            note.push_str("; ");
        }
        _ = write!(note, "at {whom}: {}", fates.join(", "));
    }
}

/// Returns the link to which `port` of relay `index` (from 0) is connected.
pub(super) fn link(index: usize, port: Port) -> Link {
    let number = u16::try_from(index).unwrap_or(u16::MAX);
    match port {
        Port::Shared => Link::Shared,
        Port::Upstream => Link::After(number),
        Port::Downstream => Link::After(number.saturating_add(1)),
    }
}

/// Largest difference of node numbers between neighbours, even if the radios reach farther.
const NEIGHBOUR: usize = 4;

impl Chain {
    /// Returns the number of relays toward Tx, and toward Rx, that receive a relay's frames.
    pub(super) fn reach(&self) -> usize {
        match self.setup.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => self.setup.radio_reach,
        }
    }

    /// Returns true if a partition separates the relays `one` and `other` (from 0) at present.
    pub(super) fn are_parted(&self, one: usize, other: usize) -> bool {
        let parts = &self.setup.partitions;
        parts
            .iter()
            .any(|part| part.parts(number(one), number(other), self.now))
    }

    /// Returns true if relay `by` can receive relay `of` now, as far as failures count. Both numbers are from 0.
    ///
    /// A failure is a partition or a one-way link failure. The radio range is not checked.
    pub(super) fn hears(&self, by: usize, of: usize) -> bool {
        let deaf = &self.setup.deaf;
        !self.are_parted(by, of)
            && !deaf
                .iter()
                .any(|deaf| deaf.applies(number(by), number(of), self.now))
    }

    /// Returns true if the relays `one` and `other` (from 0) can be neighbours at present.
    ///
    /// Their numbers must differ by at most [`NEIGHBOUR`] and the radio range, and the two relays must receive each
    /// other.
    pub(super) fn are_linked(&self, one: usize, other: usize) -> bool {
        let most = self.reach().min(NEIGHBOUR);
        one.abs_diff(other) <= most && self.hears(one, other) && self.hears(other, one)
    }

    /// Returns the relays (from 0) that receive relay `index` on a shared channel at present.
    pub(super) fn in_range(&self, index: usize) -> Vec<usize> {
        let reach = self.setup.radio_reach;
        let until = self.members.len().min(index + reach + 1);
        (index.saturating_sub(reach)..until)
            .filter(|by| *by != index && self.hears(*by, index))
            .collect()
    }
}

fn number(index: usize) -> u16 {
    u16::try_from(index + 1).unwrap_or(u16::MAX)
}

impl Chain {
    /// Records the state of relay `index` (from 0) for the animation, if it changed.
    pub(super) fn film(&mut self, index: usize) {
        let (Some(film), Some(member)) = (&mut self.outcome.film, self.members.get_mut(index))
        else {
            return;
        };
        let is_on = member.killed.is_none();
        let before = member.filmed;
        let place = if is_on {
            member.relay.setpoint()
        } else {
            before.and_then(|(_, place)| place)
        };
        if before != Some((is_on, place)) {
            member.filmed = Some((is_on, place));
            film.shots.push(Shot {
                at: self.now,
                relay: member.node,
                is_on,
                place,
                messages: self.outcome.messages,
            });
        }
    }

    pub(super) fn film_frame(&mut self, index: usize, port: Port) {
        if let (Some(film), Some(member)) = (&mut self.outcome.film, self.members.get(index)) {
            film.sent.push(Transmission {
                at: self.now,
                relay: member.node,
                to: match port {
                    Port::Upstream => Some(Side::Upstream),
                    Port::Downstream => Some(Side::Downstream),
                    Port::Shared => None,
                },
            });
        }
    }
}
