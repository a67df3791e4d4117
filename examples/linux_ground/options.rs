//! The command line, checked.

use std::io::{IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgAction, CommandFactory as _, Parser, ValueEnum};
use uav_relay::UploadError;
use uav_relay::{Adjust, Duration, Mission, Side, Sites, Upload, Wiring};
use uav_relay_linux::command;
use uav_relay_linux::config::{self, Beyond, Given, Override};
use uav_relay_linux::log::LogOptions;
use uav_relay_linux::mission::{MissionOptions, mission};
use uav_relay_linux::site::SiteOptions;
use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::key;

use crate::forecast::Loaded;
use crate::new::{Basis, NewOptions};

/// The transmitter or the receiver of a chain of relays in flight: uploads a new mission to it, or stays at its post (--stand). The options up to --min-separation say what the relays were loaded with; those
/// that begin with --new- what is different from now on. Values that none of them states stay as the chain flies them: the chain is asked first. Every change is shown, and how far
/// each relay moves, and nothing is uploaded before it is confirmed. The number of relays stays.
#[derive(Parser, Debug)]
#[command(name = "linux_ground", version, disable_version_flag = true)]
#[expect(clippy::struct_excessive_bools, reason = "one for each option")]
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
    /// Version of the new mission, 1 to 65535: larger than that of every upload before. Without V, as the last word, that of the program
    #[arg(long, value_name = "V", required_unless_present = "stand", allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u16>(text, 1, 65_535))]
    version: Option<u16>,
    /// Prints the version of the program
    #[arg(short = 'V', action = ArgAction::Version)]
    own_version: Option<bool>,
    /// Seconds after which it gives an upload up, 1 to 86400; with --stand it says so and goes on
    #[arg(long, value_name = "S", default_value_t = 300, allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u64>(text, 1, 86_400))]
    timeout: u64,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = |text: &str| command::whole::<u16>(text, 1, 1000))]
    of: u16,
    #[command(flatten)]
    loaded: MissionOptions,
    #[command(flatten)]
    sites: SiteOptions,
    /// How the relays find their positions, for the moves that are shown: as the first relay was given it
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    method: Method,
    #[command(flatten)]
    new: NewOptions,
    /// Ends after it has shown what the upload changes; nothing is uploaded
    #[arg(long, requires = "version", conflicts_with = "stand")]
    dry_run: bool,
    /// Uploads without asking; needed where standard input is no terminal
    #[arg(long, requires = "version")]
    yes: bool,
    /// Uploads also what leaves the geofence of --altitude, --band, --lateral-min-m, --lateral-max-m and --distance: for relays without a drone,
    /// which have no geofence. Relays that fly one refuse it
    #[arg(long, requires = "version")]
    no_fence: bool,
    /// Takes values that are not stated from what the relays were loaded with, and not from what they fly
    #[arg(long, requires = "version")]
    from_loaded: bool,
    /// How strong the interference is here, line by line: a FIFO, a file whose last line counts, or `udp:PORT` or `udp:HOST:PORT` to be
    /// told there. A line is the mean power that is received here, W, 1e-30 to 1e6, or dBm with that unit behind it, as -95 dBm. The relays near by are told of it, those that --listen
    #[arg(
        long,
        value_name = "FIFO|FILE|udp:[HOST:]PORT",
        requires = "stand",
        help_heading = "Standing"
    )]
    measurements: Option<String>,
    /// Stays at its post until a signal ends it: it answers the relays, tells them what is measured here, and says what it hears. With --version
    /// it uploads that mission first
    #[arg(long, help_heading = "Standing")]
    stand: bool,
    /// Unix socket that answers each connection with one JSON object of all counters, and closes it
    #[arg(long, value_name = "SOCKET", help_heading = "Log")]
    status_socket: Option<PathBuf>,
    /// Write every frame that comes or goes at the tty to a pcapng capture, for `cargo decode` and Wireshark. Where FILE exists it is kept, and
    /// FILE-2, FILE-3 and so on is written. It grows as long as the program runs
    #[arg(long, value_name = "FILE", help_heading = "Log")]
    capture: Option<PathBuf>,
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

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Method {
    Align,
    Joint,
    Adjust,
}

