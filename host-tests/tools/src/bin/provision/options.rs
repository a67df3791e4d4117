use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum};
use uav_relay_sim::command::{MOST_BAUD, number, whole};
use uav_relay_tools::provision::config::MOST_PROBE_AFTER_MS;

/// Writes the configuration block of one relay, or of all: its index and its mission.
#[derive(Parser, Debug)]
#[command(
    name = "provision",
    bin_name = "cargo provision",
    disable_version_flag = true
)]
pub(crate) struct Options {
    /// Scenario file (TOML); by default the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    pub(crate) scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000; by default that of the scenario's plan or section `network`
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1, 1000))]
    pub(crate) uavs: Option<u16>,
    /// Index of this drone's relay, 1 (next to the transmitter) to N
    #[arg(long, value_name = "I", required_unless_present = "all", value_parser = whole::<u16>(1, 1000))]
    pub(crate) index: Option<u16>,
    /// Network number, 0 to 65535; frames of other networks are ignored. By default that of the scenario's section `network`, or
    /// 1
    #[arg(long, value_name = "W", value_parser = whole(0, u16::MAX))]
    pub(crate) network: Option<u16>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1; by default that of the scenario's plan, or 1e-4
    #[arg(long, value_name = "T", value_parser = |text: &str| number(text, 1e-6, 0.1))]
    pub(crate) tolerance: Option<f64>,
    /// Method that finds the places; in a field, only `align`. By default that of the scenario's plan or section `network`, or
    /// `align`
    #[arg(long, value_name = "M", value_enum)]
    pub(crate) method: Option<Method>,
    /// Largest number of rounds of `adjust`, 1 to 65535; 500 by default
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1, u16::MAX))]
    pub(crate) rounds: Option<u16>,
    /// Largest change of altitude in one round of `adjust`, metres, 0 to 1e5; 10 by default
    #[arg(long = "explore", value_name = "M", value_parser = explore)]
    pub(crate) explore_m: Option<f32>,
    /// Measure the field on board, and trust this many samples at a place, 100 to 1000000
    #[arg(long, value_name = "S", value_parser = whole::<u32>(100, 1_000_000))]
    pub(crate) samples: Option<u32>,
    /// File with the network's key, 64 hexadecimal digits. Without one here or in the scenario's section `network`, frames are not
    /// signed
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,
    /// Least epoch to sign with, 1 to 4294967294. It must exceed every epoch that a relay of this index has used with this key. It
    /// rises by itself from there. By default the seconds of this machine's clock
    #[arg(long, value_name = "E", value_parser = whole::<u32>(1, 0xFFFF_FFFE))]
    pub(crate) epoch: Option<u32>,
    /// Bits per second of the radio channel that the relays share, 300 to 10000000. Refused if too slow for them
    #[arg(long, value_name = "B", default_value_t = 115_200, value_parser = whole(300, MOST_BAUD))]
    pub(crate) baud: u32,
    /// Milliseconds of silence after which a relay probes a neighbour, 1 to 1200000. After three times as many the neighbour counts
    /// as lost. By default those of the scenario's section `network`, or 5000. Larger values let a slow channel carry more relays
    #[arg(long, value_name = "MS", value_parser = whole(1, MOST_PROBE_AFTER_MS))]
    pub(crate) probe_after_ms: Option<u32>,
    /// Number of relays within range of each other on the channel, 1 to 1000; by default all of them
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1, 1000))]
    pub(crate) in_range: Option<u16>,
    /// Neighbours are connected by wires, without a shared channel
    #[arg(long, conflicts_with_all = ["baud", "in_range"])]
    pub(crate) wires: bool,
    /// Greatest speed of the drone, m/s, 0.1 to 20, if the scenario has sites; 5 by default
    #[arg(long, value_name = "M/S", value_parser = speed)]
    pub(crate) speed: Option<f32>,
    /// File with the signing key of the drone's autopilot, 64 hexadecimal digits. It applies if the scenario has sites. Without a
    /// key the messages between the two are not signed
    #[arg(long, value_name = "FILE")]
    pub(crate) autopilot_key_file: Option<PathBuf>,
    /// Accept a hypothetical interferer in place of several. Without it a loss of more than 1 % of the best SIR is refused
    #[arg(long)]
    pub(crate) stand_in: bool,
    /// File to write the block to
    #[arg(long, value_name = "FILE", required_unless_present = "all")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) folder: FolderOptions,
}

/// Options for the blocks of all relays.
#[derive(Args, Debug)]
pub(crate) struct FolderOptions {
    /// Write the blocks of all relays, relay1.bin and so on, and summary.txt: all of them, or none
    #[arg(long, conflicts_with_all = ["index", "out"], requires = "out_dir")]
    pub(crate) all: bool,
    /// Output folder for the blocks of all relays; created if necessary
    #[arg(long, value_name = "DIR", requires = "all")]
    pub(crate) out_dir: Option<PathBuf>,
    /// Overwrite blocks that are in that folder
    #[arg(long, requires = "all")]
    pub(crate) force: bool,
}

/// Method that finds the places.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Method {
    /// Algorithm 1, in a field Algorithm 4
    Align,
    /// Places, sides and altitudes together
    #[value(alias = "altitude")]
    Joint,
    /// Algorithm 1, then Algorithm 2
    Adjust,
}

fn explore(text: &str) -> Result<f32, String> {
    within(text, 0.0, 1e5)
}

fn speed(text: &str) -> Result<f32, String> {
    within(text, 0.1, 20.0)
}

fn within(text: &str, least: f32, most: f32) -> Result<f32, String> {
    let value: Option<f32> = text.parse().ok();
    value
        .filter(|value| (least..=most).contains(value))
        .ok_or_else(|| format!("must be a number within {least:?} to {most:?}"))
}
