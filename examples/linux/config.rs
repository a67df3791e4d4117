//! Reader of the `--config` file of all tools. Its keys become options in front of the command line's.
//!
//! Every number therefore has one name and one check, and the command line overrides the file.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum as _};
use serde_json::json;
use uav_relay::{Channel, Instant, Interference, Placement, Profile};
use uav_relay_scenario::deployment::{COMPANION_TOLERANCE, Deployment};
use uav_relay_scenario::endpoint::FORM;
use uav_relay_scenario::mission;
use uav_relay_scenario::{PlannedPlace, Scenario, TerrainSpec};

use crate::log::Log;
use crate::mission::Method;
use crate::site::degrees;

/// Settings of the `--config` file for which the command line has no option.
#[derive(Clone, Debug, Default)]
pub struct FileOnlySettings {
    /// Path-loss parameters of the file; `None` for the default, the paper's channel.
    pub channel: Option<Channel>,
    /// Interference as a function of x (position along the line Tx to Rx), if the file gives it.
    pub field: Option<Interference>,
    /// Profiles (altitude and power) of single relays, with the relay's index.
    pub profiles: Vec<(u16, Profile)>,
    /// Indices of the relays with a fixed altitude. The placement method chooses the altitudes of all other relays.
    pub held: Vec<u16>,
    /// Positions that the plan in the file gives to the relays; empty if the file has no plan.
    pub places: Vec<Placement>,
    /// Elevation model of the terrain below the line from Tx to Rx, if the file has one.
    pub terrain: Option<TerrainSpec>,
    /// Options of the command line that override the file.
    pub overrides: Vec<Override>,
}

impl FileOnlySettings {
    /// Rejects `--altitude` and `--uav-power` if relay `index` has its own `[[relay]]` profile in the file.
    ///
    /// A relay with such a profile would ignore these two options.
    ///
    /// # Errors
    /// One line that names the option and the file's table.
    pub fn check_profile_options(&self, index: u16) -> Result<(), String> {
        let is_passed_over =
            |one: &&Override| one.has_name("--altitude") || one.has_name("--uav-power");
        self.overrides.iter().find(is_passed_over).map_or(Ok(()), |one| {
            Err(format!(
                "{}: has no effect, because the --config file has a [[relay]] for relay {index}: give the value there",
                one.option
            ))
        })
    }
}

/// Command-line option that overrides a value in the file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Override {
    /// Option on the command line and its value, as one text.
    pub option: String,
    /// Overridden value in the file.
    pub file_value: String,
    file: String,
}

impl Override {
    /// Returns true if the option on the command line has this name.
    #[must_use]
    pub fn has_name(&self, name: &str) -> bool {
        self.option.split(' ').next() == Some(name)
    }
}

/// Section of the file that `--interferer` and `--field` override.
const FIELD_SECTION: &str = "[field]";

/// Logs a line for each override, so that ignored values of the file are noticed.
pub fn log_overrides(overrides: &[Override], log: &Log) {
    for one in overrides {
        let Override {
            option,
            file_value: instead,
            file,
        } = one;
        let kind = match instead.as_str() {
            FIELD_SECTION => "the section ",
            other if other.starts_with("--") => "",
            _ => "the value ",
        };
        log.event(
            Instant::ZERO,
            "override",
            json!({ "option": option, "instead_of": instead, "file": file }),
            format_args!("{option} is used instead of {kind}{instead} in {file}"),
        );
    }
}

/// Options given by the `--config` file: name and value of each. The value is `None` for a flag, which takes none.
#[derive(Debug, Default)]
pub struct FileOptions {
    options: Vec<(&'static str, Option<OsString>)>,
    folder: PathBuf,
}

impl FileOptions {
    /// Adds an option if the file has a value for it.
    pub fn value(&mut self, name: &'static str, value: Option<impl ToString>) {
        let value = value.map(|value| value.to_string().into());
        self.options.extend(value.map(|value| (name, Some(value))));
    }

    /// Adds an option whose value is a path relative to the file's folder, if the file has this option.
    pub fn path(&mut self, name: &'static str, path: Option<&PathBuf>) {
        let path = path.map(|path| self.folder.join(path).into_os_string());
        self.options.extend(path.map(|path| (name, Some(path))));
    }

