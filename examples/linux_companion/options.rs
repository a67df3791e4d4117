//! Checked command line. A mistake is reported in one line with the option, its value and the allowed range.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, ValueEnum};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::{
    ChannelLoad, Duration, Field, FieldPoint, GuardConfig, Identity, Interference, Listen, Mission,
    Placement, Settings, Side, Wiring,
};
use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::endpoint::{Endpoint, FORM};
use uav_relay_scenario::fleet::FleetSize;
use uav_relay_scenario::key;

use crate::autopilot::{AutopilotPlan, AutopilotPort, SigningKey};
use uav_relay_linux::command::{self, named, number, whole};
use uav_relay_linux::config::{self, FileOnlySettings, FileOptions, Override};
use uav_relay_linux::log::LogOptions;
use uav_relay_linux::mission::{self, Method, MissionOptions};
use uav_relay_linux::site::SiteOptions;

/// Latency of a frame: two kernels, two USB adapters (up to 16 ms each) and the computation.
const LATENCY: Duration = Duration::from_millis(40);

/// Relay of a chain, over ttys. Give all relays the same mission options; their defaults are the paper's multi-hop
/// scenario.
#[derive(Parser, Debug)]
#[command(name = "linux_companion", version)]
pub(crate) struct Options {
    /// TOML file with the scenario, and the sections `network` and `companion`. Options of the command line override it
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Check before flight, for at most S seconds, 1 to 3600; 30 by default. Prints a line for each finding, green or
    /// red, and exits with status 0 if all are green. It joins no chain and sends no targets. First it only listens,
    /// for a quarter of --dead-after-ms and two seconds. It sends nothing to relays if one of them flies
    #[arg(long, value_name = "S", num_args = 0..=1, default_missing_value = "30", require_equals = true, value_parser = whole::<u64>(1, 3_600), help_heading = "Check")]
    pub(crate) check: Option<u64>,
    /// Largest distance of the drone from its planned place, m, 1 to 1e6
    #[arg(long, value_name = "M", default_value_t = 500.0, requires = "check", allow_negative_numbers = true, value_parser = number([1.0, 1e6], "m"), help_heading = "Check")]
    pub(crate) start_within: f32,
    /// The drone is not to be checked. Without this option a check without --autopilot is red
    #[arg(
        long,
        requires = "check",
        conflicts_with = "autopilot",
        help_heading = "Check"
    )]
    pub(crate) no_autopilot: bool,
    /// Number of this relay, 1 (next to the transmitter) to N (next to the receiver)
    #[arg(long, value_name = "I", allow_negative_numbers = true, value_parser = whole::<u16>(1, 1000))]
    index: u16,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole::<u16>(1, 1000))]
    of: u16,
    /// Tty toward the transmitter; relay 1 needs it only for uploads from there
    #[arg(long, value_name = "TTY")]
    pub(crate) upstream: Option<PathBuf>,
    /// Tty toward the receiver; relay N needs it only for uploads from there
    #[arg(long, value_name = "TTY")]
    pub(crate) downstream: Option<PathBuf>,
    /// Tty of one radio channel shared by all relays, instead of --upstream and --downstream
    #[arg(long, value_name = "TTY")]
    pub(crate) shared: Option<PathBuf>,
    /// Bit rate of every tty, bit/s, 1200 to 4000000
    #[arg(long, value_name = "B", default_value_t = 115_200, allow_negative_numbers = true, value_parser = whole::<u32>(1_200, 4_000_000))]
    pub(crate) baud: u32,
    /// Network number, 0 to 65535; frames of other networks are ignored
    #[arg(long, value_name = "W", default_value_t = NETWORK, allow_negative_numbers = true, value_parser = whole::<u16>(0, 65_535))]
    network: u16,
    /// File with the network's key, 64 hexadecimal digits. Frames are signed, and unsigned ones are rejected
    #[arg(long, value_name = "FILE", requires = "epoch_file")]
    key_file: Option<PathBuf>,
    /// File with the epoch, a number increased at every start; created if missing; it must never go back
    #[arg(long, value_name = "FILE", requires = "key_file")]
    pub(crate) epoch_file: Option<PathBuf>,
    /// File for the newest mission uploaded in flight; without it an uploaded mission is lost at a restart
    #[arg(long, value_name = "FILE", requires = "key_file")]
    pub(crate) upload_file: Option<PathBuf>,
    /// File for this relay's votes on the membership of the chain, created if missing. Needed for a restart in
    /// flight. Remove it before another flight
    #[arg(long, value_name = "FILE")]
    pub(crate) view_file: Option<PathBuf>,
    /// Silence after which a neighbour is probed, ms, 1 to 3600000
    #[arg(long, value_name = "MS", default_value_t = 5_000, allow_negative_numbers = true, value_parser = whole::<u64>(1, 3_600_000))]
    probe_after_ms: u64,
    /// Silence after which a neighbour counts as lost, ms, up to 3600000, more than --probe-after-ms
    #[arg(long, value_name = "MS", default_value_t = 15_000, allow_negative_numbers = true, value_parser = whole::<u64>(1, 3_600_000))]
    dead_after_ms: u64,
    /// FIFO for the drone's position, as lines `x_m y_m altitude_m`, at least twice a second. Setpoints then keep
    /// drones apart. A line `endurance SECONDS HOME` gives the remaining flight time and the time to fly home. With
    /// --listen a line may end with the interference measured there, in W, or in dBm with that unit
    #[arg(long, value_name = "FIFO")]
    pub(crate) positions: Option<PathBuf>,
    /// The drone's PX4 or ArduCopter: a tty, or a UDP port, `udp:HOST:PORT` or `udp:HOST:PORT@LOCAL`. It receives
    /// targets and sends positions. LOCAL is the local port, the same at every start. Its default is 14540 to 14549
    /// for PORT 14580 to 14589, as in PX4's simulation, and otherwise PORT + 1000
    #[arg(
        long,
        value_name = "TTY|udp:HOST:PORT[@LOCAL]",
        requires = "site_tx",
        conflicts_with = "positions"
    )]
    autopilot: Option<String>,
    /// Bit rate of the tty to the autopilot, bit/s, 1200 to 4000000
    #[arg(long, value_name = "B", default_value_t = 115_200, requires = "autopilot", allow_negative_numbers = true, value_parser = whole::<u32>(1_200, 4_000_000))]
    autopilot_baud: u32,
    /// File with the autopilot's MAVLink signing key, 64 hexadecimal digits. Frames to the autopilot are signed, and
    /// unsigned frames from it are rejected
    #[arg(long, value_name = "FILE", requires = "autopilot")]
    autopilot_key_file: Option<PathBuf>,
    /// Maximum speed of the drone, m/s, 0.1 to 20
    #[arg(long, value_name = "M/S", default_value_t = 5.0, requires = "autopilot", allow_negative_numbers = true, value_parser = number([0.1, 20.0], "m/s"))]
    speed: f32,
    /// Neighbour that a directional antenna points to. It points forward on the drone, so the targets have a heading.
    /// Without it the autopilot chooses the heading
    #[arg(long, value_name = "SIDE", value_enum, requires = "autopilot")]
    antenna: Option<Antenna>,
    #[command(flatten)]
    sites: SiteOptions,
    /// Maximum position error of a hovering drone, m, 0 to 1000. Two drones may come closer to each other than the
    /// separation by twice this error
    #[arg(long, value_name = "M", default_value_t = 1.0, allow_negative_numbers = true, value_parser = number([0.0, 1_000.0], "m"))]
    position_error: f32,
    #[command(flatten)]
    mission: MissionOptions,
    /// Placement method; with --field only `align`. The setting of the first relay applies, with --field that of the
    /// last relay
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    method: Method,
    /// Interference as a function of the position along the line, instead of --interferer. Each point has X (m, -1e7
    /// to 1e7, in ascending order) and Upsilon = E[1/interference power] (1/W, 1e-9 to 1e32)
    #[arg(long, value_name = "X:UPSILON,X:UPSILON,..", conflicts_with = "interferer", allow_hyphen_values = true, value_parser = field)]
    field: Option<Field>,
    #[command(flatten)]
    listen: ListenOptions,
    #[command(flatten)]
    pub(crate) battery: BatteryOptions,
    /// Unix socket that answers each connection with one JSON object of all counters, and closes it. The commands
    /// `leave` and `stay` order the relay to leave the chain, or to stay. `clear-lost N` reports that the lost relay
    /// N has landed, so that this relay need not keep clear of it
    #[arg(long, value_name = "SOCKET", help_heading = "Log")]
    pub(crate) status_socket: Option<PathBuf>,
    /// Write every frame of the neighbour ports to a pcapng capture, for `cargo decode` and Wireshark. If FILE
    /// exists, FILE-2, FILE-3 and so on is written instead. It grows throughout the flight
    #[arg(long, value_name = "FILE", help_heading = "Log")]
    pub(crate) capture: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) log: LogOptions,
}

