//! `cargo provision`: writes the configuration block of one drone, or of all, from a scenario.

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::{Args, Parser, ValueEnum};
use uav_relay::{Adjust, ChannelLoad, Duration, Local, Measure};
use uav_relay_scenario::deployment::{COMPANION_TOLERANCE, Deployment, NETWORK, Network};
use uav_relay_scenario::fleet::FleetSize;
use uav_relay_scenario::{Interference, PlannedMethod, Scenario, key, mission};
use uav_relay_sim::command;
use uav_relay_sim::command::{Failure, MOST_BAUD, number, whole};
use uav_relay_tools::plan;
use uav_relay_tools::plan::area;
use uav_relay_tools::plan::flown::{Flown, flown, is_current, with_plan};
use uav_relay_tools::plan::terrain::{Elevation, POSITION_ERROR_M};
use uav_relay_tools::plan::terrain_flight::{Flight as Simulated, no_fly_warnings};
use uav_relay_tools::plan::{NoPlan, Unit};
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::bundle::{ASIDE_M, Bundle, FILL_IN};
use uav_relay_tools::provision::config::{ADDRESS, LEN, MAX_PROBE_AFTER_MS, Secret};
use uav_relay_tools::provision::folder::{Heading, summary};
use uav_relay_tools::provision::{block, folder};

/// Options of the user, completed by the scenario and its plan.
struct Asked<'a> {
    options: &'a Options,
    scenario: Scenario,
    deployment: Deployment,
    name: String,
    network: u16,
    key_file: Option<PathBuf>,
    uavs: u16,
    /// Numbers of relays in the fleet and in the chain; `None` if the scenario has no `fleet.flying`.
    fleet: Option<FleetSize>,
    method: Method,
    tolerance: f64,
    /// Silence of a neighbour after which a relay requests heartbeats, ms; 0 for the firmware's default.
    probe_after_ms: u32,
}

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => {
            let line = run(&options).map(|line| command::print(&line));
            command::ended(line.map_err(Failure::input))
        }
        Err(error) => command::usage(&error),
    }
}

fn run(options: &Options) -> Result<String, String> {
    let asked = Asked::new(options)?;
    let Asked {
        scenario,
        name,
        uavs,
        ..
    } = &asked;
    if let Some(index) = options.index
        && index > *uavs
    {
        return Err(format!("--index {index}: must be within 1 to {uavs}"));
    }
    if let Some(line) = mission::undescribed_relay_error(scenario, *uavs) {
        return Err(format!("{name}: {line}"));
    }
    if let Some(dir) = &options.folder.bundle {
        return asked.bundle(dir);
    }
    let secret = asked.secret()?;
    let flight = asked.flight(secret)?;
    let flown = asked.flown()?;
    let simulated = asked.over_terrain(flown.as_ref())?;
    let said = match (&options.out, options.index, &options.folder.out_dir) {
        (Some(file), Some(index), _) => {
            let block = flight
                .block(index)
                .map_err(|error| format!("{name}: {error}"))?;
            std::fs::write(file, block)
                .map_err(|error| format!("{}: --out cannot be written: {error}", file.display()))?;
            format!(
                "{}: relay {index} of {uavs}, network {}; {LEN} bytes for {ADDRESS:#010x}\n",
                file.display(),
                asked.network
            )
        }
        (_, _, Some(dir)) => asked.folder(&flight, (flown.as_ref(), simulated.as_ref()), dir)?,
        _ => {
            return Err(
                "either --index with --out, or --all with --out-dir, or --bundle must be given"
                    .to_owned(),
            );
        }
    };
    if secret.is_none() {
        command::print_line(
            "no --key-file: frames are not signed, so anybody in range can forge them",
        );
    }
    Ok(said)
}

