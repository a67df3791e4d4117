//! The command line, checked: what is wrong is one line with the option, its value and what it may be.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use uav_relay::channel::AirGround;
use uav_relay::mission::MissionError;
use uav_relay::serial::byte_time;
use uav_relay::wire::frame::MAX_FRAME;
use uav_relay::{
    Adjust, Band, Channel, Duration, Field, FieldPoint, Identity, Interference, Interferer,
    Mission, MissionConfig, Profile, Settings, Wiring,
};

use crate::key;

/// A frame's way through two kernels and two USB adapters, and the computing: an adapter alone may wait 16 ms.
const LATENCY: Duration = Duration::from_millis(40);

/// One relay of a chain, over ttys. Options of the mission must be the same for all relays; their defaults are the paper's
/// multi-hop scenario.
#[derive(Parser, Debug)]
#[command(name = "linux_companion", disable_version_flag = true)]
struct Options {
    /// Which relay this is: 1 is next to the transmitter
    #[arg(long, value_name = "I", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1000))]
    index: u16,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1000))]
    of: u16,
    /// Tty toward the transmitter; relay 1 needs none
    #[arg(long, value_name = "TTY")]
    upstream: Option<PathBuf>,
    /// Tty toward the receiver; relay N needs none
    #[arg(long, value_name = "TTY")]
    downstream: Option<PathBuf>,
    /// Tty to one channel that all relays hear, in place of the other two
    #[arg(long, value_name = "TTY")]
    shared: Option<PathBuf>,
    /// Bit/s on every tty, 1200 to 4000000
    #[arg(long, value_name = "B", default_value_t = 115_200, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1_200..=4_000_000))]
    baud: u32,
    /// Number of the network; frames of any other are ignored
    #[arg(long, value_name = "W", default_value_t = 7, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(0..))]
    network: u16,
    /// File with the network's key, 64 hexadecimal digits: frames carry a tag, and only frames with one count
    #[arg(long, value_name = "FILE", requires = "epoch_file")]
    key_file: Option<PathBuf>,
    /// File that keeps the number of this start, made if it is missing; it must never go back
    #[arg(long, value_name = "FILE", requires = "key_file")]
    epoch_file: Option<PathBuf>,
    /// Milliseconds of silence after which a neighbour is asked for a sign of life
    #[arg(long, value_name = "MS", default_value_t = 5_000, allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..=3_600_000))]
    quiet_ms: u64,
    /// Milliseconds of silence after which it counts as lost, above those of --quiet-ms
    #[arg(long, value_name = "MS", default_value_t = 15_000, allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..=3_600_000))]
    lost_ms: u64,
    /// Distance from transmitter to receiver, m, 1 to 1e6
    #[arg(long, value_name = "M", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = |text: &str| number(text, 1.0, 1e6))]
    distance: f32,
    /// Altitude of every relay, m, 0.1 to 1e5
    #[arg(long, value_name = "M", default_value_t = 20.0, allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.1, 1e5))]
    altitude: f32,
    /// Altitudes to choose from, m, 0.1 to 1e5, --altitude among them; without it that alone
    #[arg(long, value_name = "LEAST,MOST", allow_hyphen_values = true, value_parser = band)]
    band: Option<Band>,
    /// How the places are found; with --field, only by `align`. What counts is what the first relay is given, with --field the
    /// last one
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    method: Method,
    /// Power of the transmitter, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", default_value_t = 80.0, allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-6, 1e6))]
    tx_power: f32,
    /// Power of every relay, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", default_value_t = 1.0, allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-6, 1e6))]
    uav_power: f32,
    /// Interferer: power (W, 1e-6 to 1e9), place along and beside the line to the receiver (m, -1e7 to 1e7)
    #[arg(long, value_name = "P,X,Y", default_value = "80,500,400", allow_hyphen_values = true, value_parser = interferer)]
    interferer: Interferer,
    /// In place of --interferer, a field: Upsilon = E[1/interference power] (1/W, 1e-9 to 1e32) along the line to the receiver
    /// (m, -1e7 to 1e7), X rising
    #[arg(long, value_name = "X:UPSILON,X:UPSILON,..", conflicts_with = "interferer", allow_hyphen_values = true, value_parser = field)]
    field: Option<Field>,
    /// Least distance between two relays, m, 0 to 1e5
    #[arg(long, value_name = "M", default_value_t = 4.0, allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.0, 1e5))]
    min_separation: f32,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Method {
    /// Algorithm 1, in a field Algorithm 4
    Align,
    /// Joint distance and altitude
    Altitude,
    /// Algorithm 1, then Algorithm 2
    Adjust,
}

