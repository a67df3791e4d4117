//! `cargo provision`: what is written into one drone before it flies, from a scenario.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::{Parser, ValueEnum};
use uav_relay::{Adjust, ChannelLoad, Local, Measure, Settings};
use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::{Interference, Scenario};
use uav_relay_sim::command::{self, Failure, MOST_BAUD};
use uav_relay_sim::simulator::medium::access::OVERHEAD;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::{ADDRESS, LEN, Secret};
use uav_relay_tools::provision::key;

/// Writes the configuration block of one relay: which one it is, and the mission it flies.
#[derive(Parser, Debug)]
#[command(
    name = "provision",
    bin_name = "cargo provision",
    disable_version_flag = true
)]
struct Options {
    /// Scenario file (TOML); without it the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    uavs: u16,
    /// Which of them this drone is, 1 (next to the transmitter) to N
    #[arg(long, value_name = "I", value_parser = clap::value_parser!(u16).range(1..=1000))]
    index: u16,
    /// Number of the network, 0 to 65535; frames of any other are ignored. Without it that of the scenario's section `network`, or 1
    #[arg(long, value_name = "W")]
    network: Option<u16>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1
    #[arg(long, value_name = "T", default_value_t = 1e-4)]
    tolerance: f64,
    /// How the places are found; in a field, only by `align`
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    method: Method,
    /// Rounds of `adjust` at most, 1 to 65535
    #[arg(long, value_name = "K", default_value_t = 500, value_parser = clap::value_parser!(u16).range(1..))]
    rounds: u16,
    /// How far a relay may go up or down in one round of `adjust`, metres, 0 to 1e5
    #[arg(long = "explore", value_name = "M", default_value_t = 10.0, value_parser = explore)]
    explore_m: f32,
    /// In a field: the relay measures it too, and believes this many samples at a place, 100 to 1000000
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    samples: Option<u32>,
    /// File with the network's key, 64 hexadecimal digits; without one, and without one in the scenario's section `network`, the frames of this
    /// relay are not signed
    #[arg(long, value_name = "FILE")]
    key_file: Option<PathBuf>,
    /// The least epoch to sign with, 1 to 4294967294, above any that a relay of this index has signed with by this key: it rises
    /// by itself from there. Without it the seconds of this machine's clock
    #[arg(long, value_name = "E", value_parser = clap::value_parser!(u32).range(1..=0xFFFF_FFFE))]
    epoch: Option<u32>,
    /// Bits per second on the radio channel that the relays share, 300 to 10000000; refused where that cannot carry them
    #[arg(long, value_name = "B", default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(300..=i64::from(MOST_BAUD)))]
    baud: u32,
    /// Relays that share the channel at one place, 1 to 1000; without it all of them
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..=1000))]
    in_range: Option<u16>,
    /// The relays have a wire between neighbours and share no channel
    #[arg(long, conflicts_with_all = ["baud", "in_range"])]
    wires: bool,
    /// The drone's greatest speed, m/s, 0.1 to 20, where the scenario has sites; without it 5
    #[arg(long, value_name = "M/S", value_parser = speed)]
    speed: Option<f32>,
    /// File with the key that the drone's autopilot signs with, 64 hexadecimal digits, where the scenario has sites; without one what is
    /// said between the two is not signed
    #[arg(long, value_name = "FILE")]
    autopilot_key_file: Option<PathBuf>,
    /// File to write the block to
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Method {
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

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => {
            let line = run(&options).map(|line| println!("{line}"));
            command::ended(line.map_err(Failure::input))
        }
        Err(error) => command::usage(&error),
    }
}

