//! `cargo plan`: how many relays, where, and what to expect of them, before anything flies.

mod map;
mod options;
mod out;

use std::process::ExitCode;

use clap::Parser as _;
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::command::{self, Failure};
use uav_relay_sim::svg::{self, Picture, room};
use uav_relay_tools::plan::report::PlanReport;
use uav_relay_tools::plan::{self, Ask, NoPlan, Plan};

use options::{Altitude, Options};

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(run(&options)),
        Err(error) => command::usage(&error),
    }
}

fn run(options: &Options) -> Result<(), Failure> {
    let scenario = match &options.scenario {
        Some(file) => Scenario::load(file).map_err(|error| Failure::input(error.to_string()))?,
        None => Scenario::default(),
    };
    if !scenario.knows_interference() {
        let line = "interferer: is missing: without [[interferer]] a scenario with [listen] is for cargo provision alone";
        return Err(Failure::input(line.to_owned()));
    }
    let number = options.number()?;
    out::check(options, &scenario)?;
    map::check(options, &scenario)?;
    let ask = Ask {
        number,
        free_altitude: options.altitude == Altitude::Free,
        x_m: options.x_m,
        tolerance: options.tolerance,
    };
    match plan::plan(&scenario, &ask) {
        Ok(plan) => {
            let uavs = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
            if let Some(line) = mission::left_out(&scenario, uavs) {
                return Err(Failure::input(format!("{}: {line}", options.file())));
            }
            if let Some(file) = &options.svg {
                command::write(file, &svg::draw(&picture(&plan, &scenario)))?;
            }
            map::write(options, &scenario, &plan)?;
            let next = out::write(options, &scenario, &plan, number)?;
            show(
                options,
                &PlanReport::new(&plan, number, options.unit(), options.bandwidth_hz)
                    .in_noise(&scenario.noise),
            )?;
            if !options.json {
                command::print(&next);
            }
            Ok(())
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
        room: room(
            &plan.mission,
            plan.places.iter().map(|(place, _)| f64::from(place.y_m)),
        ),
        hop_sir: plan.sirs.clone(),
        ..Picture::default()
    }
}

/// Prints the report; what it says went wrong is the failure.
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
