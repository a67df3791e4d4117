//! `cargo plan`: number, positions and expected SIRs of relays, before flight.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, ValueEnum};
use uav_relay_scenario::deployment::{Companion, Deployment};
use uav_relay_scenario::link::{Access, BandwidthError, Radio};
use uav_relay_scenario::{DEFAULT, Interference, PlannedMethod, Scenario, mission};
use uav_relay_sim::command::{Failure, number, whole};
use uav_relay_sim::report::counted;
use uav_relay_sim::svg::{Picture, lateral_view};
use uav_relay_sim::{command, svg};
use uav_relay_terrain::report::TerrainReport;
use uav_relay_tools::figures::draw::draw;
use uav_relay_tools::plan;
use uav_relay_tools::plan::area::{self, AreaReport, Criterion};
use uav_relay_tools::plan::area_map::{self, Shown};
use uav_relay_tools::plan::carried::Carried;
use uav_relay_tools::plan::flown::{
    Flown, flown, moved, planned, with_altitudes, with_files, with_plan,
};
use uav_relay_tools::plan::locating::Locating;
use uav_relay_tools::plan::map::{Map, geojson, kml};
use uav_relay_tools::plan::over_terrain::{self, OverTerrain};
use uav_relay_tools::plan::rate::{Rate, Rates};
use uav_relay_tools::plan::report::{FleetReport, PlanReport, RateReport};
use uav_relay_tools::plan::terrain::{Elevation, POSITION_ERROR_M, chart};
use uav_relay_tools::plan::terrain_flight::{self, Flight, no_fly_warnings};
use uav_relay_tools::plan::{NoPlan, Number, Plan, PlanRequest, Unit, Why};
use uav_relay_tools::provision::block::probe_after_ms;

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(settled(options).and_then(|options| run(&options))),
        Err(error) => command::usage(&error),
    }
}

/// Returns the options, with `--uavs` from `fleet.flying` of the scenario if nothing is requested.
fn settled(mut options: Options) -> Result<Options, Failure> {
    let Wanted {
        uavs,
        target_sir,
        target_sir_db,
        target_rate_bps,
    } = options.wanted;
    if uavs.is_none() && [target_sir, target_sir_db, target_rate_bps] == [None; 3] {
        options.wanted.uavs = deployment(&options)?.fleet.flying;
        if options.wanted.uavs.is_none() {
            let line = "one of --uavs, --target-sir, --target-sir-db and --target-rate-bps is required, unless the scenario has fleet.flying";
            return Err(Failure::input(line.to_owned()));
        }
    }
    Ok(options)
}

fn run(options: &Options) -> Result<(), Failure> {
    let scenario = match &options.scenario {
        Some(file) => Scenario::load(file).map_err(|error| Failure::input(error.to_string()))?,
        None => Scenario::default(),
    };
    if !scenario.knows_interference() {
        let line = "[[interferer]]: is missing: only `cargo provision` accepts a scenario with [listen] and without [[interferer]]";
        return Err(Failure::input(line.to_owned()));
    }
    let sections = deployment(options)?;
    sections
        .check_identical(&options.file(), &scenario)
        .map_err(|error| Failure::input(error.to_string()))?;
    let number = options.number();
    check_area(options, &scenario)?;
    check_target(options, &scenario)?;
    check_out(options, &scenario)?;
    check_map(options, &scenario)?;
    let elevation = elevation(options, &scenario)?;
    let ask = PlanRequest {
        number,
        free_altitude: options.altitude != Altitude::Given,
        x_m: options.x_m,
        tolerance: options.tolerance,
    };
    let radio = radio(options, &scenario)?;
    let planned = planned_by(options, &scenario, &ask, elevation.as_ref(), radio.as_ref());
    let listed = |mut rates: RateReport| {
        if !options.rates {
            rates.rates.clear();
        }
        rates
    };
    match planned {
        Ok(Planned {
            plan: Some(plan),
            number,
            rates,
        }) => {
            let planned = (&plan, number, rates.map(listed));
            report(
                options,
                &scenario,
                &ask,
                planned,
                (elevation.as_ref(), radio.as_ref()),
            )
        }
        Ok(Planned {
            plan: None, rates, ..
        }) => {
            let report = slower(rates.map(listed), options);
            show(options, &report.in_noise(&scenario.noise))
        }
        Err(NoPlan::Wrong(line)) => {
            let file = options.file();
            let about_an_option = line.starts_with("--");
            Err(Failure::input(if about_an_option {
                line
            } else {
                format!("{file}: {line}")
            }))
        }
        Err(NoPlan::Unmet(why, best_sir)) => show(
            options,
            &PlanReport::unmet(&why, best_sir, number, options.unit()).in_noise(&scenario.noise),
        ),
    }
}