impl<'a> Asked<'a> {
    fn new(options: &'a Options) -> Result<Self, String> {
        let (scenario, deployment) = match &options.scenario {
            Some(file) => Deployment::load(file).map_err(|error| error.to_string())?,
            None => Default::default(),
        };
        let section = &deployment.network;
        // Paths in a file are relative to its folder.
        let folder = options.scenario.as_deref().and_then(Path::parent);
        let of_file = section
            .key_file
            .as_ref()
            .map(|file| folder.unwrap_or(Path::new("")).join(file));
        let name = options.scenario.as_ref().map_or_else(
            || "default scenario".to_owned(),
            |file| file.display().to_string(),
        );
        let plan = scenario.plan.as_ref();
        deployment
            .check_identical(&name, &scenario)
            .map_err(|error| error.to_string())?;
        let fleet = fleet_of(&deployment, options, &name)?;
        let other = |option: &str, has: &str| {
            format!(
                "{option}: {name} has a [plan] with {has}; leave the option out, or run `cargo plan --out` again"
            )
        };
        let uavs = match (options.uavs, plan, fleet) {
            (Some(uavs), _, Some(fleet)) if uavs != fleet.relays => {
                return Err(format!(
                    "--uavs {uavs}: {name} has fleet.flying and network.relays = {}; leave the option out, or change network.relays",
                    fleet.relays
                ));
            }
            (_, _, Some(fleet)) => fleet.relays,
            (Some(uavs), Some(plan), _) if uavs != plan.uavs => {
                return Err(other(
                    &format!("--uavs {uavs}"),
                    &format!("uavs = {}", plan.uavs),
                ));
            }
            (_, Some(plan), _) => plan.uavs,
            (uavs, None, _) => uavs.or(section.relays).ok_or_else(|| {
                format!(
                    "--uavs: is missing, and so are [plan] and network.relays in {name}; allowed: 1 to 1000"
                )
            })?,
        };
        let planned = plan.map(|plan| match plan.method {
            PlannedMethod::Align => Method::Align,
            PlannedMethod::Joint => Method::Joint,
        });
        overridden(options, section, of_file.as_deref(), &name);
        let of_section = section.method.as_deref();
        let method = match (options.method, planned) {
            (Some(method), Some(planned)) if method != planned => {
                return Err(other(
                    "--method",
                    &format!("another method, {planned:?}").to_lowercase(),
                ));
            }
            (method, planned) => method.or(planned),
        };
        let method = chosen_method(method, of_section, &name, planned.is_some())?;
        let probe_after_ms = match &options.folder.bundle {
            // Linux computers have no limits of the firmware.
            Some(_) => section.probe_after_ms.unwrap_or(0),
            None => block::probe_after_ms(section, options.probe_after_ms, &name)?,
        };
        let tolerance = match (options.tolerance, plan) {
            (Some(tolerance), Some(plan)) if tolerance.total_cmp(&plan.tolerance).is_ne() => {
                return Err(other(
                    &format!("--tolerance {tolerance:?}"),
                    &format!("tolerance = {:?}", plan.tolerance),
                ));
            }
            (tolerance, plan) => tolerance
                .or(plan.map(|plan| plan.tolerance))
                .unwrap_or(COMPANION_TOLERANCE),
        };
        for (option, given) in [
            ("--rounds", options.rounds.is_some()),
            ("--explore", options.explore_m.is_some()),
        ] {
            if given && method != Method::Adjust {
                return Err(format!("{option}: is only for --method adjust"));
            }
        }
        Ok(Self {
            options,
            scenario,
            name,
            network: options.network.or(section.id).unwrap_or(NETWORK),
            deployment,
            key_file: options.key_file.clone().or(of_file),
            uavs,
            fleet,
            method,
            tolerance,
            probe_after_ms,
        })
    }

    /// Returns the number of relays in the chain.
    fn flying(&self) -> u16 {
        self.fleet.map_or(self.uavs, |fleet| fleet.flying)
    }

