//! `cargo chain`: simulated relays, each running the on-board code, find their places over simulated serial links.

use std::io::{IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::{Parser, ValueEnum};
use host_tests::brief::{self, Refusal};
use host_tests::report::ChainReport;
use host_tests::scenario::{Interference, Scenario};
use host_tests::sim::chain::Chain;
use host_tests::sim::faults::Faults;
use host_tests::sim::outcome::Outcome;
use host_tests::sim::setup::Setup;
use host_tests::svg::{self, Picture};
use indicatif::{ProgressBar, ProgressStyle};
use uav_relay::{Mission, Schedule};

/// N simulated relays exchange real frames over simulated serial links until they hold the places that make the worst hop
/// as good as it can be.
#[derive(Parser, Debug)]
#[command(name = "chain", bin_name = "cargo chain", disable_version_flag = true)]
struct Options {
    /// Scenario file (TOML); without it the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    uavs: u16,
    /// How the places are found
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    method: Method,
    /// The fixed step of the -step methods, linear SIR, 1e-6 to 1e6
    #[arg(long, value_name = "E", default_value_t = 0.1, value_parser = |text: &str| number(text, 1e-6, 1e6))]
    epsilon: f64,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1
    #[arg(long, value_name = "T", default_value_t = 1e-4, value_parser = |text: &str| number(text, 1e-6, 0.1))]
    tolerance: f64,
    /// Probability that a frame never arrives, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    loss: f64,
    /// Probability that bytes of a frame arrive changed, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    corrupt: f64,
    /// Probability that a frame arrives twice, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    duplicate: f64,
    /// Probability that a frame is overtaken by others, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    reorder: f64,
    /// The head does not solve the chain beforehand; it brackets from scratch
    #[arg(long)]
    no_predict: bool,
    /// Relay I goes silent S virtual seconds after the start; repeatable
    #[arg(long, value_name = "I@S", value_parser = kill)]
    kill: Vec<Kill>,
    /// Seed of every random draw; the same seed gives the same run, byte for byte
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// One JSON object on standard output and nothing else there
    #[arg(long)]
    json: bool,
    /// Draw the chain in the x-h plane, with each hop's SIR
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Method {
    /// Algorithm 1 with bracketed targets
    Align,
    /// Algorithm 1 with the paper's fixed step
    AlignStep,
    /// Algorithm 1, then Algorithm 2 (not built yet)
    Adjust,
    /// Joint distance and altitude (not built yet)
    Altitude,
    /// Algorithm 4 with bracketed targets (not built yet)
    Stochastic,
    /// Algorithm 4 with the fixed step (not built yet)
    StochasticStep,
}

/// One `--kill`.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Kill {
    index: u16,
    at: uav_relay::Instant,
}

fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let range = || format!("must be a number within {least:?} to {most:?}");
    let value: f64 = text.parse().map_err(|_| range())?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(range())
    }
}

fn probability(text: &str) -> Result<f64, String> {
    number(text, 0.0, 0.9)
}

fn kill(text: &str) -> Result<Kill, String> {
    let form = "must be I@S, a relay (1 to N) and seconds after the start (0 to 1e6)";
    let (index, seconds) = text.split_once('@').ok_or(form)?;
    let index = index.parse().map_err(|_| form)?;
    let seconds = number(seconds, 0.0, 1e6).map_err(|_| form)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 0 to 1e12"
    )]
    let micros = (seconds * 1e6) as u64;
    Ok(Kill {
        index,
        at: uav_relay::Instant::from_micros(micros),
    })
}

/// Why there is no result: the one line on standard error, and the exit status.
struct Failure {
    status: u8,
    line: String,
}

impl Failure {
    fn input(line: impl Into<String>) -> Self {
        Self {
            status: 2,
            line: line.into(),
        }
    }
}

fn main() -> ExitCode {
    let options = match Options::try_parse() {
        Ok(options) => options,
        Err(error) => return usage(&error),
    };
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{}", failure.line);
            ExitCode::from(failure.status)
        }
    }
}

/// Help as it is; of an error only the line that says what is wrong.
fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        print!("{error}");
        return ExitCode::SUCCESS;
    }
    let text = error.to_string();
    let wrong = text
        .lines()
        .find(|line| !line.trim().is_empty())
        .unwrap_or("wrong options");
    eprintln!("{}", wrong.trim_start_matches("error: "));
    ExitCode::from(2)
}