    /// Adds an option whose value is a `udp:` address, or a path relative to the file's folder.
    pub fn path_or_udp(&mut self, name: &'static str, place: Option<&String>) {
        match place {
            Some(path) if !path.starts_with("udp:") => self.path(name, Some(&PathBuf::from(path))),
            other => self.value(name, other),
        }
    }

    /// Adds the option `name`, which takes no value, if `is` is true.
    pub fn flag(&mut self, name: &'static str, is: Option<bool>) {
        if is == Some(true) {
            self.options.push((name, None));
        }
    }

    /// Checks that an autopilot is named if the file has settings for one.
    fn has_autopilot(&self, line: &[OsString]) -> Result<(), String> {
        let file_value = |name: &str| self.options.iter().find(|(option, _)| *option == name);
        if file_value("--autopilot").is_some() || value_of(line, "--autopilot").is_some() {
            return Ok(());
        }
        let key = NEEDS_AUTOPILOT
            .iter()
            .find_map(|(option, key)| Some((key, file_value(option)?.1.as_ref()?)));
        key.map_or(Ok(()), |(key, value)| {
            Err(format!(
                "companion.{key} = {}: needs companion.autopilot (a tty, or {FORM}): add companion.autopilot, or leave {key} out",
                value.to_string_lossy()
            ))
        })
    }