    fn flight(&self, secret: Option<Secret>) -> Result<Flight, String> {
        let options = self.options;
        let method = match self.method {
            Method::Align => uav_relay::Method::Align,
            Method::Joint => uav_relay::Method::Joint,
            Method::Adjust => uav_relay::Method::Adjust(Adjust {
                rounds: options.rounds.unwrap_or(500),
                explore_m: options.explore_m.unwrap_or(10.0),
                local: Local::Fine,
            }),
        };
        let flight = Flight::new(&self.scenario, self.uavs, self.tolerance, self.network)
            .map_err(|error| format!("{}: {error}", self.name))?;
        let [probe_after, _] = block::silence(self.probe_after_ms);
        carried(options, self.uavs, self.fleet.is_some(), probe_after)?;
        let flight = match options.speed {
            Some(_) if !flight.has_sites() => {
                return Err("--speed: is only for a scenario with a [site]".to_owned());
            }
            Some(speed) => flight.no_faster_than(speed),
            None => flight,
        };
        let autopilot_key = match &options.autopilot_key_file {
            Some(_) if !flight.has_sites() => {
                return Err("--autopilot-key-file: is only for a scenario with a [site]".to_owned());
            }
            Some(file) => Some(key::load("--autopilot-key-file", file)?),
            None => None,
        };
        Ok(flight
            .by(method)
            .with_access(&self.scenario)
            .map_err(|error| format!("{}: {error}", self.name))?
            .signed(secret)
            .signed_to_autopilots(autopilot_key)
            .measuring(measure(options, &self.scenario)?)
            .with_probe_after(self.probe_after_ms)
            .with_fleet(self.fleet))
    }

    /// Returns the positions that the relays will choose; `None` if they are not needed or not known.
    ///
    /// # Errors
    /// The plan in the scenario is out of date, a relay is in a no-fly area, or the hypothetical interferer costs too
    /// much SIR.
    fn flown(&self) -> Result<Option<Flown>, String> {
        let is_plain = matches!(&self.scenario.interference, Interference::Sources(sources) if sources.len() == 1);
        let is_several = matches!(&self.scenario.interference, Interference::Sources(sources) if sources.len() > 1);
        if self.options.stand_in && !is_several {
            return Err(
                "--stand-in: is only for a scenario with several [[interferer]]".to_owned(),
            );
        }
        if !self.scenario.knows_interference()
            || is_plain
                && !self.is_whole()
                && self.scenario.plan.is_none()
                && self.scenario.no_fly.is_empty()
                && self.scenario.terrain.is_none()
        {
            return Ok(None);
        }
        let method = match self.method {
            Method::Joint => PlannedMethod::Joint,
            // `adjust` starts from the positions of `align`.
            Method::Align | Method::Adjust => PlannedMethod::Align,
        };
        // Relays report it themselves if they agree on no positions.
        let Ok(flown) = flown(&self.scenario, self.flying(), method, self.tolerance) else {
            return match self.scenario.plan {
                Some(_) => Err(format!(
                    "{}: [plan] does not fit this scenario: the relays would reach no agreement; run `cargo plan` again",
                    self.name
                )),
                None => Ok(None),
            };
        };
        if let Some(plan) = &self.scenario.plan {
            is_current(plan, &flown).map_err(|why| format!("{}: {why}", self.name))?;
        }
        let chain = flown.plan.chain();
        let is_free = method == PlannedMethod::Joint;
        if let Some(line) = area::problem(&self.scenario, &chain, is_free, true) {
            return Err(format!("{}: {line}", self.name));
        }
        if let Some(line) = area::problem(&self.scenario, &chain, is_free, false) {
            command::print_line(&format!("{}: warning: {line}", self.name));
        }
        if flown.is_poor() {
            let line = format!("{}: {}", self.name, flown.describe());
            if flown.stand_in && !self.options.stand_in {
                return Err(format!(
                    "{line}; to write the files nevertheless, give --stand-in: the relays then compute with the hypothetical interferer"
                ));
            }
            command::print_line(&line);
        }
        Ok(Some(flown))
    }

