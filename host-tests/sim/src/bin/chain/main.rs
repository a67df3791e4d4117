//! `cargo chain`: simulated relays, each running the on-board code, find their places over simulated serial links.

mod air;
mod capture;
mod flight;
mod hostile;
mod listening;
mod options;
mod times;
mod upload;

use std::io::IsTerminal as _;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::{Parser as _, ValueEnum as _};
use indicatif::{ProgressBar, ProgressStyle};
use uav_relay::{Measure, Mission, Placement, Schedule, Sites, Wiring};
use uav_relay_scenario::mission::{self, Refusal};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::{Interference, Scenario};
use uav_relay_sim::beta::beta_w;
use uav_relay_sim::command::{self, Failure};
use uav_relay_sim::report::{
    self, AgainstAll, AirReport, AttackReport, ChainReport, ListenedReport, timeline,
};
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::{Outcome, RelayEnd};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::svg::{self, Others, Picture, room};

use capture::AirCapture;
use options::{Method, Options};

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(run(&options)),
        Err(error) => command::usage(&error),
    }
}

fn run(options: &Options) -> Result<(), Failure> {
    let method = options
        .method
        .to_possible_value()
        .map_or_else(String::new, |value| value.get_name().to_owned());
    let scenario = match &options.scenario {
        Some(file) => Scenario::load(file).map_err(|error| Failure::input(error.to_string()))?,
        None => Scenario::default(),
    };
    if !scenario.knows_interference() {
        let line = "interferer: is missing: without [[interferer]] a scenario with [listen] is for cargo provision alone";
        return Err(Failure::input(line.to_owned()));
    }
    agree(options, &method, &scenario)?;
    if let Some(line) = mission::left_out(&scenario, options.uavs) {
        return Err(Failure::input(format!("{}: {line}", file(options))));
    }
    let tolerance = options.tolerance.unwrap_or(1e-4);
    let (mission, profiles) = match mission::mission(&scenario, options.uavs, tolerance) {
        Ok(briefed) => briefed,
        // Who has given no scenario has none of its keys before them.
        Err(Refusal::NoRoom { .. }) if options.scenario.is_none() => {
            let fits = |uavs: &u16| mission::mission(&scenario, *uavs, tolerance).is_ok();
            let most = (1..options.uavs).rev().find(fits).unwrap_or(1);
            let line = format!(
                "--uavs {}: must be within 1 to {most} without a --scenario: relays keep {} m apart on {} m",
                options.uavs, scenario.min_separation_m, scenario.distance_m
            );
            if options.json {
                let report = ChainReport::refused(&method, options.uavs, options.seed, &line);
                command::print(&command::json(&report)?);
            }
            return Err(Failure::input(line));
        }
        Err(refusal @ Refusal::NoRoom { .. }) => {
            let report =
                ChainReport::refused(&method, options.uavs, options.seed, &refusal.to_string());
            return show(options, &report);
        }
        Err(refusal) => {
            return Err(Failure::input(format!("{}: {refusal}", file(options))));
        }
    };
    let sites = scenario.line.map(|line| Sites {
        tx: line.sites[0],
        rx: line.sites[1],
    });
    let mut setup = setup(options, mission, sites)?;
    let axis = scenario.line.map(|line| line.axis);
    options.hostile.flight.prepare(&mut setup, axis)?;
    setup.profiles = profiles;
    setup.held = mission::held(&scenario, options.uavs);
    let told = setup.mission;
    options
        .listening
        .prepare(&mut setup, &scenario, options.uavs)?;
    let mut capture = match &options.capture {
        Some(file) => Some(AirCapture::begin(file, &setup)?),
        None => None,
    };
    setup.record = capture.is_some();
    let outcome = fly(options, &scenario, setup.clone(), capture.as_mut())?;
    capture.map_or(Ok(()), AirCapture::finish)?;
    setup.record = false;
    let listened = ListenedReport::of(&setup, &outcome);
    // What is reported is held against what is there, whatever the relays were told.
    setup.mission = options.listening.moved(told, outcome.ended);
    let flown = report::flown(&setup, &outcome);
    let mut report = ChainReport::new(&method, &flown, &outcome, options.seed);
    report.channel = (setup.settings.wiring == Wiring::Shared).then_some("shared");
    report.air = AirReport::of(&setup, &outcome);
    report.listened = listened;
    if let (None, false, Some(sir)) = (&listened, options.hostile.uploads.are_planned(), report.sir)
    {
        report.against_all = AgainstAll::of(&scenario, &report.relays, sir);
    }
    if setup.attack.take().is_some() {
        let auth = setup.auth;
        let attack = AttackReport::new(auth, &outcome, &fly(options, &scenario, setup, None)?);
        report.error = report.error.or_else(|| attack.harm());
        report.attack = Some(attack);
    }
    if let Some(file) = &options.svg {
        let picture = picture(&flown, &scenario, &outcome, &report);
        command::write(file, &svg::draw(&picture))?;
    }
    show(options, &report)
}