/// Options of sensing: how the chain locates its interferer.
#[derive(Args, Debug)]
#[command(next_help_heading = "Listening")]
struct ListenOptions {
    /// Locate the interferer from measurements of the relays. They come from RADIO_STATUS of a SiK radio on the link
    /// of --autopilot, or from lines with a power in the FIFO of --positions. --interferer is then an initial guess,
    /// or `unknown`. Give it to all relays or to none
    #[arg(long, conflicts_with = "field")]
    listen: bool,
    /// Track a moving interferer: estimate its velocity, too, and forget measurements sooner
    #[arg(long, requires = "listen")]
    following: bool,
    /// Time from an agreement to the next collection of measurements by the first relay, s, 0.01 to 1e5. Default 5,
    /// with --following 1
    #[arg(long, value_name = "S", requires = "listen", allow_negative_numbers = true, value_parser = number([0.01, 1e5], "s"))]
    listen_every: Option<f32>,
    /// Half-life of the weight of a measurement, s, 0.01 to 1e12. Default 60 s; with --following 16 s divided by
    /// the number of relays
    #[arg(long, value_name = "S", requires = "listen", allow_negative_numbers = true, value_parser = number([0.01, 1e12], "s"))]
    listen_half_life: Option<f32>,
    /// Relative error of one measurement, 0.001 to 1; default 0.03, for a SiK radio rather 0.1
    #[arg(long, value_name = "E", requires = "listen", allow_negative_numbers = true, value_parser = number([1e-3, 1.0], ""))]
    listen_error: Option<f32>,
}