/// Writes the files of a plan, and prints its report.
fn report(
    options: &Options,
    scenario: &Scenario,
    ask: &PlanRequest,
    (plan, number, rates): (&Plan, Number, Option<RateReport>),
    (elevation, radio): (Option<&Elevation>, Option<&Radio>),
) -> Result<(), Failure> {
    let uavs = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
    if let Some(line) = mission::undescribed_relay_error(scenario, uavs) {
        return Err(Failure::input(format!("{}: {line}", options.file())));
    }
    if let Some(file) = &options.svg {
        command::write(file, &svg::draw(&picture(plan, scenario)))?;
    }
    let (terrain, error) = terrain(options, scenario, elevation, (plan, number))?;
    let error = joined([error, no_fly(options, scenario, plan)]);
    if error.is_none() && options.area.allow_crossing {
        let is_free = options.altitude == Altitude::Free;
        if let Some(line) = area::problem(scenario, &plan.chain(), is_free, false) {
            let line = line.replace(area::ACCEPTS, "; accepted by --allow-crossing");
            command::print_line(&format!("warning: {line}"));
        }
    }
    let locating = over_area(options, scenario, plan)?;
    write_map(options, scenario, plan, terrain.as_ref())?;
    let known = elevation.zip(terrain.as_ref());
    let Flying {
        next,
        flight,
        unknown,
        problem,
    } = match (&error, &options.out) {
        (Some(_), _) => Flying::default(),
        (None, Some(file)) => write_out(options, file, scenario, (plan, number), radio, known)?,
        (None, None) => flying(options, scenario, plan, known),
    };
    let error = error.or(problem);
    let known = known.filter(|_| options.altitude == Altitude::Terrain);
    let over_terrain = known.map(|known| compared(scenario, ask, known));
    let report = PlanReport::new(plan, number, options.unit())
        .with_way_back(scenario, plan)
        .with_rates(rates)
        .in_noise(&scenario.noise)
        .above(terrain, error);
    show(
        options,
        &PlanReport {
            over_terrain,
            flight,
            flight_not_simulated: unknown,
            locating,
            area: AreaReport::new(scenario, ask, plan, options.area.quantile),
            fleet: FleetReport::new(deployment(options)?.fleet_size(), uavs),
            ..report
        },
    )?;
    if !options.json {
        command::print(&next);
    }
    Ok(())
}

/// Plans by the method that the options and the scenario need.
fn planned_by(
    options: &Options,
    scenario: &Scenario,
    ask: &PlanRequest,
    elevation: Option<&Elevation>,
    radio: Option<&Radio>,
) -> Result<Planned, NoPlan> {
    match (options.wanted.target_rate_bps, radio) {
        _ if options.altitude == Altitude::Terrain => {
            above_terrain(scenario, ask, elevation, radio)
        }
        (Some(target_bps), Some(radio)) => by_rate(scenario, ask, radio, target_bps),
        (_, None) if !scenario.areas.is_empty() || !scenario.no_fly.is_empty() => {
            let criterion = Criterion {
                quantile: options.area.quantile,
                allow_crossing: options.area.allow_crossing,
            };
            area::plan(scenario, ask, criterion).map(|plan| Planned {
                plan: Some(plan),
                number: ask.number,
                rates: None,
            })
        }
        (_, radio) => plain(scenario, ask, radio),
    }
}

/// Returns the report on a requested data rate that no number of relays carries.
fn slower(rates: Option<RateReport>, options: &Options) -> PlanReport {
    let error = rates.as_ref().map(too_fast).unwrap_or_default();
    let why = Why::Plain(error);
    PlanReport {
        uavs: None,
        ..PlanReport::unmet(&why, None, Number::Of(0), options.unit())
    }
    .with_rates(rates)
}

/// Result of planning: the plan, the requested number of relays, and the data rates.
struct Planned {
    /// Planned positions; `None` if no number of relays carries the requested data rate.
    plan: Option<Plan>,
    number: Number,
    rates: Option<RateReport>,
}

/// Returns the data link from which the data rates are computed.
///
/// `None` if no option requests data rates and the scenario has no section `[link]`.
fn radio(options: &Options, scenario: &Scenario) -> Result<Option<Radio>, Failure> {
    let target_bps = options.wanted.target_rate_bps;
    let is_asked = options.rates || target_bps.is_some() || options.bandwidth_hz.is_some();
    if !is_asked && scenario.link.is_none() {
        return Ok(None);
    }
    let refused = |error: BandwidthError| {
        let asked = match (error, target_bps, options.rates) {
            (BandwidthError::Contradicts { .. }, ..) => options.file(),
            (_, Some(target_bps), _) => format!("--target-rate-bps {target_bps:?}"),
            (_, None, true) => "--rates".to_owned(),
            (_, None, false) => format!("{}: link", options.file()),
        };
        Failure::input(format!("{asked}: {error}"))
    };
    let radio = Radio::new(scenario, options.bandwidth_hz).map_err(refused)?;
    Ok(Some(radio))
}

/// Plans a given number of relays, or the fewest for a target SIR. With `radio`, adds the data rates.
fn plain(scenario: &Scenario, ask: &PlanRequest, radio: Option<&Radio>) -> Result<Planned, NoPlan> {
    let most = match ask.number {
        Number::Of(relays) => relays,
        Number::Meeting(_) => 1,
    };
    let by_rate = radio.and_then(|radio| Carried::new(scenario, ask, radio, most));
    let plan = match (by_rate, ask.number) {
        (Some(by_rate), Number::Of(relays)) => by_rate.proven(by_rate.plan(relays)?),
        _ => plan::plan(scenario, ask)?,
    };
    let rates = match radio {
        Some(radio) => {
            let Rates { best, all, .. } = Rates::new(scenario, ask, radio, None)?;
            let link = (scenario, radio);
            Some(RateReport::new(Some(&plan), link, None, best, all))
        }
        None => None,
    };
    Ok(Planned {
        plan: Some(plan),
        number: ask.number,
        rates,
    })
}

