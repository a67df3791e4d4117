//! Packets on the [route](mod@super::route) of the chain, with a queue at every node.
//!
//! | item | rule |
//! | --- | --- |
//! | source | a packet every P / offered rate at Tx, from the first agreement to the end; at Rx for the way back |
//! | queue | one at each node for each direction, first in, first out; it includes the packet that is being sent |
//! | full queue | the new packet is dropped |
//! | transmission | at the present rate of the hop, within its slots; a packet may continue in the next slot of its hop |
//! | change of the rate | the rest of the packet is sent at the new rate |
//! | change of the receiver, dead hop | the packet stays in the queue and is sent anew |
//! | silent relay | its queue is lost |
//!
//! Every packet that arrives at a relay in time for its slot is sent in that slot. Headers, guard times, acknowledgements and
//! transmission errors are not modelled: a hop carries its rate. Nothing is random.
//!
//! A period may deliver more than its promised rate, because packets from before it may have waited in queues.
//!
//! Work: one event for each packet and hop, at most [`MOST_SENT`].

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::fmt;

use super::outcome::{Ending, Outcome};
use super::route::{self, DataLink, Hop, Period, Ps, Route, SECOND, Stage, TrueHops};

/// Number of packets that are sent after the end of a run that stops at its result, not at a set time. The data rates
/// in the report are then averages over many packets.
const AFTER: usize = 1_000;
/// Number of packets for each hop that are sent after the end of a run, in addition to [`AFTER`].
const AFTER_A_HOP: usize = 30;

/// Largest number of packet transmissions, over all hops, that is simulated.
pub const MOST_SENT: f64 = 1e8;

/// Latest end of the simulated traffic, s of virtual time.
pub const LATEST_S: f64 = 1e6;

/// Parameters of the data traffic of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct TrafficSpec {
    /// Data link, size of the packets, and directions.
    pub link: DataLink,
    /// Largest number of packets in the queue of a node, at least 1.
    pub queue_packets: usize,
    /// Offered data rates, bit/s: to Rx, then back to Tx.
    ///
    /// `None` to offer the rates that the planner's formula gives at the positions of the first agreement.
    pub offered_bps: Option<[f64; 2]>,
}

/// Error: the simulation of the requested traffic would take too long.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum TrafficError {
    /// The number of packet transmissions, this value, is too large.
    TooMany(f64),
    /// The end of the traffic, this value in s of virtual time, is too late.
    TooLong(f64),
}

impl fmt::Display for TrafficError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooMany(sent) => write!(
                f,
                "--traffic: the run would have {sent:.3e} transmissions of packets; allowed: up to {MOST_SENT:e}; give larger --packet-bytes or a shorter run"
            ),
            Self::TooLong(end_s) => write!(
                f,
                "--traffic: sending the packets would end at {end_s:.3e} s of virtual time; allowed: up to {LATEST_S:e} s; give smaller --packet-bytes or a \
                 larger bandwidth"
            ),
        }
    }
}

impl std::error::Error for TrafficError {}

/// Numbers of packets: created, delivered, dropped, and lost with a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Packets {
    /// Number of packets that the source created.
    pub offered: u64,
    /// Number of packets that arrived at their destination, Rx or Tx.
    pub delivered: u64,
    /// Number of packets that were dropped because a queue was full.
    pub dropped: u64,
    /// Number of packets that were lost in the queues of relays that went silent.
    pub lost: u64,
}

/// Counts of the packets of one period, and the delays of the delivered packets.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Delivery {
    /// Numbers of packets offered, delivered, dropped and lost in the period.
    pub packets: Packets,
    /// Delays of the delivered packets from end to end, ps; sorted once the traffic has ended.
    pub delays: Vec<Ps>,
}

/// Length of a node's packet queue over the time of the traffic.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct QueueLength {
    /// Number of the node: 0 for Tx, then the relays from 1, then Rx.
    pub node: usize,
    /// Mean length of the queue over the time of the traffic, packets.
    pub mean: f64,
    /// Largest length of the queue during the traffic, packets.
    pub most: usize,
}

/// Data traffic of a run in one direction.
#[derive(Clone, PartialEq, Debug)]
pub struct Flow {
    /// End of the traffic in this direction, ps of virtual time.
    pub until: Ps,
    /// Data rate by the planner's formula at the positions of the chain's first agreement, bit/s.
    pub promised_bps: f64,
    /// Data rate of the packets that the source created, bit/s.
    pub offered_bps: f64,
    /// Data rate of the packets that arrived, over the whole time of the traffic, bit/s.
    pub delivered_bps: f64,
    /// Numbers of packets over the whole time of the traffic.
    pub packets: Packets,
    /// Number of packets that are still in queues at the end of the traffic.
    pub queued: u64,
    /// Delays of all delivered packets from end to end, ps, in ascending order.
    pub delays: Vec<Ps>,
    /// Queue statistics of every node that sends.
    pub queues: Vec<QueueLength>,
    /// Packets and their delays in each period of [`Traffic::periods`].
    pub periods: Vec<Delivery>,
}