fn run(options: &Options) -> Result<(), Failure> {
    let method = options
        .method
        .to_possible_value()
        .map_or_else(String::new, |value| value.get_name().to_owned());
    let schedule = match options.method {
        Method::Align => Schedule::Bracketed,
        Method::AlignStep => Schedule::FixedStep {
            step: options.epsilon,
        },
        _ => {
            let line = format!("--method {method}: not there yet; there are align and align-step");
            return Err(Failure::input(line));
        }
    };
    if let Some(kill) = options
        .kill
        .iter()
        .find(|kill| !(1..=options.uavs).contains(&kill.index))
    {
        let line = format!(
            "--kill {}@..: relay must be within 1 to {}",
            kill.index, options.uavs
        );
        return Err(Failure::input(line));
    }
    let scenario = match &options.scenario {
        Some(file) => Scenario::load(file).map_err(|error| Failure::input(error.to_string()))?,
        None => Scenario::default(),
    };
    for index in scenario
        .relays
        .keys()
        .filter(|index| **index > options.uavs)
    {
        eprintln!(
            "note: [[relay]] index {index} is left out of a chain of {}",
            options.uavs
        );
    }
    let (mission, profiles) = match brief::mission(&scenario, options.uavs, options.tolerance) {
        Ok(briefed) => briefed,
        Err(refusal @ Refusal::NoRoom) => {
            let report =
                ChainReport::refused(&method, options.uavs, options.seed, &refusal.to_string());
            return show(options, &report);
        }
        Err(refusal) => {
            let file = options
                .scenario
                .as_ref()
                .map_or("default scenario".into(), |file| file.to_string_lossy());
            return Err(Failure::input(format!("{file}: {refusal}")));
        }
    };
    let mut setup = Setup::new(mission);
    setup.profiles = profiles;
    setup.settings.schedule = schedule;
    setup.settings.predict = !options.no_predict;
    setup.seed = options.seed;
    setup.kills = options
        .kill
        .iter()
        .map(|kill| (kill.index, kill.at))
        .collect();
    setup.faults = Faults {
        loss: options.loss,
        corrupt: options.corrupt,
        duplicate: options.duplicate,
        reorder: options.reorder,
    };
    let chain = Chain::new(setup).map_err(|error| Failure::input(error.to_string()))?;
    let outcome = watch(chain);
    let report = ChainReport::new(&method, &mission, &outcome, options.seed);
    if let Some(file) = &options.svg {
        let drawing = svg::draw(&picture(&method, &mission, &scenario, &outcome, &report));
        std::fs::write(file, drawing).map_err(|error| {
            Failure::input(format!(
                "{}: --svg cannot be written: {error}",
                file.display()
            ))
        })?;
    }
    show(options, &report)
}

/// Runs the chain, with a progress line on a terminal once it takes longer than a second.
fn watch(mut chain: Chain) -> Outcome {
    let started = Instant::now();
    let mut line: Option<ProgressBar> = None;
    while !chain.step(20_000) {
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
    chain.finish()
}

fn picture(
    method: &str,
    mission: &Mission,
    scenario: &Scenario,
    outcome: &Outcome,
    report: &ChainReport,
) -> Picture {
    let interferers = match &scenario.interference {
        Interference::Sources(sources) => {
            sources.iter().map(|s| (s.power_w, s.x_m, s.y_m)).collect()
        }
        Interference::Field(_) => Vec::new(),
    };
    let mut hop_sir: Vec<f64> = report.relays.iter().map(|relay| relay.sir).collect();
    hop_sir.extend(report.rx_sir);
    Picture {
        title_method: method.to_owned(),
        distance_m: f64::from(mission.config().distance_m),
        interferers,
        nodes: report
            .relays
            .iter()
            .map(|relay| (relay.x_m, relay.h_m))
            .collect(),
        hop_sir,
        lost: (1..)
            .zip(&outcome.relays)
            .filter(|(_, relay)| relay.killed.is_some())
            .map(|(index, _)| index)
            .collect(),
    }
}

/// Prints the report; what it says went wrong is the failure.
fn show(options: &Options, report: &ChainReport) -> Result<(), Failure> {
    let text = if options.json {
        serde_json::to_string(report)
            .map(|json| json + "\n")
            .map_err(|error| Failure::input(error.to_string()))?
    } else {
        report.table()
    };
    // A reader that has had enough, such as `head`, is no fault of the chain.
    _ = std::io::stdout().write_all(text.as_bytes());
    match &report.error {
        None => Ok(()),
        Some(error) => Err(Failure {
            status: 1,
            line: error.clone(),
        }),
    }
}