/// The scenario, as a message names it.
fn file(options: &Options) -> String {
    let file = options.scenario.as_ref();
    file.map_or_else(
        || "default scenario".to_owned(),
        |file| file.display().to_string(),
    )
}

/// Whether the options go together, and with the scenario.
fn agree(options: &Options, method: &str, scenario: &Scenario) -> Result<(), Failure> {
    options.agree(method)?;
    options.listening.agree()?;
    options
        .hostile
        .agree(options.uavs, options.closed_loop.is_some())?;
    let is_field = matches!(scenario.interference, Interference::Field(_));
    if options.method.is_for_fields() != is_field {
        let line = if is_field {
            format!(
                "--method {method} needs an [[interferer]], and the scenario has a [field]: take stochastic or stochastic-step"
            )
        } else {
            format!("--method {method} needs a --scenario with a [field] of interference")
        };
        return Err(Failure::input(line));
    }
    let uploads = options.hostile.uploads.are_planned();
    if uploads && is_field {
        let line = "--upload needs an [[interferer]], and the scenario has a [field]";
        return Err(Failure::input(line));
    }
    if let Some(one) = mission::hypothetical(scenario) {
        command::complain(&format!(
            "note: one interferer of {:.3} W at x = {:.3} m, y = {:.3} m stands for all, and SIRs are against it; `cargo plan` has what \
             its places are worth against all",
            one.power_w, one.x_m, one.y_m
        ));
        if uploads {
            command::complain(
                "note: an upload changes that one, and what it leaves out stays as it is",
            );
        }
    }
    Ok(())
}

/// What the options say of the run.
fn setup(options: &Options, mission: Mission, sites: Option<Sites>) -> Result<Setup, Failure> {
    let mut setup = Setup::new(mission);
    setup.settings.schedule = match options.method {
        Method::AlignStep | Method::StochasticStep => Schedule::FixedStep {
            step: options.epsilon.unwrap_or(0.1),
        },
        _ => Schedule::Bracketed,
    };
    setup.settings.method = match options.method {
        Method::Joint => uav_relay::Method::Joint,
        Method::Adjust => uav_relay::Method::Adjust(uav_relay::Adjust {
            rounds: options.rounds.unwrap_or(500),
            explore_m: options.explore_m.unwrap_or(10.0),
            local: options.grid.unwrap_or_default(),
        }),
        _ => uav_relay::Method::Align,
    };
    setup.settings.predict = !options.no_predict;
    setup.seed = options.seed;
    options.hostile.prepare(&mut setup, sites)?;
    options.hostile.air.prepare(&mut setup, options.loss)?;
    setup.faults = Faults {
        loss: options.loss,
        corrupt: options.corrupt,
        duplicate: options.duplicate,
        reorder: options.reorder,
    };
    Ok(setup)
}

