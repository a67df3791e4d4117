//! The command line, checked.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use uav_relay::flight::axis::Axis;
use uav_relay::wire::upload::UploadError;
use uav_relay::{
    Band, Duration, Geodetic, Interference, Interferer, Mission, MissionConfig, Profile, Side,
    Sites, Upload, Wiring,
};
use uav_relay_scenario::deployment::{Deployment, NETWORK};

use uav_relay_linux::command;
use uav_relay_linux::config::{self, Beyond, Given};
use uav_relay_linux::log::LogOptions;
use uav_relay_linux::mission::{
    MissionOptions, altitude, band, distance, interferer, left, mission, noise, power, right,
    separation,
};
use uav_relay_linux::site::{SiteOptions, site};
use uav_relay_scenario::key;

/// Uploads a new mission to a chain of relays in flight. The options up to --min-separation say what the relays were loaded with; those
/// that begin with --new- what is different from now on, and without any of them it is what they were loaded with. The number of
/// relays stays.
#[derive(Parser, Debug)]
#[command(name = "linux_ground", disable_version_flag = true)]
struct Options {
    /// TOML file with the scenario that the relays were loaded with, and sections `network` and `ground`: what it says, options of the
    /// command line say otherwise
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Tty toward the relay next to this end of the chain
    #[arg(long, value_name = "TTY")]
    tty: PathBuf,
    /// The tty leads to one channel that all relays hear, in place of a wire
    #[arg(long)]
    shared: bool,
    /// Which end of the chain this is
    #[arg(long, value_name = "END", value_enum)]
    end: End,
    /// Bit/s on the tty, 1200 to 4000000
    #[arg(long, value_name = "B", default_value_t = 115_200, allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u32>(text, 1_200, 4_000_000))]
    baud: u32,
    /// Number of the network
    #[arg(long, value_name = "W", default_value_t = NETWORK, allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u16>(text, 0, 65_535))]
    network: u16,
    /// File with the network's key, 64 hexadecimal digits
    #[arg(long, value_name = "FILE")]
    key_file: PathBuf,
    /// File that keeps the number of this start, made if it is missing; it must never go back, and is no relay's
    #[arg(long, value_name = "FILE")]
    epoch_file: PathBuf,
    /// Version of the new mission, 1 to 65535: larger than that of every upload before
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u16>(text, 1, 65_535))]
    version: u16,
    /// Seconds after which it gives up, 1 to 86400
    #[arg(long, value_name = "S", default_value_t = 300, allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u64>(text, 1, 86_400))]
    timeout: u64,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u16>(text, 1, 1000))]
    of: u16,
    #[command(flatten)]
    loaded: MissionOptions,
    #[command(flatten)]
    sites: SiteOptions,
    /// Where the transmitter is from now on; then the distance follows. Without it and --new-site-rx, relays fly between the sites that they
    /// were loaded with
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_tx", allow_hyphen_values = true, value_parser = site)]
    new_site_tx: Option<Geodetic>,
    /// Where the receiver is from now on
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_tx", allow_hyphen_values = true, value_parser = site)]
    new_site_rx: Option<Geodetic>,
    /// New distance from transmitter to receiver, m, 1 to 1e6
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = distance)]
    new_distance: Option<f32>,
    /// New altitude of every relay, m, 0.1 to 1e5
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = altitude)]
    new_altitude: Option<f32>,
    /// New altitudes to choose from, m, 0.1 to 1e5; without it those of --band, or the new altitude alone
    #[arg(long, value_name = "LEAST,MOST", allow_hyphen_values = true, value_parser = band)]
    new_band: Option<Band>,
    /// New room to the left of the line to the receiver, as y in m, -1e5 to 0
    #[arg(long = "new-lateral-min-m", value_name = "M", allow_negative_numbers = true, value_parser = left)]
    new_lateral_min: Option<f32>,
    /// New room to its right, as y in m, 0 to 1e5
    #[arg(long = "new-lateral-max-m", value_name = "M", allow_negative_numbers = true, value_parser = right)]
    new_lateral_max: Option<f32>,
    /// New power of the transmitter, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = power)]
    new_tx_power: Option<f32>,
    /// New power of every relay, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = power)]
    new_uav_power: Option<f32>,
    /// New interferer: power (W, 1e-6 to 1e9), place along the line to the receiver and to the right of it (m, -1e7 to 1e7)
    #[arg(long, value_name = "P,X,Y", allow_hyphen_values = true, value_parser = interferer)]
    new_interferer: Option<Interferer>,
    /// New noise power at every receiver, W, 0 to 1
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = noise)]
    new_noise: Option<f32>,
    /// New least distance between two relays, m, 0 to 1e5
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = separation)]
    new_min_separation: Option<f32>,
    #[command(flatten)]
    log: LogOptions,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum End {
    /// The transmitter, before relay 1
    Tx,
    /// The receiver, behind relay N
    Rx,
}

