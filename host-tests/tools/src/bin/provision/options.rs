//! The options of `cargo provision`, and their ranges.

use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum};
use uav_relay_sim::command::{MOST_BAUD, number, whole};
use uav_relay_tools::provision::config::MOST_PROBE_AFTER_MS;

/// Writes the configuration block of one relay, or of all: which one it is, and the mission it flies.
#[derive(Parser, Debug)]
#[command(
    name = "provision",
    bin_name = "cargo provision",
    disable_version_flag = true
)]
pub(crate) struct Options {
    /// Scenario file (TOML); without it the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    pub(crate) scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000; without it that of the scenario's plan or section `network`
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1, 1000))]
    pub(crate) uavs: Option<u16>,
    /// Which of them this drone is, 1 (next to the transmitter) to N
    #[arg(long, value_name = "I", required_unless_present = "all", value_parser = whole::<u16>(1, 1000))]
    pub(crate) index: Option<u16>,
    /// Number of the network, 0 to 65535; frames of any other are ignored. Without it that of the scenario's section `network`, or 1
    #[arg(long, value_name = "W", value_parser = whole(0, u16::MAX))]
    pub(crate) network: Option<u16>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1; without it that of the scenario's plan, or 1e-4
    #[arg(long, value_name = "T", value_parser = |text: &str| number(text, 1e-6, 0.1))]
    pub(crate) tolerance: Option<f64>,
    /// How the places are found; in a field, only by `align`. Without it that of the scenario's plan or section `network`, or `align`
    #[arg(long, value_name = "M", value_enum)]
    pub(crate) method: Option<Method>,
    /// Rounds of `adjust` at most, 1 to 65535; 500 without it
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1, u16::MAX))]
    pub(crate) rounds: Option<u16>,
    /// How far a relay may go up or down in one round of `adjust`, metres, 0 to 1e5; 10 without it
    #[arg(long = "explore", value_name = "M", value_parser = explore)]
    pub(crate) explore_m: Option<f32>,
    /// In a field: the relay measures it too, and believes this many samples at a place, 100 to 1000000
    #[arg(long, value_name = "S", value_parser = whole::<u32>(100, 1_000_000))]
    pub(crate) samples: Option<u32>,
    /// File with the network's key, 64 hexadecimal digits; without one, and without one in the scenario's section `network`, the frames of
    /// this relay are not signed
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,
    /// The least epoch to sign with, 1 to 4294967294, above any that a relay of this index has signed with by this key: it rises
    /// by itself from there. Without it the seconds of this machine's clock
    #[arg(long, value_name = "E", value_parser = whole::<u32>(1, 0xFFFF_FFFE))]
    pub(crate) epoch: Option<u32>,
    /// Bits per second on the radio channel that the relays share, 300 to 10000000; refused where that cannot carry them
    #[arg(long, value_name = "B", default_value_t = 115_200, value_parser = whole(300, MOST_BAUD))]
    pub(crate) baud: u32,
    /// Milliseconds of silence after which a relay asks a neighbour for a sign of life, 1 to 1200000; after three times as many that counts as
    /// lost. Without it those of the scenario's section `network`, or 5000. A slow channel carries more relays with more
    #[arg(long, value_name = "MS", value_parser = whole(1, MOST_PROBE_AFTER_MS))]
    pub(crate) probe_after_ms: Option<u32>,
    /// Relays that share the channel at one place, 1 to 1000; without it all of them
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1, 1000))]
    pub(crate) in_range: Option<u16>,
    /// The relays have a wire between neighbours and share no channel
    #[arg(long, conflicts_with_all = ["baud", "in_range"])]
    pub(crate) wires: bool,
    /// The drone's greatest speed, m/s, 0.1 to 20, where the scenario has sites; without it 5
    #[arg(long, value_name = "M/S", value_parser = speed)]
    pub(crate) speed: Option<f32>,
    /// File with the key that the drone's autopilot signs with, 64 hexadecimal digits, where the scenario has sites; without one what is
    /// said between the two is not signed
    #[arg(long, value_name = "FILE")]
    pub(crate) autopilot_key_file: Option<PathBuf>,
    /// Fly one interferer in place of several even where that loses more than 1 % of the best SIR
    #[arg(long)]
    pub(crate) stand_in: bool,
    /// File to write the block to
    #[arg(long, value_name = "FILE", required_unless_present = "all")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) folder: FolderOptions,
}

/// The blocks of all relays.
#[derive(Args, Debug)]
pub(crate) struct FolderOptions {
    /// The blocks of all relays, relay1.bin and so on, and summary.txt: all of them, or none
    #[arg(long, conflicts_with_all = ["index", "out"], requires = "out_dir")]
    pub(crate) all: bool,
    /// Folder to write the blocks of all relays to; made if it is not there
    #[arg(long, value_name = "DIR", requires = "all")]
    pub(crate) out_dir: Option<PathBuf>,
    /// Write over the blocks that are in that folder
    #[arg(long, requires = "all")]
    pub(crate) force: bool,
}

/// How the places are found.
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