    /// Simulates the flight over terrain and no-fly areas.
    ///
    /// `None` if the scenario has no terrain, or if the positions are not known.
    ///
    /// # Errors
    /// A hop is blocked, a relay is too low or too high, or the elevation files cannot be used.
    fn over_terrain(&self, flown: Option<&Flown>) -> Result<Option<Simulated>, String> {
        let named = |line: String| format!("{}: {line}", self.name);
        let failed = |none| match none {
            NoPlan::Wrong(line) => named(line),
            NoPlan::Unmet(why, _) => named(why.say(Unit::Decibels)),
        };
        let warn = |line: String| command::print_line(&named(format!("warning: {line}")));
        let error_m = self.position_error_m();
        if self.scenario.terrain.is_none() && self.options.allow_blocked {
            return Err("--allow-blocked: is only for a scenario with a [terrain]".to_owned());
        }
        let method = match self.method {
            Method::Align => PlannedMethod::Align,
            Method::Joint => PlannedMethod::Joint,
            Method::Adjust => {
                return Ok(self.unchecked("the method adjust changes altitudes in flight"));
            }
        };
        let Some(flown) = flown else {
            return Ok(self.unchecked("the relays' positions are not known before the flight"));
        };
        let Some(elevation) = Elevation::load(&self.scenario, &[], error_m).map_err(named)? else {
            let lines = no_fly_warnings(&self.scenario, self.flying(), (method, self.tolerance));
            lines.map_err(failed)?.into_iter().for_each(warn);
            return Ok(None);
        };
        let how = (method, self.tolerance);
        let flight = Simulated::new(
            &self.scenario,
            &elevation,
            &flown.plan,
            how,
            self.options.allow_blocked,
        );
        let flight = flight.map_err(failed)?;
        if let Some(line) = &flight.problem {
            return Err(named(line.clone()));
        }
        flight.warnings().for_each(warn);
        Ok(Some(flight))
    }

    /// Returns the lowest and the highest ground around the flight, m above the sea.
    ///
    /// It is the ground from Tx to Rx, up to the lateral distance at which drones take off. The least permitted height
    /// above the ground is added to the highest ground. `None` if the scenario has no terrain.
    fn ground_m(&self) -> Result<Option<[f64; 2]>, String> {
        let scenario = &self.scenario;
        let why = |line: String| {
            format!(
                "{}: {line}; the ground up to {ASIDE_M} m beside the chain is needed for the altitude of the return to launch",
                self.name
            )
        };
        let elevation = Elevation::load(scenario, &[], self.position_error_m()).map_err(why)?;
        let Some(elevation) = elevation else {
            return Ok(None);
        };
        let aside_m = scenario.lateral_max_m.max(-scenario.lateral_min_m).max(0.0);
        let [low, high] = elevation
            .corridor_m(scenario, aside_m + ASIDE_M)
            .map_err(why)?;
        Ok(Some([low, high + elevation.spec.above_ground_m]))
    }

    fn position_error_m(&self) -> f64 {
        let error_m = self.deployment.companion.position_error_m;
        error_m.map_or(POSITION_ERROR_M, f64::from)
    }

    /// Prints the reason `why` terrain and no-fly areas of the scenario are not checked.
    fn unchecked(&self, why: &str) -> Option<Simulated> {
        let has_terrain = self.scenario.terrain.is_some();
        for (what, is_there) in [
            ("terrain", has_terrain),
            ("no-fly areas", !self.scenario.no_fly.is_empty()),
        ] {
            if is_there {
                command::print_line(&format!("{}: {what} not checked: {why}", self.name));
            }
        }
        None
    }

    /// Returns true if the option `--all` or `--bundle` is given.
    const fn is_whole(&self) -> bool {
        self.options.folder.all || self.options.folder.bundle.is_some()
    }

    fn secret(&self) -> Result<Option<Secret>, String> {
        let Some(file) = &self.key_file else {
            return match self.options.epoch {
                Some(epoch) => Err(format!(
                    "--epoch {epoch}: is only for signed frames, so it needs --key-file"
                )),
                None => Ok(None),
            };
        };
        let seconds = || {
            let since = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
            u32::try_from(since.as_secs()).ok()
        };
        let epoch = self.options.epoch.or_else(seconds);
        Ok(Some(Secret {
            key: key::load("--key-file", file)?,
            epoch: epoch
                .ok_or("--epoch: is missing, and cannot be taken from the time, because this computer's clock is not set")?,
        }))
    }