/// What to upload, and where.
pub(crate) struct Plan {
    pub(crate) tty: PathBuf,
    pub(crate) baud: u32,
    pub(crate) loaded: Mission,
    pub(crate) upload: Upload,
    pub(crate) end: Side,
    pub(crate) wiring: Wiring,
    pub(crate) network: u16,
    pub(crate) key: [u8; 32],
    pub(crate) epoch_file: PathBuf,
    pub(crate) timeout: Duration,
    pub(crate) log: LogOptions,
}

/// Reads the command line; where there is nothing to run, help or the mistake has been printed.
pub(crate) fn read() -> Result<Plan, ExitCode> {
    let (options, beyond) = command::read(section)?;
    plan(options, &beyond).map_err(|line| command::refuse(&line))
}

/// What a file says to the ground.
fn section(deployment: &Deployment, given: &mut Given) {
    config::network(deployment, given);
    let own = &deployment.ground;
    given.path("--tty", own.tty.as_ref());
    given.flag("--shared", own.shared);
    given.value("--end", own.end.as_ref());
    given.path("--epoch-file", own.epoch_file.as_ref());
    given.value("--timeout", own.timeout_s);
    given.flag("--json", own.json);
    given.path("--log-file", own.log_file.as_ref());
}

fn plan(options: Options, beyond: &Beyond) -> Result<Plan, String> {
    let interference = options.loaded.interference(beyond.field);
    let base = options
        .loaded
        .config(options.of, interference, beyond.channel)?;
    let loaded = mission(base, "--")?;
    let sited = options.sites.of(options.loaded.distance)?;
    let (sites, along_m) = match moved(&options, sited)? {
        Some((sites, along_m)) => (Some(sites), Some(along_m)),
        None => (None, None),
    };
    let config = changed(&options, loaded.config(), along_m);
    let keeps = sited.is_some() && sites.is_none();
    if keeps && config.distance_m.to_bits() != loaded.config().distance_m.to_bits() {
        return Err(format!(
            "--new-distance {}: must be that of --distance where the relays keep their sites; else give --new-site-tx or --new-site-rx",
            config.distance_m
        ));
    }
    mission(config, "--new-")?;
    let refused = |error: UploadError| error.to_string();
    let mut upload = Upload::new(&loaded, options.version, config).map_err(refused)?;
    if let Some(sites) = sites {
        upload = upload.with_sites(sites).map_err(refused)?;
    }
    Ok(Plan {
        loaded,
        upload,
        end: match options.end {
            End::Tx => Side::Upstream,
            End::Rx => Side::Downstream,
        },
        wiring: if options.shared {
            Wiring::Shared
        } else {
            Wiring::Pair
        },
        network: options.network,
        key: key::load("--key-file", &options.key_file)?,
        timeout: Duration::from_millis(1_000 * options.timeout),
        baud: options.baud,
        tty: options.tty,
        epoch_file: options.epoch_file,
        log: options.log,
    })
}

/// Between which sites the mission is flown from now on, and how far apart they are, m, where one has moved.
fn moved(options: &Options, loaded: Option<Sites>) -> Result<Option<(Sites, f32)>, String> {
    let (tx, rx) = (options.new_site_tx, options.new_site_rx);
    let Some(loaded) = loaded.filter(|_| tx.is_some() || rx.is_some()) else {
        return Ok(None);
    };
    let sites = Sites {
        tx: tx.unwrap_or(loaded.tx),
        rx: rx.unwrap_or(loaded.rx),
    };
    let name = if rx.is_some() { "rx" } else { "tx" };
    let axis = Axis::between(sites).map_err(|error| format!("--new-site-{name}: {error}"))?;
    #[expect(clippy::cast_possible_truncation, reason = "as a mission has it")]
    let along_m = axis.distance_m() as f32;
    match options.new_distance {
        Some(given) if !axis.is_of(given) => Err(format!(
            "--new-distance {given}: must be {along_m:.3} m, as the new sites have it, or be left out"
        )),
        _ => Ok(Some((sites, along_m))),
    }
}

fn changed(options: &Options, loaded: &MissionConfig, along_m: Option<f32>) -> MissionConfig {
    let altitude_m = options.new_altitude.unwrap_or(loaded.common.altitude_m);
    let alone = Band::at(altitude_m);
    MissionConfig {
        distance_m: options
            .new_distance
            .or(along_m)
            .unwrap_or(loaded.distance_m),
        min_separation_m: options
            .new_min_separation
            .unwrap_or(loaded.min_separation_m),
        tx_power_w: options.new_tx_power.unwrap_or(loaded.tx_power_w),
        common: Profile {
            altitude_m,
            power_w: options.new_uav_power.unwrap_or(loaded.common.power_w),
        },
        band: options.new_band.or(options.loaded.band).unwrap_or(alone),
        lateral: Band {
            least_m: options.new_lateral_min.unwrap_or(loaded.lateral.least_m),
            most_m: options.new_lateral_max.unwrap_or(loaded.lateral.most_m),
        },
        interference: options
            .new_interferer
            .map_or(loaded.interference, Interference::Source),
        noise_w: options.new_noise.unwrap_or(loaded.noise_w),
        ..*loaded
    }
}