/// Runs the chain to its end; in a closed loop as often as that measures.
fn fly(
    options: &Options,
    scenario: &Scenario,
    mut setup: Setup,
    mut capture: Option<&mut AirCapture>,
) -> Result<Outcome, Failure> {
    let start = |setup| Chain::new(setup).map_err(|error| Failure::input(error.to_string()));
    let (Interference::Field(field), Some(rounds)) = (&scenario.interference, options.closed_loop)
    else {
        let mut chain = start(setup)?;
        watch(&mut chain, &mut capture)?;
        return end(chain, capture);
    };
    let i_max_w = narrow(field.i_max_w);
    setup.mission = mission::told_of_an_even_field(&setup.mission);
    setup.settings.measure = Some(Measure {
        i_max_w,
        samples: SAMPLES,
    });
    let mut chain = start(setup)?;
    watch(&mut chain, &mut capture)?;
    for _ in 0..rounds {
        chain.measure(SAMPLES, |place, rng| {
            let (alpha, beta) = mission::shapes(field, f64::from(place.x_m));
            beta_w(rng, alpha, beta, i_max_w)
        });
        chain.restart();
        watch(&mut chain, &mut capture)?;
    }
    end(chain, capture)
}

/// What came of it, once the capture has the last frame.
fn end(mut chain: Chain, capture: Option<&mut AirCapture>) -> Result<Outcome, Failure> {
    if let Some(capture) = capture {
        capture.follow(&mut chain, true)?;
    }
    Ok(chain.finish())
}

/// Samples that a relay of a closed loop takes at each place.
const SAMPLES: u32 = 10_000;

/// Runs the chain, with a progress line on a terminal once it takes longer than a second.
fn watch(chain: &mut Chain, capture: &mut Option<&mut AirCapture>) -> Result<(), Failure> {
    let started = Instant::now();
    let mut line: Option<ProgressBar> = None;
    while !chain.step(20_000) {
        if let Some(capture) = capture {
            capture.follow(chain, false)?;
        }
        if line.is_none()
            && started.elapsed() > Duration::from_secs(1)
            && std::io::stderr().is_terminal()
        {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
                bar.set_style(style);
            }
            line = Some(bar);
        }
        if let Some(bar) = &line {
            let (sweeps, now) = chain.progress();
            bar.set_message(format!(
                "sweep {sweeps}, {:.0} s of virtual time",
                now.as_micros() as f64 / 1e6
            ));
            bar.tick();
        }
    }
    if let Some(bar) = line {
        bar.finish_and_clear();
    }
    Ok(())
}

/// The chain at its places in the mission that it flies.
fn picture(
    mission: &Mission,
    scenario: &Scenario,
    outcome: &Outcome,
    report: &ChainReport,
) -> Picture {
    let mut hop_sir: Vec<f64> = report.relays.iter().map(|relay| relay.sir).collect();
    hop_sir.extend(report.rx_sir);
    let silent = (1..)
        .zip(&outcome.relays)
        .filter(|(_, relay)| relay.killed.is_some());
    let left_out: Vec<usize> = report.lost.iter().map(|relay| relay.index.into()).collect();
    let lost = silent
        .map(|(index, _)| index)
        .filter(|index| !left_out.contains(index))
        .collect();
    let place = |relay: &RelayEnd| {
        let at = |place: Placement| (f64::from(place.x_m), f64::from(place.altitude_m));
        relay.setpoint.map_or((f64::NAN, f64::NAN), at)
    };
    let aside = outcome.relays.iter().map(|relay| {
        relay
            .setpoint
            .map_or(f64::NAN, |place| f64::from(place.y_m))
    });
    let nodes = if report.relays.is_empty() && report.lost.is_empty() {
        Vec::new()
    } else {
        outcome.relays.iter().map(place).collect()
    };
    let before = scenario.sources();
    let believed = report.listened.and_then(|listened| listened.believed);
    let uploaded = report.version.is_some_and(|version| version > 0);
    let (interferers, others, others_are) =
        if let (true, uav_relay::Interference::Source(at)) = (uploaded, mission.interference()) {
            let now = [at.power_w, at.x_m, at.y_m].map(f64::from);
            (vec![now.into()], before, Others::Before)
        } else {
            let believed = believed.map(|at| [at.power_w, at.x_m, at.y_m].map(f64::from).into());
            (before, believed.into_iter().collect(), Others::Believed)
        };
    Picture {
        title_method: report.method.clone(),
        distance_m: f64::from(mission.config().distance_m),
        interferers,
        others,
        others_are,
        nodes,
        room: room(mission, aside),
        hop_sir,
        lost,
        left_out,
        events: timeline::words(&report.timeline),
    }
}

/// Prints the report; what it says went wrong is the failure.
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