    /// Writes the folders of drones and ground station into the new folder `dir`.
    fn bundle(&self, dir: &Path) -> Result<String, String> {
        let (name, options) = (&self.name, self.options);
        let Some(line) = &self.scenario.line else {
            return Err(format!(
                "--bundle: {name} has no [site], the geographic ends of the line along which the drones fly"
            ));
        };
        let section = &self.deployment.network;
        let baud = section.baud.unwrap_or(options.baud);
        let own = &self.deployment.companion;
        if own.upstream.is_none() && own.downstream.is_none() {
            let probe_after = block::silence(self.probe_after_ms)[0];
            command::carries(baud, ChannelLoad::of_radios(self.uavs), probe_after)?;
        }
        // The relays have to fly to the positions that are checked here.
        if self.tolerance.total_cmp(&COMPANION_TOLERANCE).is_ne() {
            let (from, remedy) = match self.scenario.plan {
                Some(_) => (
                    format!("{name}: plan.tolerance"),
                    "run `cargo plan --out` again without --tolerance",
                ),
                None => ("--tolerance".to_owned(), "leave it out"),
            };
            return Err(format!(
                "{from} = {:?}: must be {COMPANION_TOLERANCE:?} with --bundle, because companions compute their positions with this tolerance; {remedy}",
                self.tolerance
            ));
        }
        let flight = Flight::new(&self.scenario, self.uavs, self.tolerance, self.network)
            .map_err(|error| format!("{name}: {error}"))?;
        let flight = match self.method {
            Method::Joint => flight.by(uav_relay::Method::Joint),
            _ => flight,
        };
        let flight = flight
            .with_access(&self.scenario)
            .map_err(|error| format!("{name}: {error}"))?;
        let flown = self.flown()?.filter(|_| self.method != Method::Adjust);
        let simulated = self.over_terrain(flown.as_ref())?;
        let text = match &options.scenario {
            Some(file) => std::fs::read_to_string(file)
                .map_err(|error| format!("{}: {error}", file.display()))?,
            None => String::new(),
        };
        let planned = match self.method {
            Method::Joint => PlannedMethod::Joint,
            Method::Align | Method::Adjust => PlannedMethod::Align,
        };
        let text = match &flown {
            Some(flown) => with_plan(&text, &plan::flown::planned(flown, planned, self.tolerance))?,
            None => text,
        };
        let own_folder = options.scenario.as_deref().and_then(Path::parent);
        let of_file = own.autopilot_key_file.as_ref();
        let of_file = of_file.map(|file| own_folder.unwrap_or(Path::new("")).join(file));
        let autopilot_key = options.autopilot_key_file.clone().or(of_file);
        let autopilot_key = autopilot_key
            .map(|file| key::load("--autopilot-key-file", &file))
            .transpose()?;
        let key = match &self.key_file {
            Some(file) => key::load("--key-file", file)?,
            None => new_key()?,
        };
        let relays: Vec<u16> = match options.index {
            Some(index) => vec![index],
            None => (1..=self.uavs).collect(),
        };
        let bundle = Bundle {
            ground_m: self.ground_m()?,
            text,
            deployment: &self.deployment,
            fleet: self.fleet.unwrap_or(FleetSize {
                relays: self.uavs,
                flying: self.uavs,
            }),
            network: self.network,
            method: &format!("{:?}", self.method).to_lowercase(),
            mission: flight.mission(),
            profiles: flight.profiles(),
            places: flown.as_ref().map_or(&[], |flown| &flown.plan.places),
            simulated: simulated.as_ref(),
            line,
            key,
            autopilot_key,
        };
        bundle.write(dir, &relays)?;
        let made = if self.key_file.is_some() {
            "the network's key"
        } else {
            "a new key"
        };
        Ok(format!(
            "{}: {} folders of relays and the folder ground, with {made}, mission 0x{:04x}\n\
             next: replace {FILL_IN} in each 70-uav-relay.rules, then run on each computer: sudo sh install.sh; page.txt has the further steps\n",
            dir.display(),
            relays.len(),
            flight.mission().digest()
        ))
    }