/// Plans a given number of relays with the diffraction losses of the terrain.
fn above_terrain(
    scenario: &Scenario,
    ask: &PlanRequest,
    elevation: Option<&Elevation>,
    radio: Option<&Radio>,
) -> Result<Planned, NoPlan> {
    let wrong = |line: &str| NoPlan::Wrong(format!("--altitude terrain: {line}"));
    let elevation =
        elevation.ok_or_else(|| wrong("needs elevation files: --dem FILE, or terrain.files"))?;
    let Number::Of(relays) = ask.number else {
        return Err(wrong(
            "needs --uavs N, because it cannot be used in a search for the number of relays",
        ));
    };
    if radio.is_some() {
        return Err(wrong(
            "has no data rates: leave out [link], --rates, --bandwidth-hz and --target-rate-bps",
        ));
    }
    Ok(Planned {
        plan: Some(over_terrain::best(
            scenario,
            elevation,
            relays,
            ask.tolerance,
        )?),
        number: ask.number,
        rates: None,
    })
}

/// Compares a plan over `terrain` with the plan that ignores the terrain.
fn compared(
    scenario: &Scenario,
    ask: &PlanRequest,
    (elevation, terrain): (&Elevation, &TerrainReport),
) -> OverTerrain {
    let blind = plan::plan(scenario, ask).map_err(|none| match none {
        NoPlan::Wrong(line) => line,
        NoPlan::Unmet(why, _) => why.say(Unit::Decibels),
    });
    match blind.and_then(|blind| elevation.report(scenario, &blind)) {
        Ok(blind) => OverTerrain {
            blind_sir_db: Some(blind.terrain_sir_db),
            terrain_gain_db: Some(terrain.terrain_sir_db - blind.terrain_sir_db),
            blind_problem: elevation.problem(&blind, false),
        },
        Err(line) => OverTerrain {
            blind_sir_db: None,
            terrain_gain_db: None,
            blind_problem: Some(line),
        },
    }
}

/// Reads the elevation files, and checks the options that need them.
fn elevation(options: &Options, scenario: &Scenario) -> Result<Option<Elevation>, Failure> {
    let has_files = scenario.terrain.is_some() || !options.terrain.dem.is_empty();
    let error_m = if has_files {
        deployment(options)?.companion.position_error_m
    } else {
        None
    };
    let error_m = error_m.map_or(POSITION_ERROR_M, f64::from);
    let elevation = Elevation::load(scenario, &options.terrain.dem, error_m).map_err(|line| {
        let file = if line.starts_with("site") {
            format!("{}: ", options.file())
        } else {
            String::new()
        };
        Failure::input(format!("{file}{line}"))
    })?;
    if let Some(elevation) = &elevation {
        let named = |line| Failure::input(format!("{}: {line}", options.file()));
        elevation.ground(scenario).map_err(named)?;
    } else if let Some(file) = &options.terrain.profile {
        return Err(Failure::input(format!(
            "--profile {}: needs elevation files: --dem FILE, or terrain.files",
            file.display()
        )));
    }
    Ok(elevation)
}

/// Returns the terrain below `plan`, and the reason to reject the plan, if there is one.
///
/// Both are `None` without elevation data. Draws the terrain for `--profile`.
fn terrain(
    options: &Options,
    scenario: &Scenario,
    elevation: Option<&Elevation>,
    (plan, number): (&Plan, Number),
) -> Result<(Option<TerrainReport>, Option<String>), Failure> {
    let Some(elevation) = elevation else {
        return Ok((None, None));
    };
    let (report, problem) = over(options, elevation, scenario, plan)?;
    if let Some(file) = &options.terrain.profile {
        let drawing = draw(&chart(&report, scenario), "profile of the chain");
        let drawing = drawing.map_err(|error| Failure::input(format!("--profile: {error:?}")))?;
        save(file, "--profile", &drawing)?;
    }
    let missed = match number {
        Number::Meeting(target) if report.terrain_sir < target * (1.0 - options.tolerance) => {
            Some(format!(
                "with terrain the worst hop has {:.2} dB, below the target of {:.2} dB, because --target-sir searches without terrain: give --uavs and --altitude terrain",
                report.terrain_sir_db,
                db(target)
            ))
        }
        _ => None,
    };
    Ok((Some(report), problem.or(missed)))
}

/// Returns the terrain below `plan`, and the reason why the plan cannot be flown, if there is one.
fn over(
    options: &Options,
    elevation: &Elevation,
    scenario: &Scenario,
    plan: &Plan,
) -> Result<(TerrainReport, Option<String>), Failure> {
    let report = elevation
        .report(scenario, plan)
        .map_err(|line| Failure::input(format!("{}: {line}", options.file())))?;
    let problem = elevation.problem(&report, options.terrain.allow_blocked);
    Ok((report, problem))
}

fn by_rate(
    scenario: &Scenario,
    ask: &PlanRequest,
    radio: &Radio,
    target_bps: f64,
) -> Result<Planned, NoPlan> {
    let Rates { best, all, meeting } = Rates::new(scenario, ask, radio, Some(target_bps))?;
    let link = (scenario, radio);
    let rates = RateReport::new(meeting.as_ref(), link, Some(target_bps), best, all);
    let relays = meeting.as_ref().map_or(0, |plan| plan.places.len());
    Ok(Planned {
        plan: meeting,
        number: Number::Of(u16::try_from(relays).unwrap_or(u16::MAX)),
        rates: Some(rates),
    })
}

fn too_fast(rates: &RateReport) -> String {
    let target_bps = rates.target_rate_bps.unwrap_or_default();
    let tried = rates.best.tried_uavs;
    let among = if rates.best.best_is_proven {
        "no number of relays".to_owned()
    } else {
        format!("no number of relays from 1 to {tried}")
    };
    let shared = if rates.access == Access::Slots.name() {
        "all hops share one frequency in equal time slots"
    } else if rates.access == Access::Fitted.name() {
        "all hops share one frequency in time slots of different length, fitted to each hop"
    } else {
        "every hop has a frequency of its own"
    };
    format!(
        "--target-rate-bps {target_bps:?}: {among} carries this rate, if {shared}; {}. Give a lower rate, or a larger bandwidth than {:?} Hz",
        rates.largest(),
        rates.bandwidth_hz
    )
}

