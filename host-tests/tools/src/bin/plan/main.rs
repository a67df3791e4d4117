//! `cargo plan`: number, positions and expected SIRs of relays, before flight.

mod map;
mod options;
mod out;

use std::process::ExitCode;

use clap::Parser as _;
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::command::{self, Failure};
use uav_relay_sim::svg::{self, Picture, room};
use uav_relay_tools::plan::rate::{self, Rates};
use uav_relay_tools::plan::report::{PlanReport, RateReport};
use uav_relay_tools::plan::{self, NoPlan, Number, Plan, PlanRequest, Why};

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
    let number = options.number();
    out::check(options, &scenario)?;
    map::check(options, &scenario)?;
    let ask = PlanRequest {
        number,
        free_altitude: options.altitude == Altitude::Free,
        x_m: options.x_m,
        tolerance: options.tolerance,
    };
    let planned = match options.target_rate() {
        Some(target) => by_rate(&scenario, &ask, target),
        None => plain(&scenario, &ask, options.bandwidth_hz),
    };
    match planned {
        Ok(Planned {
            plan: Some(plan),
            number,
            rates,
        }) => {
            let uavs = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
            if let Some(line) = mission::left_out(&scenario, uavs) {
                return Err(Failure::input(format!("{}: {line}", options.file())));
            }
            if let Some(file) = &options.svg {
                command::write(file, &svg::draw(&picture(&plan, &scenario)))?;
            }
            map::write(options, &scenario, &plan)?;
            let next = out::write(options, &scenario, &plan, number)?;
            let asked = match options.target_rate() {
                // The SIR that a rate needs was not itself requested.
                Some(_) => Number::Of(uavs),
                None => number,
            };
            show(
                options,
                &PlanReport::new(&plan, asked, options.unit())
                    .with_rates(rates)
                    .in_noise(&scenario.noise),
            )?;
            if !options.json {
                command::print(&next);
            }
            Ok(())
        }
        Ok(Planned {
            plan: None, rates, ..
        }) => {
            let error = rates.as_ref().map(too_fast).unwrap_or_default();
            let why = Why::Plain(error);
            let report = PlanReport::unmet(&why, None, Number::Of(0), options.unit());
            let report = PlanReport {
                uavs: None,
                ..report
            };
            show(options, &report.with_rates(rates).in_noise(&scenario.noise))
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

/// Plan, requested number or SIR, and data rates.
struct Planned {
    /// `None` if no number of relays carries the target rate.
    plan: Option<Plan>,
    number: Number,
    rates: Option<RateReport>,
}

/// Plans for a number of relays or an SIR, with data rates if a bandwidth is given.
fn plain(
    scenario: &Scenario,
    ask: &PlanRequest,
    bandwidth_hz: Option<f64>,
) -> Result<Planned, NoPlan> {
    let plan = plan::plan(scenario, ask)?;
    let rates = match bandwidth_hz {
        Some(bandwidth_hz) => {
            let Rates { best, .. } = Rates::new(scenario, ask, bandwidth_hz, None)?;
            Some(RateReport::new(Some(&plan), bandwidth_hz, None, best))
        }
        None => None,
    };
    Ok(Planned {
        plan: Some(plan),
        number: ask.number,
        rates,
    })
}

fn by_rate(
    scenario: &Scenario,
    ask: &PlanRequest,
    (target_bps, bandwidth_hz): (f64, f64),
) -> Result<Planned, NoPlan> {
    let Rates { best, meeting } = Rates::new(scenario, ask, bandwidth_hz, Some(target_bps))?;
    let rates = RateReport::new(meeting.as_ref(), bandwidth_hz, Some(target_bps), best);
    let relays = meeting.as_ref().map_or(0, |plan| plan.places.len());
    let slots = rate::slots(u16::try_from(relays).unwrap_or(u16::MAX));
    let needed = rate::sir_for_hop(bandwidth_hz, target_bps * f64::from(slots));
    Ok(Planned {
        plan: meeting,
        number: Number::Meeting(needed),
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
    format!(
        "--target-rate-bps {target_bps:?}: {among} carries it: all hops share one frequency in equal time slots; {}. PlanRequest for less, or for more \
         with a larger --bandwidth-hz",
        rates.best
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
        room: room(
            &plan.mission,
            plan.places.iter().map(|(place, _)| f64::from(place.y_m)),
            &scenario.sources(),
        ),
        hop_sir: plan.sirs.clone(),
        ..Picture::default()
    }
}

/// Prints the report, and fails with its error message, if any.
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