/// The ttys of either wiring, each with its option's name; none where there is no neighbour.
#[derive(Debug)]
pub(crate) enum Ttys {
    Pair {
        upstream: Option<PathBuf>,
        downstream: Option<PathBuf>,
    },
    Shared(PathBuf),
}

/// What to run.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) mission: Mission,
    pub(crate) identity: Identity,
    pub(crate) settings: Settings,
    pub(crate) secret: Option<Secret>,
    pub(crate) ttys: Ttys,
    pub(crate) baud: u32,
}

/// What frames are signed with.
pub(crate) struct Secret {
    pub(crate) key: [u8; 32],
    pub(crate) epoch_file: PathBuf,
}

impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Reads the command line; where there is nothing to run, help or the mistake has been printed.
pub(crate) fn read() -> Result<Plan, ExitCode> {
    let options = Options::try_parse().map_err(|error| {
        if !error.use_stderr() {
            // Help. Nobody is left to be told that it cannot be printed.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        // The mistake is the first paragraph; usage and tips follow.
        let text = error.to_string();
        let wrong: Vec<&str> = text
            .lines()
            .take_while(|line| !line.trim().is_empty())
            .map(str::trim)
            .collect();
        refuse(wrong.join(" ").trim_start_matches("error: "))
    })?;
    plan(&options).map_err(|line| refuse(&line))
}

fn refuse(line: &str) -> ExitCode {
    eprintln!("{line}");
    ExitCode::from(2)
}

fn plan(options: &Options) -> Result<Plan, String> {
    let Options { index, of, .. } = *options;
    if index > of {
        return Err(format!(
            "--index {index}: must be within 1 to {of}, the number given by --of"
        ));
    }
    if options.lost_ms <= options.quiet_ms {
        return Err(format!(
            "--lost-ms {}: must be within {} to 3600000, above --quiet-ms",
            options.lost_ms,
            options.quiet_ms + 1
        ));
    }
    if options.field.is_some() && options.method != Method::Align {
        let method = options.method.to_possible_value();
        return Err(format!(
            "--method {}: must be align with --field",
            method.as_ref().map_or("", |method| method.get_name())
        ));
    }
    let ttys = ttys(options)?;
    let frame = u32::try_from(MAX_FRAME).unwrap_or(u32::MAX);
    let settings = Settings {
        method: match options.method {
            Method::Align => uav_relay::Method::Align,
            Method::Altitude => uav_relay::Method::Altitude,
            Method::Adjust => uav_relay::Method::Adjust(Adjust::default()),
        },
        wiring: match ttys {
            Ttys::Pair { .. } => Wiring::Pair,
            Ttys::Shared(_) => Wiring::Shared,
        },
        hop_time: Duration::from_micros(
            byte_time(options.baud).times(frame).as_micros() + LATENCY.as_micros(),
        ),
        quiet: Duration::from_millis(options.quiet_ms),
        lost: Duration::from_millis(options.lost_ms),
        ..Settings::default()
    };
    Ok(Plan {
        mission: mission(options)?,
        identity: Identity {
            network: options.network,
            index,
        },
        settings,
        secret: secret(options)?,
        ttys,
        baud: options.baud,
    })
}

fn secret(options: &Options) -> Result<Option<Secret>, String> {
    let (Some(key_file), Some(epoch_file)) = (&options.key_file, &options.epoch_file) else {
        return Ok(None);
    };
    Ok(Some(Secret {
        key: key::load(key_file)?,
        epoch_file: epoch_file.clone(),
    }))
}

fn ttys(options: &Options) -> Result<Ttys, String> {
    let Options { index, of, .. } = *options;
    let (upstream, downstream) = (options.upstream.clone(), options.downstream.clone());
    let neither = upstream.is_none() && downstream.is_none();
    match &options.shared {
        Some(tty) if neither => return Ok(Ttys::Shared(tty.clone())),
        Some(tty) => {
            return Err(format!(
                "--shared {}: is the only tty, without --upstream and --downstream",
                tty.display()
            ));
        }
        None => {}
    }
    if index > 1 && upstream.is_none() {
        return Err(format!(
            "--upstream: is missing, a tty toward relay {} (or give --shared)",
            index - 1
        ));
    }
    if index < of && downstream.is_none() {
        return Err(format!(
            "--downstream: is missing, a tty toward relay {} (or give --shared)",
            index + 1
        ));
    }
    Ok(Ttys::Pair {
        upstream,
        downstream,
    })
}

fn mission(options: &Options) -> Result<Mission, String> {
    // 2 GHz, excess losses of 0.1 dB with line of sight and 21 dB without: as the simulator has them, to the bit.
    let channel =
        Channel::from_db(2e9, 0.1, 21.0, AirGround::Los).map_err(|error| error.to_string())?;
    let config = MissionConfig {
        relays: options.of,
        distance_m: options.distance,
        min_separation_m: options.min_separation,
        tx_power_w: options.tx_power,
        common: Profile {
            altitude_m: options.altitude,
            power_w: options.uav_power,
        },
        channel,
        band: options.band.unwrap_or(Band::at(options.altitude)),
        interference: options.field.map_or(
            Interference::Source(options.interferer),
            Interference::Field,
        ),
        tolerance: 1e-4,
    };
    Mission::try_new(config).map_err(|error| match error {
        MissionError::TooManyForDistance => format!(
            "--min-separation {}: must be at most --distance {} / (--of {} - 1)",
            options.min_separation, options.distance, options.of
        ),
        MissionError::Band => {
            let Band { least_m, most_m } = config.band;
            format!(
                "--band {least_m},{most_m}: must be from LEAST to MOST, with --altitude {} among them",
                options.altitude
            )
        }
        other => other.to_string(),
    })
}

fn number(text: &str, least: f32, most: f32) -> Result<f32, String> {
    let value = text.trim().parse().ok();
    value
        .filter(|value| (least..=most).contains(value))
        .ok_or_else(|| format!("must be a number within {least:?} to {most:?}"))
}

/// One of several numbers.
fn named(name: &str, text: &str, least: f32, most: f32) -> Result<f32, String> {
    number(text, least, most).map_err(|error| format!("{name} {error}"))
}

fn interferer(text: &str) -> Result<Interferer, String> {
    let [power, x, y] = text.split(',').collect::<Vec<_>>()[..] else {
        return Err("must be three numbers: P,X,Y".to_owned());
    };
    Ok(Interferer {
        power_w: named("P", power, 1e-6, 1e9)?,
        x_m: named("X", x, -1e7, 1e7)?,
        y_m: named("Y", y, -1e7, 1e7)?,
    })
}

fn band(text: &str) -> Result<Band, String> {
    let (least, most) = text
        .split_once(',')
        .ok_or("must be two numbers: LEAST,MOST")?;
    Ok(Band {
        least_m: named("LEAST", least, 0.1, 1e5)?,
        most_m: named("MOST", most, 0.1, 1e5)?,
    })
}

/// The mission wants its field for as long as the program runs.
fn field(text: &str) -> Result<Field, String> {
    let point = |text: &str| {
        let (x, upsilon) = text
            .split_once(':')
            .ok_or("must be points: X:UPSILON,X:UPSILON,..")?;
        Ok(FieldPoint {
            x_m: named("X", x, -1e7, 1e7)?,
            upsilon_per_w: named("UPSILON", upsilon, 1e-9, 1e32)?,
        })
    };
    let points: Result<Vec<FieldPoint>, String> = text.split(',').map(point).collect();
    Field::try_new(points?.leak()).map_err(|error| error.to_string())
}