impl ListenOptions {
    /// Returns the settings for estimating an unknown interferer; `None` without `--listen`.
    fn listen(&self, relays: u16) -> Option<Listen> {
        let default = if self.following {
            Listen::following(relays)
        } else {
            Listen::default()
        };
        self.listen.then(|| Listen {
            every: self.listen_every.map_or(default.every, micros),
            half_life: self.listen_half_life.map_or(default.half_life, micros),
            relative_error: self.listen_error.unwrap_or(default.relative_error),
        })
    }
}

/// Options of the battery: when the relay leaves the chain by itself.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = "Battery")]
pub(crate) struct BatteryOptions {
    /// Reserve of the remaining flight time, s, 0 to 3600. With it the relay asks to leave the chain by itself. It
    /// does so when the remaining time is the way home, this reserve and the time for its replacement. The last is
    /// twelve times --dead-after-ms, at most 240 s. Without this option the remaining time is only shown
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = number([0.0, 3_600.0], "s"))]
    reserve: Option<f32>,
    /// Shortest flight time with a full battery, s, 1 to 21600. It is for an autopilot that reports a percentage but
    /// no remaining time, as ArduCopter does. Without it such an endurance is unknown
    #[arg(long, value_name = "S", requires = "autopilot", allow_negative_numbers = true, value_parser = number([1.0, 21_600.0], "s"))]
    flight_time: Option<f32>,
    /// Speed at which the autopilot returns home, m/s, 0.1 to 20
    #[arg(long, value_name = "M/S", default_value_t = 5.0, requires = "autopilot", allow_negative_numbers = true, value_parser = number([0.1, 20.0], "m/s"))]
    return_speed: f32,
    /// Mean speed at which the autopilot descends to land, m/s, 0.1 to 20
    #[arg(long, value_name = "M/S", default_value_t = 1.5, requires = "autopilot", allow_negative_numbers = true, value_parser = number([0.1, 20.0], "m/s"))]
    descent: f32,
    /// Wait outside of the chain as a spare until the leader calls this relay; only with --shared
    #[arg(long, requires = "shared")]
    pub(crate) spare: bool,
    /// Number of relays that the leader keeps in the chain: more than half of --of, at most all. While there are fewer,
    /// it calls spares. Without this option a spare is called only before a departure. The same for all relays; only with
    /// --shared
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole::<u16>(1, 1000))]
    flying: Option<u16>,
    /// Duration of the motion to newly agreed positions, s, 0 to 3600, at most four times --dead-after-ms. All drones
    /// begin and arrive together, so that no hop is worse on the way. The same for all relays
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number([0.0, 3_600.0], "s"))]
    respacing: f32,
}

