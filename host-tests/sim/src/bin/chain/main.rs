//! `cargo chain`: simulated relays run the on-board code and find their positions over simulated links.

mod capture;
mod progress;

use std::process::ExitCode;

use clap::Parser as _;
use uav_relay_scenario::Scenario;
use uav_relay_sim::cli::{Options, Prepared, Refused};
use uav_relay_sim::command::{self, Failure};
use uav_relay_sim::report::{AttackReport, ChainReport};
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::outcome::Outcome;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::svg;

use capture::AirCapture;
use progress::Progress;

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(run(&options)),
        Err(error) => command::usage(&error),
    }
}

fn run(options: &Options) -> Result<(), Failure> {
    let (scenario, name) = match &options.scenario {
        Some(file) => {
            let scenario =
                Scenario::load(file).map_err(|error| Failure::input(error.to_string()))?;
            (scenario, Some(file.display().to_string()))
        }
        None => (Scenario::default(), None),
    };
    let mut run = match Prepared::new(options, scenario, name.as_deref()) {
        Ok(prepared) => prepared,
        Err(Refused::Failed(failure)) => return Err(failure),
        Err(Refused::Reported(report, None)) => return show(options, &report),
        Err(Refused::Reported(report, Some(failure))) => {
            if options.json {
                command::print(&command::json(&*report)?);
            }
            return Err(failure);
        }
    };
    let mut capture = match &options.capture {
        Some(file) => Some(AirCapture::begin(file, &run.setup)?),
        None => None,
    };
    let recorded = Setup {
        record: capture.is_some(),
        ..run.setup.clone()
    };
    let outcome = fly(&run, recorded, capture.as_mut())?;
    capture.map_or(Ok(()), AirCapture::finish)?;
    let mut report = run.report(&outcome);
    if run.setup.attack.is_some() {
        let quiet = Setup {
            attack: None,
            ..run.setup.clone()
        };
        let attack = AttackReport::new(run.setup.auth, &outcome, &fly(&run, quiet, None)?);
        report.error = report.error.or_else(|| attack.harm());
        report.attack = Some(attack);
    }
    if let Some(file) = &options.svg {
        command::write(file, &svg::draw(&run.picture(&outcome, &report)))?;
    }
    show(options, &report)
}

fn fly(
    run: &Prepared<'_>,
    setup: Setup,
    mut capture: Option<&mut AirCapture>,
) -> Result<Outcome, Failure> {
    let mut chain = run.fly(setup, |chain| watch(chain, &mut capture))?;
    if let Some(capture) = capture {
        capture.follow(&mut chain, true)?;
    }
    Ok(chain.finish())
}

/// Runs the chain until it settles, with a progress line.
fn watch(chain: &mut Chain, capture: &mut Option<&mut AirCapture>) -> Result<(), Failure> {
    let mut line = Progress::begin();
    while !chain.step(20_000) {
        if let Some(capture) = capture {
            capture.follow(chain, false)?;
        }
        line.show(|| {
            let (sweeps, now) = chain.progress();
            let seconds = now.as_micros() as f64 / 1e6;
            format!("sweep {sweeps}, {seconds:.0} s of virtual time")
        });
    }
    Ok(())
}

/// Prints the report; an error in it is returned as the failure.
fn show(options: &Options, report: &ChainReport) -> Result<(), Failure> {
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
