//! Options for data traffic over the agreed chain.

use clap::{Args, ValueEnum};
use uav_relay_scenario::link::Radio;
use uav_relay_scenario::{Interference, Scenario};

use crate::command::{Failure, given_option, number, whole};
use crate::simulator::route::DataLink;
use crate::simulator::traffic::TrafficSpec;

/// Command-line options for the simulated data traffic.
#[derive(Args, Debug)]
#[command(next_help_heading = "Data traffic")]
pub struct Data {
    /// Send packets through the chain: from Tx to Rx (forward, the default), or both ways. Each way has half of the time. They start at
    /// the first agreement. Every hop has its own data rate, by the table `link` of the scenario, and every node a queue. Reports
    /// predicted, offered and delivered data rates, delays and queue lengths. A run without --soak goes on for 1000 packets, and
    /// 30 more for each hop
    #[arg(long, value_name = "WAY", value_enum, num_args = 0..=1, default_missing_value = "forward")]
    traffic: Option<Way>,
    /// Bandwidth of one frequency, hertz, 1 to 1e12. The default is link.bandwidth_hz, or else noise.bandwidth_hz, of the scenario
    #[arg(long, value_name = "B", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1.0, 1e12))]
    bandwidth_hz: Option<f64>,
    /// Offered data rate, bit/s, 1e-3 to 1e12, each way. The default is the predicted rate at the positions of the first agreement
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-3, 1e12))]
    offer_bps: Option<f64>,
    /// Size of a packet, bytes, 1 to 1000000000; default 1500
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1_u32, 1_000_000_000))]
    packet_bytes: Option<u32>,
    /// Largest number of packets in the queue of a node, 1 to 100000; default 100
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1_u32, 100_000))]
    queue_packets: Option<u32>,
}

/// Directions in which data is sent through the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Way {
    /// Packets from Tx to Rx
    Forward,
    /// Packets from Tx to Rx and from Rx to Tx
    Both,
}

impl Data {
    /// Rejects traffic options without `--traffic`, and traffic toward Tx if its SIRs are not known.
    ///
    /// SIRs toward Tx are unknown in a random field, and after an upload. `uploads` is true if the run has an upload.
    pub(super) fn agree(&self, interference: &Interference, uploads: bool) -> Result<(), Failure> {
        let told = [
            given_option("--bandwidth-hz", self.bandwidth_hz),
            given_option("--offer-bps", self.offer_bps),
            given_option("--packet-bytes", self.packet_bytes),
            given_option("--queue-packets", self.queue_packets),
        ];
        let line = match (told.into_iter().flatten().next(), self.traffic) {
            (Some(option), None) => format!("{option}: has no effect without --traffic"),
            (_, Some(Way::Both)) if matches!(interference, Interference::Field(_)) => {
                "--traffic both: a [field] does not give the interference at Tx, which the traffic to Tx needs; allowed: forward"
                    .to_owned()
            }
            (_, Some(Way::Both)) if uploads => {
                "--traffic both: the SIRs from Rx to Tx are unknown after an --upload; allowed: forward"
                    .to_owned()
            }
            _ => return Ok(()),
        };
        Err(Failure::input(line))
    }

    /// Returns the requested data traffic over the data link of `scenario`; `None` without `--traffic`.
    pub(super) fn spec(&self, scenario: &Scenario) -> Result<Option<TrafficSpec>, Failure> {
        let Some(way) = self.traffic else {
            return Ok(None);
        };
        let radio = Radio::new(scenario, self.bandwidth_hz)
            .map_err(|error| Failure::input(format!("--traffic: {error}")))?;
        Ok(Some(TrafficSpec {
            link: DataLink {
                radio,
                packet_bits: 8.0 * f64::from(self.packet_bytes.unwrap_or(1_500)),
                both: way == Way::Both,
                reverse: scenario.reverse,
            },
            queue_packets: self.queue_packets.unwrap_or(100) as usize,
            offered_bps: self.offer_bps.map(|rate_bps| [rate_bps; 2]),
        }))
    }
}
