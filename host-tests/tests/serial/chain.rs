//! Chain of relays on mock ports with a virtual clock, and the same chain without ports.

use host_tests::fixtures;
use uav_relay::serial::{Io, Nb, Pair, SerialLink, SerialPort, SerialStats, Shared};
use uav_relay::{Duration, Event, Instant, Placement, Relay, Side, Wiring};

use crate::pipe::{End, IoEnd, NbEnd, ReadErrors};

pub(crate) const BAUD: u32 = 115_200;

/// Transmission time of one byte at [`BAUD`].
pub(crate) const BYTE_TIME: Duration = Duration::from_micros(87);

/// Port driver of a relay, for two wires or a shared channel. The simulated ports are of the type `IoEnd` or `NbEnd`.
pub(crate) trait Driver {
    fn poll(&mut self, now: Instant, relay: &mut Relay) -> Option<Instant>;
    /// Returns the counters of each port. The counters of the upstream or shared port come first.
    fn stats(&self) -> Vec<SerialStats>;
}

impl<U: SerialPort, D: SerialPort> Driver for Pair<U, D> {
    fn poll(&mut self, now: Instant, relay: &mut Relay) -> Option<Instant> {
        Self::poll(self, now, relay, |_| true)
    }

    fn stats(&self) -> Vec<SerialStats> {
        vec![*self.upstream.stats(), *self.downstream.stats()]
    }
}

impl<P: SerialPort> Driver for Shared<P> {
    fn poll(&mut self, now: Instant, relay: &mut Relay) -> Option<Instant> {
        Self::poll(self, now, relay, |_| true)
    }

    fn stats(&self) -> Vec<SerialStats> {
        vec![*self.channel.stats()]
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Nb,
    Io,
}

pub(crate) struct Node {
    pub(crate) relay: Relay,
    pub(crate) driver: Box<dyn Driver>,
    pub(crate) ends: Vec<End>,
    pub(crate) events: Vec<Event>,
    pub(crate) polls: u32,
}

impl Node {
    pub(crate) fn new(kind: Kind, relay: Relay, ends: &[End], trouble: &ReadErrors) -> Self {
        let nb = |end: &End| {
            let (end, trouble) = (end.clone(), trouble.clone());
            SerialLink::new(Nb(NbEnd { end, trouble }), BAUD)
        };
        let io = |end: &End| {
            let (end, trouble) = (end.clone(), trouble.clone());
            SerialLink::new(Io(IoEnd { end, trouble }), BAUD)
        };
        let driver: Box<dyn Driver> = match (kind, ends) {
            (Kind::Nb, [up, down]) => Box::new(Pair::new(nb(up), nb(down))),
            (Kind::Io, [up, down]) => Box::new(Pair::new(io(up), io(down))),
            (Kind::Nb, [channel]) => Box::new(Shared::new(nb(channel))),
            (Kind::Io, [channel]) => Box::new(Shared::new(io(channel))),
            _ => panic!("one port or two"),
        };
        Self {
            relay,
            driver,
            ends: ends.to_vec(),
            events: Vec::new(),
            polls: 0,
        }
    }
}

/// Creates relays on wires or on a channel with buffers of `capacity` bytes. Returns the relays, and the far ends of
/// the outermost wires.
pub(crate) fn chain(
    kind: Kind,
    wiring: Wiring,
    relays: u16,
    capacity: usize,
    trouble: &ReadErrors,
) -> (Vec<Node>, Vec<End>) {
    let count = usize::from(relays);
    let mut far = Vec::new();
    let ends: Vec<Vec<End>> = match wiring {
        Wiring::Shared => {
            let ends = End::channel(count, capacity);
            ends.into_iter().map(|end| vec![end]).collect()
        }
        Wiring::Pair => {
            let wires: Vec<[End; 2]> = (0..=count).map(|_| End::wire(capacity)).collect();
            far = vec![wires[0][0].clone(), wires[count][1].clone()];
            let pairs = wires.windows(2);
            pairs
                .map(|pair| vec![pair[0][1].clone(), pair[1][0].clone()])
                .collect()
        }
    };
    let nodes = (1..=relays)
        .zip(&ends)
        .map(|(index, ends)| Node::new(kind, fixtures::wired(relays, index, wiring), ends, trouble))
        .collect();
    (nodes, far)
}

/// Polls the relays when a timer expires or bytes can be read. Checks that each wake-up time is in the future. Returns
/// the time at the end.
pub(crate) fn run(nodes: &mut [Node], from: Instant, until: Instant) -> Instant {
    let mut now = from;
    while now < until {
        let mut next = until;
        for node in &mut *nodes {
            node.polls += 1;
            let wake = node.driver.poll(now, &mut node.relay);
            let wake = wake.into_iter().chain(node.relay.poll_timeout()).min();
            assert!(wake.is_none_or(|wake| wake > now), "{wake:?} at {now:?}");
            next = next.min(wake.unwrap_or(next));
            while let Some(event) = node.relay.poll_event() {
                node.events.push(event);
            }
        }
        if nodes
            .iter()
            .flat_map(|node| &node.ends)
            .any(|end| end.waiting() > 0)
        {
            next = next.min(now + BYTE_TIME);
        }
        now = next;
    }
    now
}

pub(crate) fn setpoints(nodes: &[Node]) -> Vec<Option<Placement>> {
    nodes.iter().map(|node| node.relay.setpoint()).collect()
}

pub(crate) fn has_lost(node: &Node, side: Side) -> bool {
    node.events
        .iter()
        .any(|event| matches!(event, Event::NeighbourLost { side: at, .. } if *at == side))
}
