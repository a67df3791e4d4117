//! Radio channel: collisions, burst losses, hidden nodes, and the availability of chains.
//!
//! `cargo test --test air -- --ignored --nocapture` prints the results of chains on bad channels.

mod aloha;
mod bursts;
mod chain;
mod flying;
mod hour;
mod medium;
mod soak;

use std::collections::BTreeMap;

use uav_relay::{Duration, Instant};
use uav_relay_sim::simulator::faults::LinkSpec;
use uav_relay_sim::simulator::medium::{Access, Agenda, AirCounts, AirEvent, Medium, Sent};

/// Test bench: a radio channel with its own clock, and the frames completed on the channel.
struct Bench {
    medium: Medium,
    /// Receivers of each node: the nodes `hearers[n]` receive the frames of node n.
    hearers: Vec<Vec<usize>>,
    due: BTreeMap<(Instant, u64), AirEvent>,
    order: u64,
    /// Completed frames, each with the time at which it ended.
    sent: Vec<(Instant, Sent)>,
}

const BAUD: u32 = 9_600;

impl Bench {
    /// Creates a radio channel on which the nodes `hearers[n]` receive the frames of node n.
    fn new(access: Access, hearers: Vec<Vec<usize>>, seed: u64) -> Self {
        let link = LinkSpec {
            baud: BAUD,
            latency: Duration::from_millis(0),
        };
        Self {
            medium: Medium::new(access, link, hearers.len(), seed),
            hearers,
            due: BTreeMap::new(),
            order: 0,
            sent: Vec::new(),
        }
    }

    /// Creates a radio channel on which all nodes receive each other.
    fn in_one_range(access: Access, nodes: usize, seed: u64) -> Self {
        let others = |node| (0..nodes).filter(move |by| *by != node).collect();
        Self::new(access, (0..nodes).map(others).collect(), seed)
    }

    /// Advances the clock to `at`, then gives `node` a frame to send.
    ///
    /// Returns false if the queue of the node's radio is full.
    fn offer(&mut self, at: Instant, node: usize, frame: &[u8]) -> bool {
        self.go_on(at);
        let mut agenda = Agenda::new();
        let taken = self.medium.offer(at, node, frame, &mut agenda);
        self.put(agenda);
        taken
    }

    fn put(&mut self, agenda: Agenda) {
        for (at, event) in agenda {
            self.due.insert((at, self.order), event);
            self.order += 1;
        }
    }

    /// Processes all channel events before `until`.
    fn go_on(&mut self, until: Instant) {
        while let Some(next) = self.due.first_entry()
            && next.key().0 < until
        {
            let ((at, _), event) = next.remove_entry();
            let mut agenda = Agenda::new();
            let hearers = |from: usize| self.hearers[from].clone();
            if let Some(sent) = self.medium.happen(at, event, hearers, &mut agenda) {
                self.sent.push((at, sent));
            }
            self.put(agenda);
        }
    }

    /// Processes all remaining events. Returns the sender and the receivers of each frame, and the counters.
    ///
    /// The frames are in the order in which they ended; the counters are those of the channel.
    fn end(mut self) -> (Vec<(usize, Vec<usize>)>, AirCounts) {
        self.go_on(Instant::from_micros(u64::MAX));
        let sent = self.sent.into_iter();
        let who = sent.map(|(_, sent)| (sent.from, sent.heard_by)).collect();
        (who, self.medium.counts())
    }
}

/// Returns the air time of `bytes` bytes, µs.
fn micros(bytes: u64) -> u64 {
    (bytes * 10_000_000).div_ceil(u64::from(BAUD))
}

fn at(micros: u64) -> Instant {
    Instant::from_micros(micros)
}

const fn seconds(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}