    fn folder(
        &self,
        flight: &Flight,
        (flown, simulated): (Option<&Flown>, Option<&Simulated>),
        dir: &Path,
    ) -> Result<String, String> {
        let heading = Heading {
            scenario: self.name.clone(),
            fleet: self.fleet.unwrap_or(FleetSize {
                relays: self.uavs,
                flying: self.uavs,
            }),
            network: self.network,
            method: format!("{:?}", self.method).to_lowercase(),
            signed: self.key_file.is_some(),
        };
        let places = match flown {
            Some(flown) if self.method != Method::Adjust => flown.plan.places.as_slice(),
            _ => &[],
        };
        let mut files = Vec::new();
        for index in 1..=self.uavs {
            let block = flight
                .block(index)
                .map_err(|error| format!("{}: relay {index}: {error}", self.name))?;
            files.push((folder::name(index), block.to_vec()));
        }
        let mut text = summary(&heading, places, self.scenario.line.as_ref());
        if let Some(simulated) = simulated {
            text = format!("{text}\n{simulated}\n");
        }
        files.push(("summary.txt".to_owned(), text.clone().into_bytes()));
        folder::write(dir, &files, self.options.folder.force)?;
        Ok(format!(
            "{}: {} blocks of {LEN} bytes, and summary.txt:\n{}\n",
            dir.display(),
            self.uavs,
            text.trim_end()
        ))
    }
}

/// Returns a new random key.
fn new_key() -> Result<[u8; 32], String> {
    let mut key = [0; 32];
    let source = "/dev/urandom";
    std::fs::File::open(source)
        .and_then(|mut file| file.read_exact(&mut key))
        .map_err(|error| format!("{source}: {error}"))?;
    Ok(key)
}

/// Returns the sizes of the fleet and the chain; `None` if the scenario `name` has no `fleet.flying`.
///
/// # Errors
/// The key or option that contradicts the fleet.
fn fleet_of(
    deployment: &Deployment,
    options: &Options,
    name: &str,
) -> Result<Option<FleetSize>, String> {
    let fleet = deployment.fleet.flying.and(deployment.fleet_size());
    if fleet.is_none() && deployment.companion.spare == Some(true) {
        return Err(format!(
            "companion.spare = true: would make every relay of {name} a spare; give network.relays and fleet.flying, or leave the key out"
        ));
    }
    if fleet.is_some() && options.wires {
        return Err(format!(
            "--wires: spares join only on a channel that all relays share, and {name} has fleet.flying: leave one of them out"
        ));
    }
    Ok(fleet)
}

/// Checks that the radio channel is fast enough for `uavs` relays. Wires are always fast enough.
///
/// `probe_after` is the silence of a neighbour after which a relay requests heartbeats. A fleet `has_spares` only on a
/// channel.
fn carried(
    options: &Options,
    uavs: u16,
    has_spares: bool,
    probe_after: Duration,
) -> Result<(), String> {
    if options.wires {
        return Ok(());
    }
    let in_range = options.in_range.unwrap_or(uavs).min(uavs);
    command::carries(options.baud, ChannelLoad::of_radios(in_range), probe_after).map_err(|error| {
        let wires = if has_spares { "" } else { ", or --wires for separate links" };
        format!(
            "{error}; this assumes that all relays receive each other: if not, give --in-range{wires}"
        )
    })
}

