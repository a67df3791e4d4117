//! Checked command line.

use std::io::{IsTerminal as _, Write as _};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgAction, ArgGroup, CommandFactory as _, Parser, ValueEnum};
use uav_relay::UploadError;
use uav_relay::{Duration, Side, Sites, Wiring};
use uav_relay_linux::command::{self, whole};
use uav_relay_linux::config::{self, FileOnlySettings, FileOptions, Override};
use uav_relay_linux::log::LogOptions;
use uav_relay_linux::mission::{Method, MissionOptions, mission};
use uav_relay_linux::site::SiteOptions;
use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::{TerrainSpec, key};

use crate::forecast::Loaded;
use crate::new::NewOptions;

/// Transmitter or receiver end of a chain of relays in flight. Uploads a new mission, or keeps answering the relays (--stand). The
/// options up to --min-separation describe the mission loaded into the relays; those that begin with --new- change it. All other
/// values stay as the chain flies them: the chain is asked first. The changes, and the distance that each relay moves, are shown
/// and must be confirmed before the upload. The number of relays cannot change
#[derive(Parser, Debug)]
#[command(name = "linux_ground", version, disable_version_flag = true)]
#[command(group = ArgGroup::new("task").args(["version", "stand", "check"]).required(true).multiple(true))]
#[expect(clippy::struct_excessive_bools, reason = "one for each option")]
pub(crate) struct Options {
    /// TOML file with the loaded scenario, and the sections `network` and `ground`. Options of the command line override it
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Tty toward the relay next to this end of the chain
    #[arg(long, value_name = "TTY")]
    pub(crate) tty: PathBuf,
    /// The tty leads to a radio channel shared by all relays, not to a wire
    #[arg(long)]
    shared: bool,
    /// End of the chain
    #[arg(long, value_name = "END", value_enum)]
    end: End,
    /// Bit rate of the tty, bit/s, 1200 to 4000000
    #[arg(long, value_name = "B", default_value_t = 115_200, allow_negative_numbers = true, value_parser = whole::<u32>(1_200, 4_000_000))]
    pub(crate) baud: u32,
    /// Network number, 0 to 65535; frames of other networks are ignored
    #[arg(long, value_name = "W", default_value_t = NETWORK, allow_negative_numbers = true, value_parser = whole::<u16>(0, 65_535))]
    pub(crate) network: u16,
    /// File with the network's key, 64 hexadecimal digits
    #[arg(long, value_name = "FILE")]
    key_file: PathBuf,
    /// File with the epoch, increased at every start; created if missing. It must never go back, and must not be shared with a
    /// relay
    #[arg(long, value_name = "FILE")]
    pub(crate) epoch_file: PathBuf,
    /// Upload the new mission as this version, 1 to 65535: larger than that of every earlier upload. As the last word, without V,
    /// it prints the program's version
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = whole::<u16>(1, 65_535))]
    pub(crate) version: Option<u16>,
    /// Print the version of the program
    #[arg(short = 'V', action = ArgAction::Version)]
    own_version: Option<bool>,
    /// Time after which an unfinished upload is given up, s, 1 to 86400. With --stand the failure is logged and the program goes on
    #[arg(long, value_name = "S", default_value_t = 300, allow_negative_numbers = true, value_parser = whole::<u64>(1, 86_400))]
    pub(crate) timeout: u64,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole::<u16>(1, 1000))]
    of: u16,
    /// Number of relays that are meant to fly, more than half of --of, at most all. The page shows it beside the number of relays in
    /// the chain, and warns after 30 s with fewer relays. By default all relays of the chain count, and there is no warning
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole::<u16>(1, 1000))]
    pub(crate) flying: Option<u16>,
    #[command(flatten)]
    loaded: MissionOptions,
    #[command(flatten)]
    sites: SiteOptions,
    /// Method by which the relays find positions, as given to the first relay. It is only used to compute their moves in advance
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    method: Method,
    #[command(flatten)]
    pub(crate) new: NewOptions,
    /// Show the changes and exit; nothing is uploaded
    #[arg(long, requires = "version", conflicts_with = "stand")]
    pub(crate) dry_run: bool,
    /// Upload without confirmation; required if standard input is no terminal
    #[arg(long, requires = "version")]
    pub(crate) yes: bool,
    /// Upload missions outside the geofence, too, for relays without a drone, which have no geofence. The geofence is that of
    /// --altitude, --band, --lateral-min-m, --lateral-max-m and --distance; relays that fly a drone refuse such a mission
    #[arg(long, requires = "version")]
    pub(crate) no_fence: bool,
    /// Take values without an option from the mission loaded before flight, not from that in flight
    #[arg(long, requires = "version")]
    pub(crate) from_loaded: bool,
    /// Source of interference measurements at this end. A FIFO, a file whose last line counts, or a UDP port, `udp:PORT` or
    /// `udp:HOST:PORT`. Each line is the mean received power, W, 1e-30 to 1e6, or dBm with that unit, as -95 dBm. It is reported to
    /// nearby relays that --listen
    #[arg(
        long,
        value_name = "FIFO|FILE|udp:[HOST:]PORT",
        requires = "stand",
        help_heading = "Standing"
    )]
    pub(crate) measurements: Option<String>,
    /// Keep running until a signal: answer the relays, report measurements, and log which relays answer. With --version upload
    /// the new mission first
    #[arg(long, help_heading = "Standing")]
    pub(crate) stand: bool,
    /// Check the chain before flight, for at most S seconds, 1 to 3600; 60 by default. Prints a table of the relays, and exits with status
    /// 0 if all are green. The relays' programs must be running
    #[arg(long, value_name = "S", num_args = 0..=1, default_missing_value = "60", require_equals = true, conflicts_with_all = ["stand", "version"], value_parser = whole::<u64>(1, 3_600))]
    pub(crate) check: Option<u64>,
    /// Show the chain in a browser, with alarms, a log and a form for uploads. Use 127.0.0.1:8080 for this computer alone; port 0 takes
    /// any free port. Another address needs --web-password
    #[arg(long, value_name = "ADDRESS:PORT", requires = "stand", value_parser = address, help_heading = "Standing")]
    pub(crate) web: Option<SocketAddr>,
    /// File with the password of the page, 8 to 200 characters. The browser asks for it; any user name will do
    #[arg(long, value_name = "FILE", requires = "web", help_heading = "Standing")]
    web_password: Option<PathBuf>,
    /// PMTiles archive with pictures (PNG, JPEG or WebP) of a map, which the page shows below the chain. The mission needs sites
    #[arg(long, value_name = "FILE", requires = "web", help_heading = "Standing")]
    pub(crate) tiles: Option<PathBuf>,
    /// Unix socket that answers each connection with one JSON object of all counters, and closes it
    #[arg(long, value_name = "SOCKET", help_heading = "Log")]
    pub(crate) status_socket: Option<PathBuf>,
    /// Write every frame of the tty to a pcapng capture, for `cargo decode` and Wireshark. If FILE exists, FILE-2, FILE-3 and so
    /// on is written instead. It grows as long as the program runs
    #[arg(long, value_name = "FILE", help_heading = "Log")]
    pub(crate) capture: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) log: LogOptions,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum End {
    /// Transmitter, before relay 1
    Tx,
    /// Receiver, behind relay N
    Rx,
}