    /// Removes the file's options that are also on the command line, or excluded by an option there.
    ///
    /// Returns the remaining options, and the overrides: the removed options whose values differ from the command line.
    fn without_overridden(mut self, line: &[OsString], file: &str) -> (Self, Vec<Override>) {
        let mut overrides = Vec::new();
        self.options.retain(|(name, value)| {
            let others = EXCLUDES
                .iter()
                .filter(|(_, others)| others.contains(name))
                .map(|(one, _)| *one);
            let Some(overriding) = std::iter::once(*name)
                .chain(others)
                .find_map(|one| Some((one, value_of(line, one)?)))
            else {
                return true;
            };
            let value = value.as_ref().map(|value| value.to_string_lossy());
            let (option, given) = overriding;
            let same = option == *name && is_same(&given, value.as_deref().unwrap_or_default());
            let instead = match value {
                Some(value) if option == *name => value.into_owned(),
                Some(value) => format!("{name} {value}"),
                None => (*name).to_owned(),
            };
            if !same {
                overrides.push(Override {
                    option: format!("{option} {given}"),
                    file_value: instead,
                    file: file.to_owned(),
                });
            }
            false
        });
        (self, overrides)
    }
}

/// Returns the value of the option `name` on the command line, if the option is given.
///
/// The value is empty if no word follows the option on the command line.
fn value_of(line: &[OsString], name: &str) -> Option<String> {
    let with_value = format!("{name}=");
    line.iter().enumerate().find_map(|(at, word)| {
        let word = word.to_string_lossy();
        if word == name {
            let next = line.get(at + 1).map(|word| word.to_string_lossy());
            return Some(next.unwrap_or_default().into_owned());
        }
        word.strip_prefix(&with_value).map(ToOwned::to_owned)
    })
}

/// Returns true if two values of an option are the same text or the same numbers.
///
/// An empty `other` also counts as the same: it means that no word follows the option on the command line.
fn is_same(one: &str, other: &str) -> bool {
    let numbers = |text: &str| -> Option<Vec<u64>> {
        let numbers = text.split(',').map(|part| part.trim().parse::<f64>().ok());
        numbers.map(|number| Some(number?.to_bits())).collect()
    };
    // `other` is empty if nothing follows the option.
    one == other || other.is_empty() || numbers(one).is_some_and(|one| Some(one) == numbers(other))
}

/// Options that have an effect only with an autopilot, and their keys in the file.
const NEEDS_AUTOPILOT: [(&str, &str); 6] = [
    ("--autopilot-baud", "autopilot_baud"),
    ("--autopilot-key-file", "autopilot_key_file"),
    ("--speed", "speed_m_s"),
    ("--flight-time", "flight_time_s"),
    ("--return-speed", "return_speed_m_s"),
    ("--descent", "descent_m_s"),
];

/// Options of the command line, each with the options of the file that it excludes and removes.
const EXCLUDES: [(&str, &[&str]); 6] = [
    ("--shared", &["--upstream", "--downstream"]),
    ("--upstream", &["--shared"]),
    ("--downstream", &["--shared"]),
    ("--interferer", &["--field"]),
    ("--field", &["--interferer"]),
    (
        "--positions",
        &[
            "--autopilot",
            "--autopilot-baud",
            "--autopilot-key-file",
            "--speed",
            "--flight-time",
            "--return-speed",
            "--descent",
        ],
    ),
];

/// Merges the options of the `--config` file into the command line.
///
/// Returns the arguments (first those of the file, then those of the command line), and the settings that only a file
/// can give. `section` adds the options from the section of the file that only this program reads, such as
/// `[companion]`.
///
/// # Errors
/// One line that states the fault in the file.
pub fn read<T: Parser>(
    section: fn(&Deployment, &mut FileOptions),
) -> Result<(Vec<OsString>, FileOnlySettings), String> {
    let mut words = std::env::args_os();
    let program = words.next().unwrap_or_default();
    let line: Vec<OsString> = words.collect();
    let Some(file) = named(&line) else {
        return Ok((
            std::iter::once(program).chain(line).collect(),
            FileOnlySettings::default(),
        ));
    };
    let (scenario, deployment) =
        Deployment::load(&file).map_err(|error| format!("--config {error}"))?;
    let mut given = FileOptions {
        folder: file.parent().map(Path::to_owned).unwrap_or_default(),
        ..FileOptions::default()
    };
    let has = T::command();
    let file_only = mission_options(&scenario, &mut given)
        .map_err(|error| format!("--config {}: {error}", file.display()))?;
    let method = value_of(&line, "--method").or_else(|| deployment.network.method.clone());
    // A wrong name is rejected with the other options.
    let method = method.and_then(|name| Method::from_str(&name, false).ok());
    if method == Some(Method::Joint) {
        fitted_slots(&scenario, &mut given)
            .map_err(|error| format!("--config {}: {error}", file.display()))?;
    }
    section(&deployment, &mut given);
    given.options.retain(|(name, _)| {
        has.get_arguments()
            .any(|arg| arg.get_long() == name.strip_prefix("--"))
    });
    let name = file.display().to_string();
    let (given, mut overrides) = given.without_overridden(&line, &name);
    if file_only.field.is_some() {
        for option in ["--interferer", "--field"] {
            overrides.extend(value_of(&line, option).map(|value| Override {
                option: format!("{option} {value}"),
                file_value: FIELD_SECTION.to_owned(),
                file: name.clone(),
            }));
        }
    }
    given
        .has_autopilot(&line)
        .map_err(|error| format!("--config {name}: {error}"))?;
    let file_only = FileOnlySettings {
        overrides,
        ..file_only
    };
    let words = given
        .options
        .into_iter()
        .flat_map(|(name, value)| std::iter::once(name.into()).chain(value));
    Ok((
        std::iter::once(program).chain(words).chain(line).collect(),
        file_only,
    ))
}

fn named(line: &[OsString]) -> Option<PathBuf> {
    line.iter().enumerate().find_map(|(at, word)| {
        if word == "--config" {
            return line.get(at + 1).map(PathBuf::from);
        }
        let word = word.to_str()?;
        word.strip_prefix("--config=").map(PathBuf::from)
    })
}

/// Adds the SNR gap of fitted time slots to the options `given`, if the scenario has such slots.
///
/// A fitted time slot is as long as its hop needs. Without fitted slots all slots are equal.
fn fitted_slots(scenario: &Scenario, given: &mut FileOptions) -> Result<(), String> {
    let error = |refusal: mission::Refusal| refusal.to_string();
    let (mission, _) = mission::mission(scenario, 1, COMPANION_TOLERANCE).map_err(error)?;
    let mission = mission::with_access(scenario, &mission).map_err(error)?;
    let gap = mission.fitted_gap();
    given.value("--fitted-gap", (gap > 0.0).then_some(gap));
    Ok(())
}

/// Adds the mission of the file to the options `given`. Returns the file's settings that have no option.
fn mission_options(
    scenario: &Scenario,
    given: &mut FileOptions,
) -> Result<FileOnlySettings, String> {
    // The mission is built for one relay, because the number of relays is in a different section or on the command
    // line.
    let (mission, profiles) =
        mission::mission(scenario, 1, COMPANION_TOLERANCE).map_err(|error| error.to_string())?;
    let config = mission.config();
    if let Some(line) = &scenario.line {
        let [tx, rx] = line.sites;
        given.value("--site-tx", Some(degrees(tx)));
        given.value("--site-rx", Some(degrees(rx)));
    }
    given.value("--distance", Some(config.distance_m));
    given.value("--altitude", Some(config.common.altitude_m));
    let (band, lateral) = (config.band, config.lateral);
    // A single altitude is given by `--altitude` alone.
    let is_band = band.least_m < band.most_m;
    let ends = format!("{},{}", band.least_m, band.most_m);
    given.value("--band", is_band.then_some(ends));
    given.value("--lateral-min-m", Some(lateral.least_m));
    given.value("--lateral-max-m", Some(lateral.most_m));
    given.value("--tx-power", Some(config.tx_power_w));
    given.value("--uav-power", Some(config.common.power_w));
    given.value("--noise", Some(config.noise_w));
    if config.reverse > 0.0 {
        given.value("--reverse", Some(config.reverse));
        given.value("--rx-power", Some(config.rx_power_w));
    }
    given.value("--min-separation", Some(config.min_separation_m));
    let mut field = None;
    match config.interference {
        Interference::Source(one) => {
            let one = format!("{},{},{}", one.power_w, one.x_m, one.y_m);
            given.value("--interferer", Some(one));
        }
        Interference::Unknown => given.value("--interferer", Some("unknown")),
        other @ Interference::Field(_) => field = Some(other),
    }
    if let Some(listen) = &scenario.listen {
        given.flag("--listen", Some(true));
        given.flag("--following", Some(listen.following));
        given.value("--listen-every", listen.every_s);
        given.value("--listen-half-life", listen.half_life_s);
        given.value("--listen-error", listen.relative_error);
    }
    let held = mission::fixed_altitude_relays(scenario, 1_000);
    let profiles = if scenario.relays.is_empty() {
        profiles
    } else {
        let (_, all) = mission::mission(&without_separation(scenario), 1_000, COMPANION_TOLERANCE)
            .map_err(|error| error.to_string())?;
        all
    };
    Ok(FileOnlySettings {
        channel: Some(config.channel),
        field,
        profiles,
        held,
        places: scenario
            .plan
            .iter()
            .flat_map(|plan| &plan.places)
            .map(place)
            .collect(),
        terrain: scenario.terrain.clone(),
        overrides: Vec::new(),
    })
}

#[expect(clippy::cast_possible_truncation, reason = "metres of a mission")]
fn place(planned: &PlannedPlace) -> Placement {
    let [x_m, y_m, altitude_m] =
        [planned.x_m, planned.y_m, planned.altitude_m].map(|metres| metres as f32);
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}

/// Returns the scenario with a minimum separation of 0 m, so that any number of relays fits.
fn without_separation(scenario: &Scenario) -> Scenario {
    Scenario {
        min_separation_m: 0.0,
        ..scenario.clone()
    }
}

/// Checks `--flying`, the number of relays that are meant to fly, of a fleet of `of` relays.
///
/// # Errors
/// The option with its value and range.
pub fn check_flying(flying: Option<u16>, of: u16) -> Result<(), String> {
    let least = of / 2 + 1;
    let wrong = flying.filter(|flying| !(least..=of).contains(flying));
    wrong.map_or(Ok(()), |flying| {
        Err(format!(
            "--flying {flying}: must be within {least} to {of}, more than half of --of"
        ))
    })
}

/// Adds the options of the file's `[network]` section, which every program reads.
pub fn network(deployment: &Deployment, given: &mut FileOptions) {
    let network = &deployment.network;
    given.value("--network", network.id);
    given.value("--of", network.relays);
    given.path("--key-file", network.key_file.as_ref());
    given.value("--method", network.method.as_ref());
    given.value("--baud", network.baud);
    given.value("--probe-after-ms", network.probe_after_ms);
    given.value("--dead-after-ms", network.dead_after_ms);
}