fn measure(options: &Options, scenario: &Scenario) -> Result<Option<Measure>, String> {
    let Some(samples) = options.samples else {
        return Ok(None);
    };
    let Interference::Field(field) = &scenario.interference else {
        return Err(format!(
            "--samples {samples}: is only for a scenario with a [field]"
        ));
    };
    #[expect(
        clippy::cast_possible_truncation,
        reason = "1e-30 to 1e6 by the scenario"
    )]
    let i_max_w = field.i_max_w as f32;
    Ok(Some(Measure { i_max_w, samples }))
}

/// Writes the configuration block of one relay, or of all: its index and its mission. With --bundle writes the files of Linux computers.
#[derive(Parser, Debug)]
#[command(
    name = "provision",
    bin_name = "cargo provision",
    disable_version_flag = true
)]
struct Options {
    /// Scenario file (TOML); by default the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000; by default that of the scenario's plan or section `network`
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1, 1000))]
    uavs: Option<u16>,
    /// Index of this drone's relay, 1 (next to the transmitter) to N
    #[arg(long, value_name = "I", required_unless_present_any = ["all", "bundle"], value_parser = whole::<u16>(1, 1000))]
    index: Option<u16>,
    /// Network number, 0 to 65535; frames of other networks are ignored. By default that of the scenario's section `network`, or
    /// 1
    #[arg(long, value_name = "W", value_parser = whole(0, u16::MAX))]
    network: Option<u16>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1; by default that of the scenario's plan, or 1e-4
    #[arg(long, value_name = "T", value_parser = |text: &str| number(text, 1e-6, 0.1))]
    tolerance: Option<f64>,
    /// Method that finds the places; in a field, only `align`. By default that of the scenario's plan or section `network`, or
    /// `align`
    #[arg(long, value_name = "M", value_enum)]
    method: Option<Method>,
    /// Largest number of rounds of `adjust`, 1 to 65535; 500 by default
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1, u16::MAX))]
    rounds: Option<u16>,
    /// Largest change of altitude in one round of `adjust`, metres, 0 to 1e5; 10 by default
    #[arg(long = "explore", value_name = "M", value_parser = explore)]
    explore_m: Option<f32>,
    /// Measure the field on board, and trust this many samples at a place, 100 to 1000000
    #[arg(long, value_name = "S", value_parser = whole::<u32>(100, 1_000_000))]
    samples: Option<u32>,
    /// File with the network's key, 64 hexadecimal digits. Without one here or in the scenario's section `network`, frames are not
    /// signed
    #[arg(long, value_name = "FILE")]
    key_file: Option<PathBuf>,
    /// Least epoch to sign with, 1 to 4294967294. It must exceed every epoch that a relay of this index has used with this key. It
    /// rises by itself from there. By default the seconds of this machine's clock
    #[arg(long, value_name = "E", value_parser = whole::<u32>(1, 0xFFFF_FFFE))]
    epoch: Option<u32>,
    /// Bits per second of the radio channel that the relays share, 300 to 10000000. Refused if too slow for them
    #[arg(long, value_name = "B", default_value_t = 115_200, value_parser = whole(300, MOST_BAUD))]
    baud: u32,
    /// Milliseconds of silence after which a relay probes a neighbour, 1 to 1200000. After three times as many the neighbour counts
    /// as lost. By default those of the scenario's section `network`, or 5000. Larger values let a slow channel carry more relays
    #[arg(long, value_name = "MS", value_parser = whole(1, MAX_PROBE_AFTER_MS))]
    probe_after_ms: Option<u32>,
    /// Number of relays within range of each other on the channel, 1 to 1000; by default all of them
    #[arg(long, value_name = "K", value_parser = whole::<u16>(1, 1000))]
    in_range: Option<u16>,
    /// Neighbours are connected by wires, without a shared channel
    #[arg(long, conflicts_with_all = ["baud", "in_range"])]
    wires: bool,
    /// Greatest speed of the drone, m/s, 0.1 to 20, if the scenario has sites; 5 by default
    #[arg(long, value_name = "M/S", value_parser = speed)]
    speed: Option<f32>,
    /// File with the signing key of the drone's autopilot, 64 hexadecimal digits. It applies if the scenario has sites. Without a
    /// key the messages between the two are not signed
    #[arg(long, value_name = "FILE")]
    autopilot_key_file: Option<PathBuf>,
    /// Accept that relays plan with one hypothetical interferer instead of several real ones. Without this option a loss of more than 1 % of the best SIR is refused
    #[arg(long)]
    stand_in: bool,
    /// Accept a flight with a blocked hop over the terrain of the scenario
    #[arg(long)]
    allow_blocked: bool,
    /// File to write the block to
    #[arg(long, value_name = "FILE", required_unless_present_any = ["all", "bundle"])]
    out: Option<PathBuf>,
    #[command(flatten)]
    folder: FolderOptions,
}