impl BatteryOptions {
    /// Returns full flight time (s), return speed and descent speed (m/s) for `Autopilot::set_endurance`.
    ///
    /// `None` if no battery message is needed.
    fn endurance(&self) -> Option<[f32; 3]> {
        let full_s = self.flight_time.unwrap_or(f32::NAN);
        let is_needed = self.reserve.is_some() || self.flight_time.is_some();
        is_needed.then_some([full_s, self.return_speed, self.descent])
    }

    /// Checks the options of a fleet of `of` relays: `--flying` and `--respacing`.
    fn check_fleet(&self, dead_after_ms: u64, of: u16) -> Result<(), String> {
        config::check_flying(self.flying, of)?;
        let most_ms = dead_after_ms.saturating_mul(4);
        if micros(self.respacing) > Duration::from_millis(most_ms) {
            return Err(format!(
                "--respacing {}: must be within 0 to {} s, four times --dead-after-ms",
                self.respacing,
                most_ms / 1_000
            ));
        }
        Ok(())
    }

    pub(crate) fn reserve(&self) -> Option<Duration> {
        self.reserve.map(micros)
    }

    /// Checks the battery options. `--reserve` needs a source of the remaining flight time.
    ///
    /// `--flight-time` must be longer than the reserve plus the time for the relay's replacement.
    fn check(&self, dead_after_ms: u64, has_source: bool) -> Result<(), String> {
        if let Some(reserve) = self.reserve.filter(|_| !has_source) {
            return Err(format!(
                "--reserve {reserve}: needs --positions or --autopilot, which give the remaining time of flight"
            ));
        }
        let (Some(reserve), Some(full)) = (self.reserve, self.flight_time) else {
            return Ok(());
        };
        let replacement = u32::try_from(dead_after_ms * 12 / 1_000).map_or(240, |s| s.min(240));
        let least = f64::from(reserve) + f64::from(replacement);
        if f64::from(full) > least {
            return Ok(());
        }
        Err(format!(
            "--flight-time {full}: must be above {least} s, the sum of --reserve {reserve} s and {replacement} s for the replacement of this relay"
        ))
    }
}

/// Neighbour that a directional antenna points to.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Antenna {
    /// The neighbour toward the transmitter.
    Upstream,
    /// The neighbour toward the receiver.
    Downstream,
}

#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) options: Options,
    pub(crate) mission: Mission,
    pub(crate) identity: Identity,
    pub(crate) settings: Settings,
    pub(crate) key: Option<SigningKey>,
    pub(crate) autopilot: Option<AutopilotPlan>,
    pub(crate) overrides: Vec<Override>,
    /// Planned position of this relay, if the `--config` file has a plan of positions.
    pub(crate) planned: Option<Placement>,
}

/// Reads and checks the command line. The error is the exit status after the help text or an error line.
pub(crate) fn read() -> Result<Plan, ExitCode> {
    let (options, beyond) = command::read(section)?;
    plan(options, beyond).map_err(|line| command::refuse(&line))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "0 to 1e18"
)]
fn micros(seconds: f32) -> Duration {
    Duration::from_micros((f64::from(seconds) * 1e6) as u64)
}

