//! Report of the data traffic: promised, offered and delivered rates, delays and queues.

use std::fmt::Write as _;

use serde::Serialize;

use crate::simulator::route::{ChainState, Period, Ps, SECOND};
use crate::simulator::traffic::{Flow, Packets, QueueLength, Traffic, TrafficSpec, quantile_s};

/// Number of periods that a shortened text lists at its start, and again at its end.
const ENDS: usize = 10;

/// Largest number of queues that the text lists completely. If there are more queues, it lists only the 8 queues with
/// the largest mean length.
const SHOWN: usize = 16;

/// Data traffic of a run. Each array has one value for the direction to Rx and, if data goes both ways, a second
/// value for the direction to Tx.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TrafficReport {
    /// Promised data rates, bit/s, for each direction: computed for the positions of the first agreement.
    pub promised_bps: Vec<f64>,
    /// Data rates of the packets that the sources created, bit/s, for each direction.
    pub offered_bps: Vec<f64>,
    /// Data rates of the packets that arrived since the first agreement, bit/s, for each direction.
    pub delivered_bps: Vec<f64>,
    /// Details of the traffic: its parameters, packets, delays and queues.
    pub traffic: TrafficDetails,
}

/// Details of the data traffic of a run: its parameters, packets, delays and queues.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TrafficDetails {
    /// Medium access, by its name in scenario files: `slots`, `channels` or `fitted`.
    pub access: &'static str,
    /// Bandwidth of one frequency of the data link, Hz.
    pub bandwidth_hz: f64,
    /// Size of a data packet, bytes.
    pub packet_bytes: f64,
    /// Largest number of packets in the queue of a node.
    pub queue_packets: usize,
    /// Start of the traffic, s of virtual time.
    pub from_s: f64,
    /// End of the traffic, s of virtual time. If data goes both ways, the later of the two ends.
    pub until_s: f64,
    /// Traffic in each direction: to Rx and, if data goes both ways, back to Tx.
    pub flows: Vec<FlowReport>,
    /// Periods of the run, in each of which the chain does not change. In a period, the view (set of members), the
    /// state, and the promised data rates are constant.
    pub periods: Vec<PeriodReport>,
    /// Text about how the hops share frequencies and time.
    #[serde(skip)]
    sharing: String,
    /// True if the lengths of the time slots are fitted to the hops' data rates toward Rx and toward Tx.
    #[serde(skip)]
    fits_both: bool,
}

/// Data traffic of a run in one direction.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FlowReport {
    /// Direction of the traffic: `forward` is from Tx to Rx, `backward` from Rx to Tx.
    pub direction: &'static str,
    /// End of the traffic in this direction, s of virtual time.
    pub until_s: f64,
    /// Number of packets that the source created.
    pub offered_packets: u64,
    /// Number of packets that arrived at their destination, Rx or Tx.
    pub delivered_packets: u64,
    /// Number of packets that were dropped because a queue was full.
    pub dropped_packets: u64,
    /// Number of packets that were lost in the queues of relays that went silent.
    pub lost_packets: u64,
    /// Number of packets that are still in queues at the end of the traffic.
    pub queued_packets: u64,
    /// Median delay from end to end of the packets that arrived, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_median_s: Option<f64>,
    /// Delay from end to end that 99 % of the packets that arrived do not exceed, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_99_s: Option<f64>,
    /// Queue of every node that sends, in order from Tx to Rx.
    pub queues: Vec<QueueReport>,
}

/// Packet queue of a node. It includes the packet that is being sent.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct QueueReport {
    /// Node of the queue: `Tx`, `Rx`, or the number of the relay.
    pub node: String,
    /// Mean length of the queue over the time of the traffic, packets.
    pub mean_packets: f64,
    /// Largest length that the queue had, packets.
    pub most_packets: usize,
}

/// Data traffic of a period in which the chain does not change.
///
/// Each array has one value for the direction to Rx and, if data goes both ways, a second one for the direction to
/// Tx.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct PeriodReport {
    /// Start of the period, s of virtual time.
    pub from_s: f64,
    /// End of the period, s of virtual time.
    pub until_s: f64,
    /// Number of the view (membership of the chain) in this period.
    pub view: u32,
    /// Number of relays in the view (membership of the chain).
    pub relays: u16,
    /// State of the chain: `agreed`, `pending` or `broken`.
    ///
    /// `agreed`: the relays are at agreed positions. `pending`: the relays have no agreement yet, or drones are on
    /// their way. `broken`: a relay of the view is silent, has no position, or has not accepted the view.
    pub state: &'static str,
    /// Data rates at the agreed positions, bit/s, for each direction; absent unless the state is `agreed`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub promised_bps: Vec<f64>,
    /// Data rates of the packets that arrived in this period, bit/s, for each direction.
    pub delivered_bps: Vec<f64>,
    /// Number of packets in this period that were dropped by full queues or lost, for each direction. Packets are lost
    /// in the queues of relays that go silent.
    pub missing_packets: Vec<u64>,
    /// Median delays of the packets that arrived in this period, s, for each direction.
    ///
    /// Absent if no packet arrived in one of the directions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub delay_median_s: Vec<f64>,
    /// Delays that 99 % of the packets that arrived in this period do not exceed, s, for each direction.
    ///
    /// Absent if no packet arrived in one of the directions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub delay_99_s: Vec<f64>,
}