/// Data traffic of a run in all its directions.
#[derive(Clone, PartialEq, Debug)]
pub struct Traffic {
    /// Start of the traffic, ps of virtual time: the time of the first agreement on positions.
    pub from: Ps,
    /// End of the traffic in the direction that ends last, ps of virtual time.
    pub until: Ps,
    /// Periods with a constant view, state of the chain and promised data rate, in order of time. A view is a
    /// membership of the chain.
    pub periods: Vec<Period>,
    /// Traffic to Rx and, if data goes both ways, traffic back to Tx.
    pub flows: Vec<Flow>,
}

/// Returns the delay, s, that the given fraction of packets does not exceed; `None` without packets.
///
/// `delays` are in ps, in ascending order.
pub fn quantile_s(delays: &[Ps], fraction: f64) -> Option<f64> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to the number of delays"
    )]
    let rank = (fraction * delays.len() as f64).ceil() as usize;
    let delay = delays.get(rank.saturating_sub(1));
    delay.map(|delay| *delay as f64 / SECOND)
}

/// Simulates packets through a chain after its first agreement on positions; `None` if there was none.
///
/// `outcome` has the recorded states of `relays` relays. After a run that stops at its result, not at a set time, the
/// traffic goes on in the final state: in each direction for 1000 packets, and 30 more for each hop.
///
/// # Errors
/// [`TrafficError`] if the traffic is too much to simulate.
pub fn traffic(
    spec: &TrafficSpec,
    true_hops: &TrueHops,
    outcome: &Outcome,
    relays: usize,
) -> Result<Option<Traffic>, TrafficError> {
    let Some(track) = &outcome.track else {
        return Ok(None);
    };
    let ended = route::ps(outcome.ended);
    let Some(route) = route::route(track, true_hops, &spec.link, relays, ended) else {
        return Ok(None);
    };
    let from = route.stages.first().map_or(0, |stage| stage.from);
    let promised = route.promised_bps.iter().copied();
    let offered: Vec<f64> = match spec.offered_bps {
        Some(offered) => promised.zip(offered).map(|(_, offered)| offered).collect(),
        None => promised.collect(),
    };
    let packets = |rate_bps: f64| rate_bps / spec.link.packet_bits;
    // Whole frames only: the promised rate is the mean over a frame.
    let last = route.stages.last().and_then(|stage| {
        let mut hops = stage.hops.iter().flatten();
        hops.next().map(|hop| hop.window)
    });
    let ends_itself = !matches!(outcome.ending, Ending::Soaked | Ending::OutOfTime);
    let end_s = |offered_bps: f64, promised_bps: f64| {
        let expected_bps = if promised_bps > 0.0 {
            offered_bps.min(promised_bps)
        } else {
            offered_bps
        };
        let after_s = if ends_itself && expected_bps > 0.0 {
            (AFTER + AFTER_A_HOP * (relays + 1)) as f64 / packets(expected_bps)
        } else {
            0.0
        };
        ended as f64 / SECOND + after_s
    };
    let mut flows = Vec::new();
    let mut sent = 0.0;
    for (offered_bps, promised_bps) in offered.iter().zip(&route.promised_bps) {
        let end_s = end_s(*offered_bps, *promised_bps);
        if end_s > LATEST_S {
            return Err(TrafficError::TooLong(end_s));
        }
        sent += packets(*offered_bps) * (end_s - from as f64 / SECOND) * (relays + 1) as f64;
        if sent > MOST_SENT {
            return Err(TrafficError::TooMany(sent));
        }
        let until = match last {
            Some(window) if ends_itself => window.frame_end(time(end_s)),
            _ => time(end_s),
        };
        let mut running = Running::new(spec, &route, flows.len(), *offered_bps);
        running.run(&route, until);
        flows.push(running.end((from, until), [*promised_bps, *offered_bps]));
    }
    Ok(Some(Traffic {
        from,
        until: flows.iter().map(|flow| flow.until).max().unwrap_or(ended),
        flows,
        periods: route.periods.clone(),
    }))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "0 to 1e18"
)]
fn time(seconds: f64) -> Ps {
    (seconds * SECOND) as Ps
}