/// Adds the options of the file's sections `[network]`, `[fleet]` and `[companion]`.
fn section(deployment: &Deployment, given: &mut FileOptions) {
    config::network(deployment, given);
    let own = &deployment.companion;
    given.value("--index", own.index);
    given.path("--upstream", own.upstream.as_ref());
    given.path("--downstream", own.downstream.as_ref());
    given.path("--shared", own.shared.as_ref());
    given.path("--epoch-file", own.epoch_file.as_ref());
    given.path("--upload-file", own.upload_file.as_ref());
    given.path("--view-file", own.view_file.as_ref());
    given.path_or_udp("--autopilot", own.autopilot.as_ref());
    given.value("--autopilot-baud", own.autopilot_baud);
    given.path("--autopilot-key-file", own.autopilot_key_file.as_ref());
    given.value("--speed", own.speed_m_s);
    given.value("--reserve", own.reserve_s);
    given.value("--flight-time", own.flight_time_s);
    given.value("--return-speed", own.return_speed_m_s);
    given.value("--descent", own.descent_m_s);
    given.flag("--spare", own.spare);
    given.value("--flying", deployment.fleet.flying);
    given.value("--respacing", deployment.fleet.respacing_s);
    given.path("--positions", own.positions.as_ref());
    given.value("--position-error", own.position_error_m);
    given.flag("--json", own.json);
    given.path("--log-file", own.log_file.as_ref());
    given.path("--status-socket", own.status_socket.as_ref());
    given.path("--capture", own.capture.as_ref());
}

fn plan(options: Options, file_only: FileOnlySettings) -> Result<Plan, String> {
    let Options { index, of, .. } = options;
    if index > of {
        return Err(format!(
            "--index {index}: must be within 1 to {of}, the number given by --of"
        ));
    }
    if options.dead_after_ms <= options.probe_after_ms {
        return Err(format!(
            "--dead-after-ms {}: must be within {} to 3600000, above --probe-after-ms",
            options.dead_after_ms,
            options.probe_after_ms + 1
        ));
    }
    let has_source = options.positions.is_some() || options.autopilot.is_some();
    options.battery.check(options.dead_after_ms, has_source)?;
    options.battery.check_fleet(options.dead_after_ms, of)?;
    let wiring = wiring(&options)?;
    let load = match wiring {
        Wiring::Pair => ChannelLoad::of_radios(1),
        Wiring::Shared => channel_load(&options)?,
    };
    let mission = mission(&options, &file_only)?;
    let mut profiles = file_only.profiles.iter();
    let own = profiles.find(|(of, _)| *of == index);
    let profile = own.map_or(mission.config().common, |(_, profile)| *profile);
    if own.is_some() {
        file_only.check_profile_options(index)?;
    }
    let guard = GuardConfig {
        hover_m: options.position_error,
        lag: Pace::of_speed(options.speed).stopping_time(),
        ..GuardConfig::of(&mission, profile)
    };
    let settings = Settings {
        guard: has_source.then_some(guard),
        method: options.method.into(),
        listen: options.listen.listen(options.of),
        wiring,
        sited: options.autopilot.is_some(),
        profile: own.map(|_| profile),
        hold_altitude: file_only.held.contains(&index),
        hop_time: load.hop_time(options.baud, LATENCY),
        probe_after: Duration::from_millis(options.probe_after_ms),
        dead_after: Duration::from_millis(options.dead_after_ms),
        flying: options.battery.flying.unwrap_or(0),
        respacing: micros(options.battery.respacing),
        ..Settings::default()
    };
    let key = options.key_file.as_deref();
    let key = key.map(|file| key::load("--key-file", file));
    let flying = options.battery.flying.unwrap_or(of);
    let rank = FleetSize { relays: of, flying }.rank(index);
    let rank = rank.filter(|_| !options.battery.spare);
    Ok(Plan {
        mission,
        identity: Identity {
            network: options.network,
            index,
        },
        settings,
        key: key.transpose()?.map(SigningKey),
        autopilot: autopilot(&options)?,
        planned: rank.and_then(|rank| file_only.places.get(rank).copied()),
        overrides: file_only.overrides,
        options,
    })
}