const DIRECTIONS: [&str; 2] = ["forward", "backward"];

fn seconds(at: Ps) -> f64 {
    at as f64 / SECOND
}

impl TrafficReport {
    /// Creates the report of the simulated traffic `traffic`, whose parameters are `spec`.
    pub fn new(spec: &TrafficSpec, traffic: &Traffic) -> Self {
        let each = |of: fn(&Flow) -> f64| traffic.flows.iter().map(of).collect();
        let nodes = traffic.flows.first().map_or(0, |flow| flow.queues.len());
        let starts = traffic.periods.iter().skip(1).map(|period| period.from);
        let ends = starts.chain([traffic.until]);
        let periods = traffic.periods.iter().zip(ends).enumerate();
        Self {
            promised_bps: each(|flow| flow.promised_bps),
            offered_bps: each(|flow| flow.offered_bps),
            delivered_bps: each(|flow| flow.delivered_bps),
            traffic: TrafficDetails {
                access: spec.link.radio.link.access.name(),
                bandwidth_hz: spec.link.radio.bandwidth_hz,
                packet_bytes: spec.link.packet_bits / 8.0,
                queue_packets: spec.queue_packets,
                from_s: seconds(traffic.from),
                until_s: seconds(traffic.until),
                flows: traffic
                    .flows
                    .iter()
                    .zip(DIRECTIONS)
                    .map(|(flow, direction)| FlowReport::new(flow, direction, nodes))
                    .collect(),
                periods: periods
                    .map(|(at, (period, until))| {
                        PeriodReport::new(traffic, spec.link.packet_bits, (at, period), until)
                    })
                    .collect(),
                sharing: spec.link.radio.sharing(nodes),
                fits_both: spec.link.is_fitted_to_both(),
            },
        }
    }

    /// Formats the report of the traffic as lines of text.
    pub(super) fn text(&self) -> String {
        let TrafficDetails {
            packet_bytes,
            queue_packets,
            from_s,
            until_s,
            flows,
            periods,
            sharing,
            fits_both,
            ..
        } = &self.traffic;
        let halves = match flows.len() {
            0 | 1 => "",
            _ if *fits_both => ", both ways",
            _ => ", each way half of the time",
        };
        let mut text = format!(
            "traffic from {from_s:.3} to {until_s:.3} s: {sharing}{halves}; packets of {packet_bytes} bytes, up to {queue_packets} in a queue\n"
        );
        let rates = (self.promised_bps.iter())
            .zip(&self.offered_bps)
            .zip(&self.delivered_bps);
        for (flow, ((promised, offered), delivered)) in flows.iter().zip(rates) {
            let way = match flow.direction {
                "forward" => "Tx to Rx",
                _ => "Rx to Tx",
            };
            _ = writeln!(
                text,
                "{way}: {} Mbit/s predicted, {} offered, {} delivered",
                mega(*promised),
                mega(*offered),
                mega(*delivered)
            );
            text += &flow.text();
        }
        let skipped = periods.len().saturating_sub(2 * ENDS);
        for (at, period) in periods.iter().enumerate() {
            if skipped > 0 && at == ENDS {
                _ = writeln!(text, "{:>12}  {skipped} more periods", "...");
            }
            if skipped == 0 || at < ENDS || at >= ENDS + skipped {
                text += &period.text();
            }
        }
        text
    }
}

impl FlowReport {
    fn new(flow: &Flow, direction: &'static str, rx: usize) -> Self {
        let Packets {
            offered,
            delivered,
            dropped,
            lost,
        } = flow.packets;
        let queue = |queue: &QueueLength| QueueReport {
            node: match queue.node {
                0 => "Tx".to_owned(),
                node if node == rx => "Rx".to_owned(),
                node => node.to_string(),
            },
            mean_packets: queue.mean,
            most_packets: queue.most,
        };
        Self {
            direction,
            until_s: seconds(flow.until),
            offered_packets: offered,
            delivered_packets: delivered,
            dropped_packets: dropped,
            lost_packets: lost,
            queued_packets: flow.queued,
            delay_median_s: quantile_s(&flow.delays, 0.5),
            delay_99_s: quantile_s(&flow.delays, 0.99),
            queues: flow.queues.iter().map(queue).collect(),
        }
    }