fn run(options: &Options) -> Result<String, String> {
    let Options { uavs, index, .. } = *options;
    if index > uavs {
        return Err(format!("--index {index}: must be within 1 to {uavs}"));
    }
    let (scenario, deployment) = match &options.scenario {
        Some(file) => Deployment::load(file).map_err(|error| error.to_string())?,
        None => Default::default(),
    };
    let network = options.network.or(deployment.network.id).unwrap_or(NETWORK);
    let name = options
        .scenario
        .as_ref()
        .map_or("default scenario".into(), |file| file.to_string_lossy());
    let method = match options.method {
        Method::Align => uav_relay::Method::Align,
        Method::Joint => uav_relay::Method::Joint,
        Method::Adjust => uav_relay::Method::Adjust(Adjust {
            rounds: options.rounds,
            explore_m: options.explore_m,
            local: Local::Fine,
        }),
    };
    let flight = Flight::new(&scenario, uavs, options.tolerance, network)
        .map_err(|error| format!("{name}: {error}"))?;
    carried(options)?;
    let flight = match options.speed {
        Some(_) if !flight.has_sites() => {
            return Err("--speed: is for a scenario with a [site]".to_owned());
        }
        Some(speed) => flight.no_faster_than(speed),
        None => flight,
    };
    let autopilot_key = match &options.autopilot_key_file {
        Some(_) if !flight.has_sites() => {
            return Err("--autopilot-key-file: is for a scenario with a [site]".to_owned());
        }
        Some(file) => Some(key::load("--autopilot-key-file", file)?),
        None => None,
    };
    let secret = secret(options, &deployment)?;
    let block = flight
        .by(method)
        .signed(secret)
        .signed_to_autopilots(autopilot_key)
        .measuring(measure(options, &scenario)?)
        .block(index)
        .map_err(|error| format!("{name}: {error}"))?;
    let file = &options.out;
    std::fs::write(file, block)
        .map_err(|error| format!("{}: --out cannot be written: {error}", file.display()))?;
    if secret.is_none() {
        eprintln!("no --key-file: frames are not signed, and anybody can send some");
    }
    Ok(format!(
        "{}: relay {index} of {uavs}, network {network}; {LEN} bytes for {ADDRESS:#010x}",
        file.display()
    ))
}

/// Refuses a channel that cannot carry the relays, by the timing that the firmware has.
fn carried(options: &Options) -> Result<(), String> {
    if options.wires {
        return Ok(());
    }
    let in_range = options.in_range.unwrap_or(options.uavs).min(options.uavs);
    let load = ChannelLoad {
        in_range,
        overhead: u16::try_from(OVERHEAD).unwrap_or(u16::MAX),
    };
    let Settings { probe_after, .. } = Settings::default();
    command::carries(options.baud, load, probe_after)
        .map_err(|error| format!("{error}; fewer with --in-range, none with --wires"))
}

fn secret(options: &Options, deployment: &Deployment) -> Result<Option<Secret>, String> {
    // A path in the file is relative to its folder.
    let folder = options.scenario.as_deref().and_then(Path::parent);
    let of_file = deployment.network.key_file.as_ref();
    let of_file = of_file.map(|file| folder.unwrap_or(Path::new("")).join(file));
    let Some(file) = options.key_file.clone().or(of_file) else {
        return match options.epoch {
            Some(epoch) => Err(format!(
                "--epoch {epoch}: is for frames that are signed, with --key-file"
            )),
            None => Ok(None),
        };
    };
    let seconds = || {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
        u32::try_from(since.as_secs()).ok()
    };
    let epoch = options.epoch.or_else(seconds);
    Ok(Some(Secret {
        key: key::load("--key-file", &file)?,
        epoch: epoch.ok_or("--epoch: is needed where the clock says no time")?,
    }))
}

fn measure(options: &Options, scenario: &Scenario) -> Result<Option<Measure>, String> {
    let Some(samples) = options.samples else {
        return Ok(None);
    };
    let Interference::Field(field) = &scenario.interference else {
        return Err(format!(
            "--samples {samples}: is for a scenario with a [field]"
        ));
    };
    #[expect(
        clippy::cast_possible_truncation,
        reason = "1e-30 to 1e6 by the scenario"
    )]
    let i_max_w = field.i_max_w as f32;
    Ok(Some(Measure { i_max_w, samples }))
}