fn picture(plan: &Plan, scenario: &Scenario) -> Picture {
    Picture {
        title_method: plan.how.to_owned(),
        distance_m: f64::from(plan.mission.config().distance_m),
        interferers: scenario.sources(),
        nodes: plan
            .places
            .iter()
            .map(|(place, _)| (f64::from(place.x_m), f64::from(place.altitude_m)))
            .collect(),
        lateral_view: lateral_view(
            &plan.mission,
            plan.places.iter().map(|(place, _)| f64::from(place.y_m)),
            &scenario.sources(),
        ),
        hop_sir: plan.sirs.clone(),
        hop_sir_back: match plan.back {
            Some(_) => plan.sirs_back(scenario),
            None => Vec::new(),
        },
        reverse: scenario.reverse,
        ..Picture::default()
    }
}

/// Prints the report as a table or as JSON.
///
/// # Errors
/// The error message in the report, if the report has one.
fn show(options: &Options, report: &PlanReport) -> Result<(), Failure> {
    command::print(&if options.json {
        command::json(report)?
    } else {
        report.table()
    });
    match &report.error {
        None => Ok(()),
        Some(error) => Err(Failure::unmet(error.clone())),
    }
}

/// Computes how many relays a target SIR needs, or the best places for a given number. No messages are simulated.
#[derive(Parser, Debug)]
#[command(name = "plan", bin_name = "cargo plan", disable_version_flag = true)]
struct Options {
    /// Scenario file (TOML); without it the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    wanted: Wanted,
    /// Altitudes of the relays: fixed, free in the scenario's band, or chosen for the terrain. A fixed relay stays above the line at its altitude of the
    /// scenario. A free one may choose an altitude (geometry.altitude_min_m to altitude_max_m) and a place beside the line
    /// (geometry.lateral_min_m to lateral_max_m). With terrain the diffraction losses count, and the band is above the ground
    /// (terrain.above_ground_m to above_ground_max_m)
    #[arg(long, value_name = "A", value_enum, default_value_t = Altitude::Given)]
    altitude: Altitude,
    /// Required place of the only relay, metres from Tx; its altitude is chosen from the band. Needs --uavs 1
    #[arg(long, value_name = "X", allow_negative_numbers = true, conflicts_with = "altitude", value_parser = along)]
    x_m: Option<f64>,
    /// Bandwidth of one frequency, hertz, 1 to 1e12. The default is link.bandwidth_hz, or else noise.bandwidth_hz. Adds the data rate:
    /// that of the worst hop by the rate model of the scenario (link), by default log2(1 + SIR) bit/s per hertz, divided by the N + 1 time slots
    /// unless link.access is "channels" or "fitted"; and the number of relays with the largest data rate
    #[arg(long, value_name = "B", value_parser = |text: &str| number(text, 1.0, 1e12))]
    bandwidth_hz: Option<f64>,
    /// List the data rate of 1, 2, 3 and more relays, up to the number where no larger one can carry more. Needs a bandwidth
    #[arg(long)]
    rates: bool,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1
    #[arg(long, value_name = "T", default_value_t = 1e-4, value_parser = |text: &str| number(text, 1e-6, 0.1))]
    tolerance: f64,
    /// Print one JSON object on standard output and nothing else there
    #[arg(long)]
    json: bool,
    /// Draw the chain from the side, with each hop's SIR. A view from above is added where there is room or an interferer beside
    /// the line
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write sites, relays, hops and interferers with geographic coordinates for a map (GeoJSON). Needs a scenario with a site
    #[arg(long, value_name = "FILE")]
    geojson: Option<PathBuf>,
    /// Write the same for a globe (KML), with altitudes above the sea
    #[arg(long, value_name = "FILE")]
    kml: Option<PathBuf>,
    #[command(flatten)]
    terrain: TerrainOptions,
    #[command(flatten)]
    area: AreaOptions,
    /// Write the scenario with its plan, for cargo provision --scenario FILE --all
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite the file of --out
    #[arg(long, requires = "out")]
    force: bool,
}

/// Terrain below the chain.
#[derive(Args, Debug)]
struct TerrainOptions {
    /// Elevation file, GeoTIFF or SRTM (.hgt), in place of terrain.files; repeatable. Adds the state of each hop above the terrain, its
    /// diffraction loss (ITU-R P.526), and the heights of the relays above the ground. Needs a scenario with a site
    #[arg(long, value_name = "FILE")]
    dem: Vec<PathBuf>,
    /// Accept a plan with a blocked hop
    #[arg(long)]
    allow_blocked: bool,
    /// Draw ground, hops and their first Fresnel zones (SVG). Needs elevation files
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
}

/// Interferers that may be anywhere in an area, and no-fly areas.
#[derive(Args, Debug)]
struct AreaOptions {
    /// Maximise the SIR for this fraction of the interferer's positions and powers, 0.5 to 0.99
    ///
    /// Without the option the SIR counts for the interferer's worst position. Needs an interferer with an area
    #[arg(long, value_name = "Q", value_parser = |text: &str| number(text, 0.5, 0.99))]
    quantile: Option<f64>,
    /// Draw the SIR of the worst hop for each position of the interferer (SVG). Needs an interferer with an area
    #[arg(long, value_name = "FILE")]
    area_svg: Option<PathBuf>,
    /// Write the same as squares with geographic coordinates (GeoJSON), with the errors of --listen-svg. Needs a scenario with a site as well
    #[arg(long, value_name = "FILE")]
    area_geojson: Option<PathBuf>,
    /// Draw the error of the location of the interferer for each of its positions (SVG)
    ///
    /// Relays locate it by measurements. Needs the table `listen` and a single interferer, with an area
    #[arg(long, value_name = "FILE")]
    listen_svg: Option<PathBuf>,
    /// Accept a plan in which the way between two neighbours crosses a no-fly area
    #[arg(long)]
    allow_crossing: bool,
}