/// An upload, as far as the command line states it.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "one for each option")]
pub(crate) struct Change {
    pub(crate) version: u16,
    new: NewOptions,
    pub(crate) sited: Option<Sites>,
    pub(crate) dry_run: bool,
    /// True if nobody has to confirm it.
    pub(crate) yes: bool,
    pub(crate) no_fence: bool,
    pub(crate) from_loaded: bool,
}

impl Change {
    /// Returns the upload in place of `basis`.
    ///
    /// # Errors
    /// One line that names the option and what is wrong.
    pub(crate) fn upload(&self, loaded: &Mission, basis: &Basis) -> Result<Upload, String> {
        self.new.upload(self.version, loaded, self.sited, basis)
    }
}

/// What to upload, and where.
pub(crate) struct Plan {
    pub(crate) tty: PathBuf,
    pub(crate) baud: u32,
    pub(crate) loaded: Loaded,
    pub(crate) change: Option<Change>,
    pub(crate) stands: bool,
    pub(crate) measurements: Option<String>,
    pub(crate) end: Side,
    pub(crate) wiring: Wiring,
    pub(crate) network: u16,
    pub(crate) key: [u8; 32],
    pub(crate) epoch_file: PathBuf,
    pub(crate) timeout: Duration,
    pub(crate) status_socket: Option<PathBuf>,
    pub(crate) capture: Option<PathBuf>,
    pub(crate) log: LogOptions,
    pub(crate) overrides: Vec<Override>,
}

/// Reads the command line; where there is nothing to run, help or the mistake has been printed.
pub(crate) fn read() -> Result<Plan, ExitCode> {
    if std::env::args_os()
        .next_back()
        .is_some_and(|word| word == "--version")
    {
        // Nobody may be left to read it.
        let _ = write!(std::io::stdout(), "{}", Options::command().render_version());
        return Err(ExitCode::SUCCESS);
    }
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
    given.flag("--stand", own.stand);
    given.path_or_udp("--measurements", own.measurements.as_ref());
    given.flag("--json", own.json);
    given.path("--log-file", own.log_file.as_ref());
    given.path("--status-socket", own.status_socket.as_ref());
    given.path("--capture", own.capture.as_ref());
}

fn plan(options: Options, beyond: &Beyond) -> Result<Plan, String> {
    let interference = options.loaded.interference(beyond.field);
    let base = options
        .loaded
        .config(options.of, interference, beyond.channel)?;
    let loaded = mission(base, "--")?;
    let sited = options.sites.of(options.loaded.distance)?;
    let key = key::load("--key-file", &options.key_file)?;
    let change = options.version.map(|version| Change {
        version,
        new: options.new,
        sited,
        dry_run: options.dry_run,
        yes: options.yes,
        no_fence: options.no_fence,
        from_loaded: options.from_loaded,
    });
    if let Some(change) = &change {
        if loaded.field().is_some() {
            return Err(UploadError::Field.to_string());
        }
        if !change.yes && !change.dry_run && !std::io::stdin().is_terminal() {
            let version = change.version;
            return Err(format!(
                "--version {version}: nobody can confirm the upload, since standard input is no terminal; give --yes, or --dry-run to see what it changes"
            ));
        }
    }
    Ok(Plan {
        loaded: Loaded {
            mission: loaded,
            method: match options.method {
                Method::Align => uav_relay::Method::Align,
                Method::Joint => uav_relay::Method::Joint,
                Method::Adjust => uav_relay::Method::Adjust(Adjust::default()),
            },
            profiles: beyond.profiles.clone(),
        },
        change,
        stands: options.stand,
        measurements: options.measurements,
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
        key,
        timeout: Duration::from_millis(1_000 * options.timeout),
        baud: options.baud,
        tty: options.tty,
        epoch_file: options.epoch_file,
        status_socket: options.status_socket,
        capture: options.capture,
        log: options.log,
        overrides: beyond.overrides.clone(),
    })
}