fn autopilot(options: &Options) -> Result<Option<AutopilotPlan>, String> {
    let sites = options.sites.of(options.mission.distance)?;
    let (Some(name), Some(sites)) = (&options.autopilot, sites) else {
        return Ok(None);
    };
    let place = match Endpoint::parse(name) {
        Some(Ok(endpoint)) => AutopilotPort::Udp(endpoint),
        Some(Err(error)) => return Err(format!("--autopilot {name}: {error}; must be {FORM}")),
        None => AutopilotPort::Tty(PathBuf::from(name), options.autopilot_baud),
    };
    let key = options.autopilot_key_file.as_deref();
    let key = key.map(|file| key::load("--autopilot-key-file", file));
    Ok(Some(AutopilotPlan {
        port: place,
        sites,
        pace: Pace::of_speed(options.speed),
        antenna: options.antenna.map(|antenna| match antenna {
            Antenna::Upstream => Side::Upstream,
            Antenna::Downstream => Side::Downstream,
        }),
        key: key.transpose()?.map(SigningKey),
        endurance: options.battery.endurance(),
    }))
}

/// Returns the load of the shared radio channel. Returns an error if its data rate does not suffice for all relays.
fn channel_load(options: &Options) -> Result<ChannelLoad, String> {
    let load = ChannelLoad::of_radios(options.of);
    load.carried(options.baud, Duration::from_millis(options.probe_after_ms))
        .map_err(|full| {
            format!(
                "--baud {}: {full}; with a larger --probe-after-ms, also set --dead-after-ms to three times that value",
                options.baud
            )
        })?;
    Ok(load)
}

fn wiring(options: &Options) -> Result<Wiring, String> {
    let Options { index, of, .. } = *options;
    let (upstream, downstream) = (&options.upstream, &options.downstream);
    if let Some(tty) = &options.shared {
        if upstream.is_none() && downstream.is_none() {
            return Ok(Wiring::Shared);
        }
        return Err(format!(
            "--shared {}: cannot be combined with --upstream and --downstream",
            tty.display()
        ));
    }
    if let Some(flying) = options.battery.flying {
        return Err(format!(
            "--flying {flying}: needs --shared, because spares join only on a radio channel that all relays share; on wires leave --flying out, and fleet.flying of the --config file"
        ));
    }
    let missing = |name: &str, neighbour: u16| {
        Err(format!(
            "--{name}: is missing: give the tty that leads to relay {neighbour}, or --shared for a radio that all relays share"
        ))
    };
    if index > 1 && upstream.is_none() {
        return missing("upstream", index - 1);
    }
    if index < of && downstream.is_none() {
        return missing("downstream", index + 1);
    }
    Ok(Wiring::Pair)
}

fn mission(options: &Options, file_only: &FileOnlySettings) -> Result<Mission, String> {
    let given = &options.mission;
    let field = options.field.map(Interference::Field).or(file_only.field);
    let interference = given.interference(field);
    if interference == Interference::Unknown && !options.listen.listen {
        return Err("--interferer unknown: needs --listen, with which the relays measure the interferer; without --listen give its power and position, P,X,Y".to_owned());
    }
    if matches!(interference, Interference::Field(_)) && options.method != Method::Align {
        let method = options.method.to_possible_value();
        return Err(format!(
            "--method {}: cannot be used with --field: give --method align",
            method.as_ref().map_or("", |method| method.get_name())
        ));
    }
    let config = given.config(options.of, interference, file_only.channel)?;
    mission::mission(config, "--")
}

/// Parses the interference along x. The memory of its points is never freed, because the mission refers to them until
/// exit.
fn field(text: &str) -> Result<Field, String> {
    let point = |text: &str| {
        let (x, upsilon) = text
            .split_once(':')
            .ok_or("must be one or more points X:UPSILON, separated by commas: X is the position along the line in m, UPSILON the mean of 1 / interference power there in 1/W")?;
        Ok(FieldPoint {
            x_m: named("X", x, [-1e7, 1e7], "m")?,
            upsilon_per_w: named("UPSILON", upsilon, [1e-9, 1e32], "1/W")?,
        })
    };
    let points: Result<Vec<FieldPoint>, String> = text.split(',').map(point).collect();
    Field::try_new(points?.leak()).map_err(|error| error.to_string())
}