    fn text(&self) -> String {
        let mut text = format!(
            "    packets until {:.3} s: {} offered, {} delivered, {} dropped by full queues, {} lost in relays that went silent, {} in queues at the end\n",
            self.until_s,
            self.offered_packets,
            self.delivered_packets,
            self.dropped_packets,
            self.lost_packets,
            self.queued_packets
        );
        if let (Some(median), Some(most)) = (self.delay_median_s, self.delay_99_s) {
            _ = writeln!(
                text,
                "    delay: median {} ms, 99 % within {} ms",
                milli(median),
                milli(most)
            );
        }
        let queue = |queue: &QueueReport| {
            let relay = if matches!(queue.node.as_str(), "Tx" | "Rx") {
                ""
            } else {
                "relay "
            };
            format!(
                "{relay}{}: {:.2} ({})",
                queue.node, queue.mean_packets, queue.most_packets
            )
        };
        let mut queues: Vec<&QueueReport> = self.queues.iter().collect();
        let (which, shown) = if queues.len() > SHOWN {
            queues.sort_by(|one, other| other.mean_packets.total_cmp(&one.mean_packets));
            ("longest queues", SHOWN / 2)
        } else {
            ("queues", SHOWN)
        };
        let queues: Vec<String> = queues.into_iter().take(shown).map(queue).collect();
        _ = writeln!(
            text,
            "    {which}, mean length (largest length), packets: {}",
            queues.join(", ")
        );
        text
    }
}

impl PeriodReport {
    fn new(traffic: &Traffic, packet_bits: f64, (at, period): (usize, &Period), until: Ps) -> Self {
        let own = || traffic.flows.iter().filter_map(|flow| flow.periods.get(at));
        // The last period of a direction ends with its traffic.
        let spans_s = traffic.flows.iter().map(|flow| {
            let end = until.min(flow.until);
            seconds(end.saturating_sub(period.from).max(1))
        });
        let delays = |fraction| {
            let all = own().filter_map(|own| quantile_s(&own.delays, fraction));
            let all: Vec<f64> = all.collect();
            if all.len() == traffic.flows.len() {
                all
            } else {
                Vec::new()
            }
        };
        Self {
            from_s: seconds(period.from),
            until_s: seconds(until),
            view: period.view,
            relays: period.relays,
            state: match period.state {
                ChainState::Agreed => "agreed",
                ChainState::Pending => "pending",
                ChainState::Broken => "broken",
            },
            promised_bps: period.promised_bps.clone(),
            delivered_bps: own()
                .zip(spans_s)
                .map(|(own, span_s)| own.packets.delivered as f64 * packet_bits / span_s)
                .collect(),
            missing_packets: own()
                .map(|own| own.packets.dropped + own.packets.lost)
                .collect(),
            delay_median_s: delays(0.5),
            delay_99_s: delays(0.99),
        }
    }

    fn text(&self) -> String {
        let list = |rates: &[f64]| {
            let rates: Vec<String> = rates.iter().map(|rate| mega(*rate)).collect();
            rates.join(" and ")
        };
        let relays = self.relays;
        let of = if relays == 1 { "relay" } else { "relays" };
        let state = match (self.state, self.promised_bps.as_slice()) {
            ("agreed", promised) => format!("{} Mbit/s predicted", list(promised)),
            ("pending", _) => "positions not agreed, or not reached yet".to_owned(),
            _ => "chain broken".to_owned(),
        };
        let mut text = format!(
            "{:>10.3} to {:.3} s: {relays} {of}, {state}, {} Mbit/s delivered",
            self.from_s,
            self.until_s,
            list(&self.delivered_bps)
        );
        if let [median, ..] = self.delay_median_s.as_slice() {
            _ = write!(text, ", median delay {} ms", milli(*median));
        }
        let missing: u64 = self.missing_packets.iter().sum();
        if missing > 0 {
            _ = write!(text, ", {missing} packets dropped or lost");
        }
        text + "\n"
    }
}

/// Formats a data rate, bit/s, as a number of Mbit/s with four significant digits.
fn mega(bps: f64) -> String {
    rounded(bps / 1e6)
}

/// Formats a time, s, as a number of ms with four significant digits.
fn milli(seconds: f64) -> String {
    rounded(seconds * 1e3)
}

/// Formats a number with four significant digits. Numbers below 0.001 have an exponent.
fn rounded(value: f64) -> String {
    if !(value > 0.0) {
        return "0".to_owned();
    }
    if value < 1e-3 {
        return format!("{value:.3e}");
    }
    let bounds = [1e-2, 1e-1, 1.0, 10.0, 100.0, 1e3];
    let digits = bounds.iter().filter(|bound| value < **bound).count();
    format!("{value:.digits$}")
}