/// Request: exactly one of these, or none if the scenario has `fleet.flying`.
#[derive(Args, Debug)]
#[group(multiple = false)]
struct Wanted {
    /// The best places for this number of relays, 1 to 1000; by default fleet.flying of the scenario
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1, 1000))]
    uavs: Option<u16>,
    /// Find the fewest relays that give every hop this SIR, linear, 1e-9 to 1e9
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-9, 1e9))]
    target_sir: Option<f64>,
    /// --target-sir in dB, -90 to 90
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = |text: &str| number(text, -90.0, 90.0))]
    target_sir_db: Option<f64>,
    /// Find the fewest relays that carry this data rate, bit/s, 1e-9 to 1e15. Needs a bandwidth
    #[arg(long, value_name = "R", value_parser = |text: &str| number(text, 1e-9, 1e15))]
    target_rate_bps: Option<f64>,
}

/// Parses a distance from Tx, m. Its range depends on the scenario, and is checked later.
fn along(text: &str) -> Result<f64, String> {
    text.parse()
        .map_err(|_| "must be a number, metres from Tx".to_owned())
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Altitude {
    /// Altitudes of the scenario
    Given,
    /// Free within the scenario's band, and beside the line within its limits
    Free,
    /// Best places on the line with the diffraction losses of the terrain
    Terrain,
}

impl Altitude {
    /// Returns the placement method that relays use in flight at these altitudes.
    const fn method(self) -> PlannedMethod {
        match self {
            Self::Given | Self::Terrain => PlannedMethod::Align,
            Self::Free => PlannedMethod::Joint,
        }
    }
}

impl Options {
    fn file(&self) -> String {
        self.scenario.as_ref().map_or_else(
            || "default scenario".into(),
            |file| file.display().to_string(),
        )
    }

    const fn unit(&self) -> Unit {
        match self.wanted.target_sir_db {
            Some(_) => Unit::Decibels,
            None => Unit::Linear,
        }
    }

    /// Returns the requested number of relays, or the target SIR of the request.
    ///
    /// For a requested data rate the result is 1 relay; the planner replaces this number later.
    fn number(&self) -> Number {
        let wanted = &self.wanted;
        match (wanted.uavs, wanted.target_sir, wanted.target_sir_db) {
            (Some(uavs), ..) => Number::Of(uavs),
            (_, Some(target), _) => Number::Meeting(target),
            (_, _, Some(db)) => Number::Meeting(10_f64.powf(db / 10.0)),
            (None, None, None) => Number::Of(1),
        }
    }
}

/// Checks the options that need an interferer with an area or a no-fly area.
fn check_area(options: &Options, scenario: &Scenario) -> Result<(), Failure> {
    let AreaOptions {
        quantile,
        area_svg,
        area_geojson,
        listen_svg,
        ..
    } = &options.area;
    let refuse = |line: String| Err(Failure::input(line));
    if options.area.allow_crossing && scenario.no_fly.is_empty() {
        return refuse(format!(
            "--allow-crossing: is only for a scenario with a [[no_fly]], and {} has none",
            options.file()
        ));
    }
    let file = |path: &PathBuf| path.display().to_string();
    let asked = [
        ("--quantile", quantile.map(|quantile| quantile.to_string())),
        ("--area-svg", area_svg.as_ref().map(file)),
        ("--area-geojson", area_geojson.as_ref().map(file)),
        ("--listen-svg", listen_svg.as_ref().map(file)),
    ];
    let Some(first) = scenario.areas.keys().next() else {
        return match asked
            .iter()
            .find_map(|(name, value)| Some((name, value.as_ref()?)))
        {
            Some((name, value)) => refuse(format!(
                "{name} {value}: needs an [[interferer]] with an area"
            )),
            None => Ok(()),
        };
    };
    let named = |line: &str| {
        refuse(format!(
            "{}: interferer[{first}].area: {line}",
            options.file()
        ))
    };
    let asks_rate =
        options.rates || options.bandwidth_hz.is_some() || options.wanted.target_rate_bps.is_some();
    if scenario.link.is_some() || asks_rate {
        return named(
            "has no data rates: leave out [link], --rates, --bandwidth-hz and --target-rate-bps",
        );
    }
    if options.out.is_some() {
        return named(
            "cannot be used with --out, because relays compute with one position of an interferer",
        );
    }
    let is_located = scenario.listen.is_some() && scenario.sources().len() == 1;
    if let Some(path) = listen_svg.as_ref().filter(|_| !is_located) {
        return refuse(format!(
            "--listen-svg {}: needs [listen] and a single [[interferer]]",
            file(path)
        ));
    }
    if quantile.is_some() && options.altitude == Altitude::Terrain {
        return refuse("--quantile: cannot be used with --altitude terrain".to_owned());
    }
    Ok(())
}

/// Returns the reason why the scenario's no-fly areas forbid the plan; `None` if they do not.
fn no_fly(options: &Options, scenario: &Scenario, plan: &Plan) -> Option<String> {
    let chain: Vec<_> = plan.places.iter().map(|(place, _)| *place).collect();
    let is_free = options.altitude == Altitude::Free;
    area::problem(scenario, &chain, is_free, options.area.allow_crossing)
}

fn joined(lines: [Option<String>; 2]) -> Option<String> {
    let lines: Vec<String> = lines.into_iter().flatten().collect();
    (!lines.is_empty()).then(|| lines.join("; "))
}

/// Computes how well relays with `[listen]` locate the interferer, and writes the maps.
///
/// The maps are the files of `--area-svg`, `--area-geojson` and `--listen-svg`. `None` without `[listen]`.
fn over_area(
    options: &Options,
    scenario: &Scenario,
    plan: &Plan,
) -> Result<Option<Locating>, Failure> {
    let AreaOptions {
        area_svg,
        area_geojson,
        listen_svg,
        ..
    } = &options.area;
    let is_drawn = area_svg.is_some() || area_geojson.is_some();
    if scenario.areas.is_empty() || !is_drawn && scenario.listen.is_none() {
        return Ok(None);
    }
    let mut cells = area::cells(scenario, plan);
    let locating = Locating::new(scenario, plan, &mut cells).map_err(Failure::input)?;
    for (file, option, shown) in [
        (area_svg, "--area-svg", Shown::Sir),
        (listen_svg, "--listen-svg", Shown::Error),
    ] {
        if let Some(file) = file {
            save(file, option, &area_map::svg(scenario, plan, &cells, shown))?;
        }
    }
    if let (Some(file), Some(line)) = (area_geojson, &scenario.line) {
        let text = area_map::geojson(line, &cells)
            .map_err(|line| Failure::input(format!("--area-geojson: {line}")))?;
        save(file, "--area-geojson", &text)?;
    }
    Ok(locating)
}

/// Rejects a target SIR for relays that would choose the positions of the largest data rate instead.
///
/// These are relays with free altitudes and fitted slots (as long as each hop needs), except in a random field.
fn check_target(options: &Options, scenario: &Scenario) -> Result<(), Failure> {
    let wanted = &options.wanted;
    let asked = match (wanted.target_sir, wanted.target_sir_db) {
        (Some(sir), _) => format!("--target-sir {sir:?}"),
        (_, Some(db)) => format!("--target-sir-db {db:?}"),
        (None, None) => return Ok(()),
    };
    // In a [field] relays keep one altitude, and choose the positions of the largest SIR.
    let is_known = matches!(scenario.interference, Interference::Sources(_));
    if options.altitude == Altitude::Free && scenario.has_fitted_slots() && is_known {
        return Err(Failure::input(format!(
            "{asked}: cannot be used with --altitude free and link.access = \"fitted\", because such relays choose the positions of the largest data rate; use --target-rate-bps or --uavs instead, or set link.access to \"slots\" or \"channels\", or use `--altitude given`"
        )));
    }
    Ok(())
}

/// Checks the options that conflict with `--out`, before the planning starts.
///
/// In flight, relays choose their x themselves, and in an interference field keep their altitude.
fn check_out(options: &Options, scenario: &Scenario) -> Result<(), Failure> {
    let Some(file) = &options.out else {
        return Ok(());
    };
    let refuse = |line: String| Err(Failure::input(line));
    if let Some(x_m) = options.x_m {
        return refuse(format!(
            "--x-m {x_m:?}: cannot be used with --out, because relays compute their positions along the line themselves: leave --x-m out"
        ));
    }
    let is_field = matches!(scenario.interference, Interference::Field(_));
    if is_field && options.altitude == Altitude::Free {
        return refuse(
            "--altitude free: cannot be used with --out if the mission has a [field], because its relays stay at geometry.altitude_m: leave --altitude out, and set geometry.altitude_m to geometry.altitude_min_m, the best altitude"
                .to_owned(),
        );
    }
    let is_fitted = scenario.has_fitted_slots();
    if scenario.listen.is_some()
        && (is_fitted || scenario.reverse > 0.0 && options.altitude == Altitude::Free)
    {
        let (what, remedy) = if is_fitted {
            ("link.access = \"fitted\"", "use another link.access")
        } else {
            (
                "--altitude free with link.reverse above 0",
                "leave --altitude out",
            )
        };
        return refuse(format!(
            "{what}: cannot be used with --out and [listen], because the method joint needs a known interferer: {remedy}, or leave [listen] out"
        ));
    }
    let size = deployment(options)?.fleet_size();
    if let Some(size) = size.filter(|it| it.flying < it.relays) {
        if options.altitude == Altitude::Terrain {
            return refuse(
                "--altitude terrain: cannot be used with --out and spares, because each relay would have the altitude of one position: leave fleet.flying out"
                    .to_owned(),
            );
        }
        // All relays of the fleet load this mission.
        if let Err(refusal) = mission::mission(scenario, size.relays, options.tolerance) {
            return refuse(format!("{}: {refusal}", options.file()));
        }
    }
    if options.wanted.target_rate_bps.is_none()
        && let Number::Of(relays) = options.number()
    {
        sections(options, relays)?;
    }
    if file.exists() && !options.force {
        return refuse(format!(
            "--out {}: exists already; --force overwrites it",
            file.display()
        ));
    }
    Ok(())
}

/// Positions that the relays of a plan agree on in flight.
struct InFlight {
    /// Scenario with the altitudes chosen for the terrain; `None` if none were chosen.
    own: Option<Scenario>,
    flown: Flown,
    flight: Option<Flight>,
    /// Reason why the relays cannot fly to the positions that they agree on; `None` if they can.
    problem: Option<String>,
}

impl InFlight {
    /// Computes the positions that the relays of `plan` agree on. With terrain it simulates the flight.
    fn new(
        options: &Options,
        scenario: &Scenario,
        plan: &Plan,
        terrain: Option<(&Elevation, &TerrainReport)>,
    ) -> Result<Self, NoPlan> {
        let method = options.altitude.method();
        let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
        let chosen = terrain.filter(|_| options.altitude == Altitude::Terrain);
        let own = chosen.map(|(elevation, _)| {
            terrain_flight::with_altitudes(scenario, elevation, plan, options.tolerance)
        });
        let own = own.transpose()?;
        let scenario = own.as_ref().unwrap_or(scenario);
        let flown = flown(scenario, relays, method, options.tolerance)?;
        let flight = terrain.map(|(elevation, report)| {
            let how = (method, options.tolerance);
            let allow_blocked = options.terrain.allow_blocked;
            let flight = Flight::new(scenario, elevation, &flown.plan, how, allow_blocked)?;
            Ok::<_, NoPlan>(match &own {
                Some(_) => flight.compared(plan, report.terrain_sir_db),
                None => flight,
            })
        });
        let flight = flight.transpose()?;
        let blocked = flight.as_ref().and_then(|flight| flight.problem.clone());
        let blocked = blocked.map(|line| match own {
            Some(_) => format!("{line}; on board the relays compute x without the terrain: give another --uavs, or a larger terrain.above_ground_max_m"),
            None => line,
        });
        let problem = joined([blocked, no_fly(options, scenario, &flown.plan)]);
        let problem = problem.map(|line| {
            format!(
                "at the positions on which {} would agree, {line}",
                counted(relays.into())
            )
        });
        Ok(Self {
            own,
            flown,
            flight,
            problem,
        })
    }
}

/// Report about the flight of a plan's relays.
#[derive(Default)]
struct Flying {
    /// Text with the next command for the user; empty without `--out`.
    next: String,
    flight: Option<Flight>,
    /// Reason why the flight over terrain was not simulated; `None` if it was, or if there is no terrain.
    unknown: Option<String>,
    /// Reason why the relays cannot fly over the terrain; `None` if none was found.
    problem: Option<String>,
}

/// Simulates the flight of a plan over the terrain, for a request without `--out`.
///
/// The report is empty without terrain.
fn flying(
    options: &Options,
    scenario: &Scenario,
    plan: &Plan,
    terrain: Option<(&Elevation, &TerrainReport)>,
) -> Flying {
    let Some(_) = terrain else {
        return Flying::default();
    };
    let is_field = matches!(scenario.interference, Interference::Field(_));
    let unknown = if options.x_m.is_some() {
        Some("relays compute x themselves, without --x-m")
    } else if is_field && options.altitude == Altitude::Free {
        Some("in a [field] relays stay at geometry.altitude_m, also with --altitude free")
    } else if scenario.areas.is_empty() {
        None
    } else {
        Some(
            "relays compute with one position of an interferer, and this scenario has an interferer.area",
        )
    };
    if let Some(why) = unknown {
        return Flying {
            unknown: Some(why.to_owned()),
            ..Flying::default()
        };
    }
    match InFlight::new(options, scenario, plan, terrain) {
        Ok(InFlight {
            flight, problem, ..
        }) => Flying {
            unknown: flight.as_ref().and_then(Flight::unknown),
            flight,
            problem,
            ..Flying::default()
        },
        Err(none) => Flying {
            problem: Some(format!("in flight: {}", said(none, options))),
            ..Flying::default()
        },
    }
}

fn said(none: NoPlan, options: &Options) -> String {
    match none {
        NoPlan::Wrong(line) => line,
        NoPlan::Unmet(why, _) => why.say(options.unit()),
    }
}

/// Writes the file of `--out`: the scenario, and the positions that its relays will choose.
fn write_out(
    options: &Options,
    file: &Path,
    scenario: &Scenario,
    (plan, number): (&Plan, Number),
    radio: Option<&Radio>,
    terrain: Option<(&Elevation, &TerrainReport)>,
) -> Result<Flying, Failure> {
    let method = options.altitude.method();
    let failed = |none| match none {
        NoPlan::Wrong(why) => Failure::input(why),
        NoPlan::Unmet(..) => Failure::unmet(said(none, options)),
    };
    let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
    let InFlight {
        own,
        flown,
        flight,
        problem,
    } = InFlight::new(options, scenario, plan, terrain).map_err(failed)?;
    let scenario = own.as_ref().unwrap_or(scenario);
    let sections = sections(options, relays)?;
    let sir = db(flown.plan.sir());
    if flown.is_poor() {
        return Err(Failure::unmet(format!(
            "--out {}: not written: {}",
            file.display(),
            flown.describe()
        )));
    }
    if let Number::Meeting(target) = number
        && flown.plan.sir() < target * (1.0 - options.tolerance)
    {
        return Err(Failure::unmet(format!(
            "--out {}: not written: {} would agree on positions with {sir:.2} dB, below the target of {:.2} dB; give a larger --uavs",
            file.display(),
            counted(relays.into()),
            db(target)
        )));
    }
    if let (Some(target_bps), Some(radio)) = (options.wanted.target_rate_bps, radio) {
        let rate_bps = Rate::of(&flown.plan, scenario, radio).worse(scenario.reverse);
        if rate_bps < target_bps * (1.0 - options.tolerance) {
            return Err(Failure::unmet(format!(
                "--out {}: not written: the positions on which {} would agree carry {rate_bps:.6e} bit/s, below the target of {target_bps:.6e} bit/s; give a larger --uavs",
                file.display(),
                counted(relays.into())
            )));
        }
    }
    if let Some(line) = problem {
        return Err(Failure::unmet(format!(
            "--out {}: not written: {line}",
            file.display()
        )));
    }
    if terrain.is_none() {
        let lines = no_fly_warnings(scenario, relays, (method, options.tolerance));
        for line in lines.map_err(failed)? {
            command::print_line(&format!("warning: {line}"));
        }
    }
    let text = match &options.scenario {
        Some(scenario) => std::fs::read_to_string(scenario)
            .map_err(|error| Failure::input(format!("{}: {error}", scenario.display())))?,
        None => DEFAULT.to_owned(),
    };
    let wrong = |why| Failure::input(format!("--out {}: {why}", file.display()));
    let text = match &own {
        Some(_) => with_altitudes(&text, &flown.plan).map_err(wrong)?,
        None => text,
    };
    // Paths in a file are relative to its folder.
    let folder = options.scenario.as_deref().and_then(Path::parent);
    let is_moved = folder != file.parent();
    let text = match folder {
        Some(folder) if is_moved => moved(&text, folder).map_err(wrong)?,
        _ => text,
    };
    let text = match terrain {
        Some((elevation, _)) if is_moved || !options.terrain.dem.is_empty() => {
            with_files(&text, &elevation.spec.files).map_err(wrong)?
        }
        _ => text,
    };
    let text = with_plan(&text, &planned(&flown, method, options.tolerance)).map_err(wrong)?;
    save(file, "--out", &text)?;
    let file = file.display().to_string();
    let text = format!(
        "{file}: the scenario and its plan were written: {} {} on positions with {sir:.3} dB; {}",
        counted(relays.into()),
        if relays == 1 {
            "that agrees"
        } else {
            "that agree"
        },
        next(
            &file,
            &sections,
            terrain.is_some() && options.terrain.allow_blocked
        )
    );
    Ok(Flying {
        next: text,
        unknown: flight.as_ref().and_then(Flight::unknown),
        flight,
        problem: None,
    })
}

/// Loads the sections `[network]`, `[fleet]`, `[companion]` and `[ground]` of the scenario file.
fn deployment(options: &Options) -> Result<Deployment, Failure> {
    let Some(path) = &options.scenario else {
        return Ok(Deployment::default());
    };
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::input(format!("{name}: {error}")))?;
    Deployment::parse(&name, &text).map_err(|error| Failure::input(error.to_string()))
}

