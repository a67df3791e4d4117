//! Shared channel: nodes 0 to N - 1 are the relays, the following ones are the ground stations.

use uav_relay::Port;

use super::super::medium::{Agenda, AirEvent, Sent};
use super::super::queue::QueuedEvent;
use super::super::record::Link;
use super::receiver::Receiver;
use super::state::Chain;

impl Chain {
    /// Passes a frame to the node's radio. Returns false if there is no simulated channel.
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

    /// Returns the nodes in range of `node`.
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
        // A frame that some receiver missed would be no replay when sent again.
        if sent.missed == 0 {
            self.overhear(&sent.frame, Port::Shared, arrives);
        }
        let receivers = sent.heard_by.iter().map(|node| {
            node.checked_sub(relays)
                .map_or(Receiver::Relay(*node), Receiver::Ground)
        });
        let mut note = self.send(sent.from, &sent.frame, Port::Shared, arrives, receivers);
        if sent.missed > 0 {
            let missed = format!("{} in range did not receive it", sent.missed);
            note = if note.is_empty() {
                missed
            } else {
                format!("{missed}; {note}")
            };
        }
        self.keep_frame(self.now, Link::Shared, &sent.frame, note);
    }
}