/// Options for the blocks of all relays.
#[derive(Args, Debug)]
struct FolderOptions {
    /// Write the blocks of all relays, relay1.bin and so on, and summary.txt: all of them, or none
    #[arg(long, conflicts_with_all = ["index", "out"])]
    all: bool,
    /// Output folder for the blocks of all relays; created if necessary
    #[arg(long, value_name = "DIR", requires = "all")]
    out_dir: Option<PathBuf>,
    /// New folder for the files of Linux computers, in place of blocks
    ///
    /// It has a folder for each drone with its configuration, key, unit, udev rules, autopilot parameters and a page to print, and one for
    /// the ground station. Without a key file a new key is made. With --index only that drone's folder and the ground station's. An existing
    /// folder is never overwritten
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "out_dir", "force", "epoch", "samples", "speed", "in_range", "wires", "rounds", "explore_m", "baud", "probe_after_ms"])]
    bundle: Option<PathBuf>,
    /// Overwrite blocks that are in that folder
    #[arg(long, requires = "out_dir")]
    force: bool,
}

/// Method that finds the places.
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

/// Prints which options replace values of the scenario's section `network`.
fn overridden(options: &Options, section: &Network, key_file: Option<&Path>, name: &str) {
    let say = |option: &str, key: &str| {
        command::print_line(&format!(
            "{option} is used instead of network.{key} in {name}"
        ));
    };
    if let (Some(given), Some(own)) = (options.probe_after_ms, section.probe_after_ms)
        && given != own
    {
        say(
            &format!("--probe-after-ms {given}"),
            &format!("probe_after_ms = {own}"),
        );
    }
    if let (Some(own), Some(id)) = (options.network, section.id)
        && own != id
    {
        say(&format!("--network {own}"), &format!("id = {id}"));
    }
    if let (Some(own), Some(relays)) = (options.uavs, section.relays)
        && own != relays
    {
        say(&format!("--uavs {own}"), &format!("relays = {relays}"));
    }
    if let (Some(own), Some(file)) = (&options.key_file, key_file)
        && own != file
    {
        let key = format!("key_file = \"{}\"", file.display());
        say(&format!("--key-file {}", own.display()), &key);
    }
}

/// Returns the method to provision: `method`, else the method of the section `network`, else `align`.
///
/// `method` is from the command line, or from the scenario's plan if `is_planned`. `of_file` is the method of the
/// section. If both are given and differ, a method from the plan is an error; a method from the command line is used,
/// and a message is printed.
fn chosen_method(
    method: Option<Method>,
    of_file: Option<&str>,
    name: &str,
    is_planned: bool,
) -> Result<Method, String> {
    let Some(text) = of_file else {
        return Ok(method.unwrap_or(Method::Align));
    };
    // The check of the scenario has accepted this name.
    let own = Method::from_str(text, false).unwrap_or(Method::Align);
    match method {
        Some(method) if method != own => {
            let said = format!("{method:?}").to_lowercase();
            if is_planned {
                return Err(format!(
                    "{name}: network.method = \"{text}\": must be \"{said}\", the method of its [plan]; or run `cargo plan --out` again"
                ));
            }
            command::print_line(&format!(
                "--method {said} is used instead of network.method = \"{text}\" in {name}"
            ));
            Ok(method)
        }
        _ => Ok(own),
    }
}