/// Loads the same sections. It is an error if the chain has a number of relays other than `relays`.
fn sections(options: &Options, relays: u16) -> Result<Deployment, Failure> {
    let sections = deployment(options)?;
    sections
        .check_plan(&options.file(), Some(relays))
        .map_err(|error| Failure::input(error.to_string()))?;
    Ok(sections)
}

fn next(file: &str, sections: &Deployment, allow_blocked: bool) -> String {
    let more = if allow_blocked {
        " --allow-blocked"
    } else {
        ""
    };
    let firmware = format!("  cargo provision --scenario {file} --all --out-dir DIR{more}\n");
    let fleet = FleetReport::new(sections.fleet_size(), sections.fleet.flying.unwrap_or(0));
    let spares = fleet.map_or_else(String::new, |it| {
        format!("for the spares (relays {}) also --spare\n", it.list())
    });
    let companions = format!("  cargo companion --config {file} --index INDEX\n{spares}");
    let is_for_companions = sections.companion != Companion::default();
    match (
        probe_after_ms(&sections.network, None, file),
        is_for_companions,
    ) {
        (Ok(_), false) => format!("next:\n{firmware}"),
        (Ok(_), true) => {
            format!(
                "next, on the Linux computer of every drone:\n{companions}or, for drones with the firmware:\n{firmware}"
            )
        }
        (Err(why), _) => format!(
            "the firmware cannot use this file ({why}); next, on the Linux computer of every drone:\n{companions}"
        ),
    }
}