pub(crate) struct Plan {
    pub(crate) options: Options,
    pub(crate) loaded: Loaded,
    pub(crate) sited: Option<Sites>,
    pub(crate) end: Side,
    pub(crate) key: [u8; 32],
    pub(crate) web_password: Option<String>,
    pub(crate) overrides: Vec<Override>,
    /// Elevation model of the configuration file.
    pub(crate) terrain: Option<TerrainSpec>,
}

impl Plan {
    /// Returns the maximum duration of an upload, after which it has failed.
    pub(crate) const fn timeout(&self) -> Duration {
        Duration::from_millis(1_000 * self.options.timeout)
    }

    pub(crate) const fn wiring(&self) -> Wiring {
        if self.options.shared {
            Wiring::Shared
        } else {
            Wiring::Pair
        }
    }
}

/// Reads and checks the command line. The error is the exit status after the help text or an error line.
pub(crate) fn read() -> Result<Plan, ExitCode> {
    if std::env::args_os()
        .next_back()
        .is_some_and(|word| word == "--version")
    {
        // A closed standard output is ignored.
        let _ = write!(std::io::stdout(), "{}", Options::command().render_version());
        return Err(ExitCode::SUCCESS);
    }
    let (options, beyond) = command::read(section)?;
    plan(options, beyond).map_err(|line| command::refuse(&line))
}

/// Adds the options that the file's sections `[network]` and `[ground]` give.
fn section(deployment: &Deployment, given: &mut FileOptions) {
    config::network(deployment, given);
    let own = &deployment.ground;
    given.value("--flying", deployment.fleet.flying);
    given.path("--tty", own.tty.as_ref());
    given.flag("--shared", own.shared);
    given.value("--end", own.end.as_ref());
    given.path("--epoch-file", own.epoch_file.as_ref());
    given.value("--timeout", own.timeout_s);
    given.flag("--stand", own.stand);
    given.path_or_udp("--measurements", own.measurements.as_ref());
    given.value("--web", own.web.as_ref());
    given.path("--web-password", own.web_password.as_ref());
    given.path("--tiles", own.tiles.as_ref());
    given.flag("--json", own.json);
    given.path("--log-file", own.log_file.as_ref());
    given.path("--status-socket", own.status_socket.as_ref());
    given.path("--capture", own.capture.as_ref());
}

fn address(text: &str) -> Result<SocketAddr, String> {
    uav_relay_screen::address(text).map_err(|error| error.to_string())
}

fn plan(options: Options, file_only: FileOnlySettings) -> Result<Plan, String> {
    config::check_flying(options.flying, options.of)?;
    let interference = options.loaded.interference(file_only.field);
    let base = options
        .loaded
        .config(options.of, interference, file_only.channel)?;
    let loaded = mission(base, "--")?;
    let sited = options.sites.of(options.loaded.distance)?;
    let key = key::load("--key-file", &options.key_file)?;
    if let Some(version) = options.version {
        if loaded.field().is_some() {
            return Err(UploadError::Field.to_string());
        }
        if !options.yes && !options.dry_run && !std::io::stdin().is_terminal() {
            return Err(format!(
                "--version {version}: standard input is not a terminal, so nobody can confirm the upload: give --yes to upload without a question, or --dry-run to see the changes only"
            ));
        }
    }
    let password = options.web_password.as_deref();
    let password = password.map(|file| key::load_password("--web-password", file));
    let password = password.transpose()?;
    let address = options
        .web
        .filter(|it| !it.ip().to_canonical().is_loopback());
    if let (Some(address), None) = (address, &password) {
        return Err(format!(
            "--web {address}: other computers can reach this address, so it needs --web-password FILE; 127.0.0.1:{} is reached by this computer alone",
            address.port()
        ));
    }
    Ok(Plan {
        web_password: password,
        loaded: Loaded {
            mission: loaded,
            method: options.method.into(),
            profiles: file_only.profiles,
            held: file_only.held,
        },
        sited,
        end: match options.end {
            End::Tx => Side::Upstream,
            End::Rx => Side::Downstream,
        },
        key,
        overrides: file_only.overrides,
        terrain: file_only.terrain,
        options,
    })
}
