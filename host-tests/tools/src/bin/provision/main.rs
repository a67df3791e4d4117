//! `cargo provision`: writes the configuration block of one drone, or of all, from a scenario.

mod network;
mod options;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Parser as _;
use uav_relay::{Adjust, ChannelLoad, Duration, Local, Measure};
use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::{Interference, PlannedMethod, Scenario, key, mission};
use uav_relay_sim::command::{self, Failure};
use uav_relay_tools::plan::flown::{Flown, flown};
use uav_relay_tools::plan::stored_plan::is_current;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::{ADDRESS, LEN, Secret};
use uav_relay_tools::provision::summary::{Heading, summary};
use uav_relay_tools::provision::{firmware, folder};

use options::{Method, Options};

/// Options, completed with values of the scenario and its plan.
struct Asked<'a> {
    options: &'a Options,
    scenario: Scenario,
    name: String,
    network: u16,
    key_file: Option<PathBuf>,
    uavs: u16,
    method: Method,
    tolerance: f64,
    /// Silence before a neighbour is probed, ms; 0 for the default.
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
    if let Some(line) = mission::left_out(scenario, *uavs) {
        return Err(format!("{name}: {line}"));
    }
    let secret = asked.secret()?;
    let flight = asked.flight(secret)?;
    let flown = asked.flown()?;
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
        (_, _, Some(dir)) => asked.folder(&flight, flown.as_ref(), dir)?,
        _ => {
            return Err(
                "--index and --out, or --all and --out-dir: one of both is needed".to_owned(),
            );
        }
    };
    if secret.is_none() {
        command::complain(
            "no --key-file: frames are not signed, and anybody in range can send frames",
        );
    }
    Ok(said)
}

impl<'a> Asked<'a> {
    fn new(options: &'a Options) -> Result<Self, String> {
        let (
            scenario,
            Deployment {
                network: section, ..
            },
        ) = match &options.scenario {
            Some(file) => Deployment::load(file).map_err(|error| error.to_string())?,
            None => Default::default(),
        };
        // A path in the file is relative to its folder.
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
        let other = |option: &str, has: &str| {
            format!("{option}: {name} has a [plan] with {has}; leave the option out, or plan again")
        };
        let uavs = match (options.uavs, plan) {
            (Some(uavs), Some(plan)) if uavs != plan.uavs => {
                return Err(other(
                    &format!("--uavs {uavs}"),
                    &format!("uavs = {}", plan.uavs),
                ));
            }
            (_, Some(plan)) => plan.uavs,
            (uavs, None) => uavs.or(section.relays).ok_or_else(|| {
                format!(
                    "--uavs: is missing, and so are [plan] and network.relays in {name}; allowed: 1 to 1000"
                )
            })?,
        };
        let planned = plan.map(|plan| match plan.method {
            PlannedMethod::Align => Method::Align,
            PlannedMethod::Joint => Method::Joint,
        });
        network::overridden(options, &section, of_file.as_deref(), &name);
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
        let method = network::method(method, of_section, &name, planned.is_some())?;
        let probe_after_ms = firmware::probe_after_ms(&section, options.probe_after_ms, &name)?;
        let tolerance = match (options.tolerance, plan) {
            (Some(tolerance), Some(plan)) if tolerance.total_cmp(&plan.tolerance).is_ne() => {
                return Err(other(
                    &format!("--tolerance {tolerance:?}"),
                    &format!("tolerance = {:?}", plan.tolerance),
                ));
            }
            (tolerance, plan) => tolerance
                .or(plan.map(|plan| plan.tolerance))
                .unwrap_or(1e-4),
        };
        for (option, given) in [
            ("--rounds", options.rounds.is_some()),
            ("--explore", options.explore_m.is_some()),
        ] {
            if given && method != Method::Adjust {
                return Err(format!("{option}: is for --method adjust"));
            }
        }
        Ok(Self {
            options,
            scenario,
            name,
            network: options.network.or(section.id).unwrap_or(NETWORK),
            key_file: options.key_file.clone().or(of_file),
            uavs,
            method,
            tolerance,
            probe_after_ms,
        })
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
        let [probe_after, _] = firmware::silence(self.probe_after_ms);
        carried(options, self.uavs, probe_after)?;
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
        Ok(flight
            .by(method)
            .signed(secret)
            .signed_to_autopilots(autopilot_key)
            .measuring(measure(options, &self.scenario)?)
            .asking_after(self.probe_after_ms))
    }

    /// Returns the positions that the relays settle on, if needed. Rejects a hypothetical interferer that loses too much.
    fn flown(&self) -> Result<Option<Flown>, String> {
        let is_plain = matches!(&self.scenario.interference, Interference::Sources(sources) if sources.len() == 1);
        let is_several = matches!(&self.scenario.interference, Interference::Sources(sources) if sources.len() > 1);
        if self.options.stand_in && !is_several {
            return Err("--stand-in: is for a scenario with several [[interferer]]".to_owned());
        }
        if !self.scenario.knows_interference()
            || is_plain && !self.options.folder.all && self.scenario.plan.is_none()
        {
            return Ok(None);
        }
        let method = match self.method {
            Method::Joint => PlannedMethod::Joint,
            // `adjust` starts from these.
            Method::Align | Method::Adjust => PlannedMethod::Align,
        };
        // Relays report by themselves that they settle on nothing.
        let Ok(flown) = flown(&self.scenario, self.uavs, method, self.tolerance) else {
            return match self.scenario.plan {
                Some(_) => Err(format!(
                    "{}: [plan] is of another scenario: relays in this one reach no agreement",
                    self.name
                )),
                None => Ok(None),
            };
        };
        if let Some(plan) = &self.scenario.plan {
            is_current(plan, &flown).map_err(|why| format!("{}: {why}", self.name))?;
        }
        if flown.is_poor() {
            let line = format!("{}: {}", self.name, flown.describe());
            if flown.stand_in && !self.options.stand_in {
                return Err(format!("{line}; --stand-in writes it all the same"));
            }
            command::complain(&line);
        }
        Ok(Some(flown))
    }

    fn secret(&self) -> Result<Option<Secret>, String> {
        let Some(file) = &self.key_file else {
            return match self.options.epoch {
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
        let epoch = self.options.epoch.or_else(seconds);
        Ok(Some(Secret {
            key: key::load("--key-file", file)?,
            epoch: epoch.ok_or("--epoch: is needed where the clock says no time")?,
        }))
    }

    fn folder(&self, flight: &Flight, flown: Option<&Flown>, dir: &Path) -> Result<String, String> {
        let heading = Heading {
            scenario: self.name.clone(),
            uavs: self.uavs,
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
        let text = summary(&heading, places, self.scenario.line.as_ref());
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

/// Rejects a channel too slow for the relays when a silent neighbour is probed after `probe_after`.
fn carried(options: &Options, uavs: u16, probe_after: Duration) -> Result<(), String> {
    if options.wires {
        return Ok(());
    }
    let in_range = options.in_range.unwrap_or(uavs).min(uavs);
    command::carries(options.baud, ChannelLoad::of_radios(in_range), probe_after)
        .map_err(|error| format!("{error}; fewer with --in-range, none with --wires"))
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