/// Packet queue of a node, with the state of the packet that it sends.
#[derive(Clone, Debug, Default)]
struct Queue {
    /// Time of creation, ps, of each packet in the queue, the oldest first.
    packets: VecDeque<Ps>,
    /// Hop on which the node sends; `None` while it cannot send.
    hop: Option<Hop>,
    /// Time in the hop's slots, ps, that the first packet still needed at the time `since`. It is 0 before the packet's
    /// transmission starts.
    rest: Ps,
    since: Ps,
    /// Number of the node's present transmission. Scheduled ends of transmissions with a different number are out of
    /// date, and are ignored.
    number: u32,
    /// Integral of the queue's length over time, up to the time `counted`, in packets times ps. The mean length in the
    /// report is computed from it.
    sum: u128,
    counted: Ps,
    most: usize,
}

impl Queue {
    /// Updates the statistics of the queue's length. Must be called before each change of the length.
    fn count(&mut self, now: Ps) {
        self.sum += self.packets.len() as u128 * u128::from(now.saturating_sub(self.counted));
        self.counted = now;
        self.most = self.most.max(self.packets.len());
    }

    /// Begins or continues the transmission of the first packet and returns its end, ps.
    ///
    /// `None` if the queue is empty or the node cannot send.
    fn send(&mut self, now: Ps) -> Option<Ps> {
        self.number += 1;
        let hop = self.hop.filter(|_| !self.packets.is_empty())?;
        if self.rest == 0 {
            self.rest = hop.packet;
        }
        self.since = now;
        Some(hop.window.ends(now, self.rest))
    }

    /// Replaces the hop on which the node sends, from `now` on.
    ///
    /// If the receiver stays the same, the rest of the first packet is sent at the new rate. If the receiver changes,
    /// the whole packet is sent again.
    fn change(&mut self, hop: Option<Hop>, now: Ps) {
        self.rest = match (self.hop, hop) {
            (Some(old), Some(new)) if old.to == new.to && self.rest > 0 => {
                let sent = old.window.between(self.since, now);
                let rest = u128::from(self.rest.saturating_sub(sent).max(1));
                let scaled = (rest * u128::from(new.packet)).div_ceil(u128::from(old.packet));
                Ps::try_from(scaled).unwrap_or(Ps::MAX)
            }
            _ => 0,
        };
        self.since = now;
        self.hop = hop;
    }
}

/// End of a packet's transmission: time, order, node, and number of the transmission. If several transmissions end at
/// the same time, the node nearest to the packets' destination has the lowest `order`.
type End = Reverse<(Ps, usize, usize, u32)>;

/// Simulation of the traffic in one direction, while it runs.
struct Running<'a> {
    spec: &'a TrafficSpec,
    direction: usize,
    /// Queues of all nodes: Tx, the relays and Rx.
    queues: Vec<Queue>,
    ends: BinaryHeap<End>,
    /// Time between two packets of the source, ps; `None` if it creates none.
    interval: Option<Ps>,
    next: Ps,
    period: usize,
    periods: Vec<Delivery>,
}

impl<'a> Running<'a> {
    fn new(spec: &'a TrafficSpec, route: &Route, direction: usize, offered_bps: f64) -> Self {
        let first = route.stages.first();
        let from = first.map_or(0, |stage| stage.from);
        let queue = Queue {
            counted: from,
            since: from,
            ..Queue::default()
        };
        let nodes = first.map_or(0, |stage| stage.on.len()) + 2;
        let interval_s = spec.link.packet_bits / offered_bps;
        Self {
            spec,
            direction,
            queues: vec![queue; nodes],
            ends: BinaryHeap::new(),
            // At most a frame at the promised rate, so that each packet is there before its slot.
            interval: (interval_s <= LATEST_S).then(|| time(interval_s).max(1)),
            next: from,
            period: 0,
            periods: vec![Delivery::default(); route.periods.len()],
        }
    }

    /// Returns the number of the node that creates the packets, and of the node to which they go.
    fn ends_of_chain(&self) -> [usize; 2] {
        let rx = self.queues.len() - 1;
        if self.direction == 0 {
            [0, rx]
        } else {
            [rx, 0]
        }
    }

    fn run(&mut self, route: &Route, until: Ps) {
        let next = route.stages.iter().skip(1).map(|stage| stage.from);
        for (stage, end) in route.stages.iter().zip(next.chain([until])) {
            self.enter(stage);
            self.pass(end.min(until));
        }
        for queue in &mut self.queues {
            queue.count(until);
        }
    }