fn db(sir: f64) -> f64 {
    10.0 * sir.log10()
}

fn save(file: &Path, option: &str, text: &str) -> Result<(), Failure> {
    std::fs::write(file, text)
        .map_err(|error| Failure::input(format!("{option} {}: {error}", file.display())))
}

fn check_map(options: &Options, scenario: &Scenario) -> Result<(), Failure> {
    let option = match (&options.geojson, &options.kml, &options.area.area_geojson) {
        (Some(_), ..) => "--geojson",
        (None, Some(_), _) => "--kml",
        (None, None, Some(_)) => "--area-geojson",
        (None, None, None) => return Ok(()),
    };
    if scenario.line.is_some() {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{}: site: is missing, but {option} needs it; allowed: [site] with tx and rx, each {{ lat_deg, lon_deg, amsl_m }}",
        options.file()
    )))
}

fn write_map(
    options: &Options,
    scenario: &Scenario,
    plan: &Plan,
    terrain: Option<&TerrainReport>,
) -> Result<(), Failure> {
    if options.geojson.is_none() && options.kml.is_none() {
        return Ok(());
    }
    let map = Map::new(scenario, plan)
        .map_err(|line| Failure::input(format!("{}: {line}", options.file())))?;
    let map = match (&scenario.line, terrain) {
        (Some(line), Some(terrain)) => map.above(line, terrain),
        _ => map,
    };
    for number in &map.left_out {
        command::print_line(&format!(
            "note: interferer {number} is more than 5 km from the line, and is left out of the map"
        ));
    }
    if let Some(file) = &options.geojson {
        save(file, "--geojson", &geojson(&map))?;
    }
    if let Some(file) = &options.kml {
        let text = kml(&map, &options.file())
            .map_err(|error| Failure::input(format!("--kml {}: {error}", file.display())))?;
        save(file, "--kml", &text)?;
    }
    Ok(())
}
