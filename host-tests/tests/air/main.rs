//! The air as a medium: what is lost on a channel that all share, losses in runs, relays that do not hear each other, and how much of
//! the time a chain is right in spite of them.
//!
//! `cargo test --test air -- --ignored --nocapture` prints how chains do on bad channels.

mod aloha;
mod bursts;
mod chain;
mod flying;
mod hour;
mod medium;
mod soak;
mod table;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use uav_relay::{Duration, Instant};
use uav_relay_sim::simulator::link::LinkSpec;
use uav_relay_sim::simulator::medium::{Access, Agenda, AirCounts, AirEvent, Medium, Sent};

/// A medium on a clock of its own, and what has got through.
struct Bench {
    medium: Medium,
    /// Who hears a node.
    hearers: Vec<Vec<usize>>,
    due: BinaryHeap<Reverse<(Instant, u64, usize, u8)>>,
    order: u64,
    /// When a frame was over, and what it was.
    sent: Vec<(Instant, Sent)>,
}

const BAUD: u32 = 9_600;

impl Bench {
    /// `hearers[node]` are the nodes that hear `node`.
    fn new(access: Access, hearers: Vec<Vec<usize>>, seed: u64) -> Self {
        let link = LinkSpec {
            baud: BAUD,
            latency: Duration::from_millis(0),
        };
        Self {
            medium: Medium::new(access, link, hearers.len(), seed),
            hearers,
            due: BinaryHeap::new(),
            order: 0,
            sent: Vec::new(),
        }
    }

    /// All hear each other.
    fn in_one_range(access: Access, nodes: usize, seed: u64) -> Self {
        let others = |node| (0..nodes).filter(move |by| *by != node).collect();
        Self::new(access, (0..nodes).map(others).collect(), seed)
    }

    /// Goes on to `at` and hands `node` a frame then.
    fn offer(&mut self, at: Instant, node: usize, frame: &[u8]) -> bool {
        self.go_on(at);
        let mut agenda = Agenda::new();
        let taken = self.medium.offer(at, node, frame, &mut agenda);
        self.put(agenda);
        taken
    }

    fn put(&mut self, agenda: Agenda) {
        for (at, event) in agenda {
            let (node, kind) = match event {
                AirEvent::Sense(node) => (node, 0),
                AirEvent::Begin(node) => (node, 1),
                AirEvent::End(node) => (node, 2),
            };
            self.due.push(Reverse((at, self.order, node, kind)));
            self.order += 1;
        }
    }

    /// All that is due before `until` happens.
    fn go_on(&mut self, until: Instant) {
        while let Some(Reverse((at, _, node, kind))) = self.due.peek().copied()
            && at < until
        {
            self.due.pop();
            let event = [AirEvent::Sense, AirEvent::Begin, AirEvent::End][usize::from(kind)](node);
            let mut agenda = Agenda::new();
            let hearers = |from: usize| self.hearers[from].clone();
            if let Some(sent) = self.medium.happen(at, event, hearers, &mut agenda) {
                self.sent.push((at, sent));
            }
            self.put(agenda);
        }
    }

    /// All that is to come happens; who sent and who heard it, in order, and the counters.
    fn end(mut self) -> (Vec<(usize, Vec<usize>)>, AirCounts) {
        self.go_on(Instant::from_micros(u64::MAX));
        let sent = self.sent.into_iter();
        let who = sent.map(|(_, sent)| (sent.from, sent.heard_by)).collect();
        (who, self.medium.counts())
    }
}

/// How long `bytes` bytes take, µs.
fn micros(bytes: u64) -> u64 {
    (bytes * 10_000_000).div_ceil(u64::from(BAUD))
}

fn at(micros: u64) -> Instant {
    Instant::from_micros(micros)
}

const fn seconds(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}