    /// Replaces the hops of all nodes by the hops of `stage`. The queues of relays that are off are lost.
    fn enter(&mut self, stage: &Stage) {
        self.period = stage.period;
        let mut hops: Vec<Option<Hop>> = vec![None; self.queues.len()];
        for hop in stage.hops.get(self.direction).into_iter().flatten() {
            if let Some(own) = hops.get_mut(hop.from) {
                *own = Some(*hop);
            }
        }
        for (node, hop) in hops.into_iter().enumerate() {
            let Some(queue) = self.queues.get_mut(node) else {
                continue;
            };
            let relay = node.checked_sub(1).and_then(|relay| stage.on.get(relay));
            let is_off = relay.is_some_and(|on| !on);
            if is_off && !queue.packets.is_empty() {
                queue.count(stage.from);
                let lost = queue.packets.len() as u64;
                queue.packets.clear();
                queue.rest = 0;
                self.counts(|packets| packets.lost += lost);
            }
            if let Some(queue) = self.queues.get_mut(node) {
                queue.change(hop, stage.from);
            }
            self.send(node, stage.from);
        }
    }

    /// Processes all creations and arrivals of packets up to the time `until`.
    fn pass(&mut self, until: Ps) {
        loop {
            let end = self.ends.peek().map_or(Ps::MAX, |Reverse((at, ..))| *at);
            let next = self.interval.map_or(Ps::MAX, |_| self.next);
            // A packet that ends at the end of a stage still belongs to it.
            if end <= next && end <= until {
                if let Some(Reverse((at, _, node, number))) = self.ends.pop() {
                    self.arrive(at, node, number);
                }
            } else if next < end && next < until {
                let [source, _] = self.ends_of_chain();
                self.counts(|packets| packets.offered += 1);
                self.put(source, next, next);
                self.next += self.interval.unwrap_or(Ps::MAX);
            } else {
                return;
            }
        }
    }

    /// Moves the first packet of `node` to the packet's receiver. Does nothing if transmission `number` is no longer the current one.
    fn arrive(&mut self, at: Ps, node: usize, number: u32) {
        let Some(queue) = self.queues.get_mut(node) else {
            return;
        };
        let Some(hop) = queue.hop.filter(|_| queue.number == number) else {
            return;
        };
        queue.count(at);
        queue.rest = 0;
        let Some(created) = queue.packets.pop_front() else {
            return;
        };
        self.send(node, at);
        let [_, sink] = self.ends_of_chain();
        if hop.to == sink {
            self.counts(|packets| packets.delivered += 1);
            if let Some(period) = self.periods.get_mut(self.period) {
                period.delays.push(at - created);
            }
        } else {
            self.put(hop.to, at, created);
        }
    }

    /// Adds a packet, created at `created`, to the queue of `node`. If the queue is full, drops it.
    fn put(&mut self, node: usize, now: Ps, created: Ps) {
        let Some(queue) = self.queues.get_mut(node) else {
            return;
        };
        if queue.packets.len() >= self.spec.queue_packets {
            self.counts(|packets| packets.dropped += 1);
            return;
        }
        queue.count(now);
        queue.packets.push_back(created);
        queue.most = queue.most.max(queue.packets.len());
        if queue.packets.len() == 1 {
            self.send(node, now);
        }
    }

    /// Lets `node` send the first packet of its queue, if any, and schedules the end of that transmission.
    fn send(&mut self, node: usize, now: Ps) {
        let order = if self.direction == 0 {
            self.queues.len() - node
        } else {
            node
        };
        if let Some(queue) = self.queues.get_mut(node)
            && let Some(end) = queue.send(now)
        {
            self.ends.push(Reverse((end, order, node, queue.number)));
        }
    }

    fn counts(&mut self, change: impl FnOnce(&mut Packets)) {
        if let Some(period) = self.periods.get_mut(self.period) {
            change(&mut period.packets);
        }
    }

    fn end(mut self, (from, until): (Ps, Ps), [promised_bps, offered_bps]: [f64; 2]) -> Flow {
        let mut packets = Packets::default();
        let mut delays = Vec::new();
        for period in &mut self.periods {
            packets.offered += period.packets.offered;
            packets.delivered += period.packets.delivered;
            packets.dropped += period.packets.dropped;
            packets.lost += period.packets.lost;
            delays.extend_from_slice(&period.delays);
            period.delays.sort_unstable();
        }
        delays.sort_unstable();
        let span = until.saturating_sub(from).max(1) as f64;
        let [_, sink] = self.ends_of_chain();
        let nodes = self.queues.iter().enumerate();
        let senders = nodes.filter(|(node, _)| *node != sink);
        Flow {
            until,
            promised_bps,
            offered_bps,
            delivered_bps: packets.delivered as f64 * self.spec.link.packet_bits / span * SECOND,
            packets,
            queued: self
                .queues
                .iter()
                .map(|queue| queue.packets.len() as u64)
                .sum(),
            delays,
            queues: senders
                .map(|(node, queue)| QueueLength {
                    node,
                    mean: queue.sum as f64 / span,
                    most: queue.most,
                })
                .collect(),
            periods: self.periods,
        }
    }
}
